"""manual_pages.py FOLDER VERSION: a page for every command, from the commands themselves. Run in the root of the sources."""

import sys
from pathlib import Path

from click_man.core import write_man_pages

sys.path.insert(0, ".")

from spook_tracker.tracker.cli.main import main

folder, version = Path(sys.argv[1]), sys.argv[2]
folder.mkdir(parents=True, exist_ok=True)
write_man_pages("tracker", main, version=version, target_dir=str(folder))
