"""Take the package `tests` out of an installed distribution that brings one: it would hide ours.

python .ci/without_tests.py dartpy
"""

import sys
from importlib.metadata import PackageNotFoundError, files

try:
    found = files(sys.argv[1]) or []
except PackageNotFoundError:  # not to be had here
    found = []
for file in found:
    if file.parts[0] == "tests":
        file.locate().unlink(missing_ok=True)
