"""One name for everything that is installed: `engine`, `scalar_tests` and `tracker` live below it.

Physics engines have folders called engine and tracker of their own; beside them this distribution takes one
name only. The folders themselves stay at the top of the repository and are linked here.
"""

from pathlib import Path as _Path

if not (_Path(__file__).parent / "engine").is_dir():
    raise ImportError(
        "spook_tracker/engine is no folder, since this checkout was made without symbolic links; in a clone run "
        "`git config core.symlinks true && git checkout-index -f -a`, and unpack an archive again with `tar -xf`"
    )
