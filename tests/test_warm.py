"""What is forked is what would have been started: its line, folder, environment, streams, end and parent."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tests import warm

TELLS = """import json, os, sys
main = sys.modules["__main__"]
print(json.dumps([sys.argv, os.getcwd(), os.environ.get("WORD"), sys.path, sys.stdin.read(), os.getppid(), main.__name__,
    os.getsid(0) == os.getpid(), sorted(os.listdir("/proc/self/fd"))[:3], sys.flags.safe_path]))
"""
ENDS = {"at its end": "", "a code": "import sys; sys.exit(3)", "a word": "import sys; sys.exit('word')", "raised": "1/0",
    "a signal": "import os; os.abort()", "at exit": "import atexit, os; atexit.register(os._exit, 5)"}  # fmt: skip

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux hands processes on")


@pytest.fixture(params=["forked", "started"])
def started(request: pytest.FixtureRequest) -> bool:
    """Whether processes are started, as before `warm.begin`."""
    if request.param == "started":
        warm.end()
        request.addfinalizer(warm.begin)
    return request.param == "started"


def told(*words: str, **given: object) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-P", "-c", *words]
    return subprocess.run(line, capture_output=True, text=True, check=False, **given)  # type: ignore[call-overload]


def test_a_process_has_what_it_was_given(started: bool, tmp_path: Path) -> None:
    given = {**os.environ, "WORD": "given", "PYTHONPATH": "here"}
    done = told(TELLS, "a", "b", cwd=tmp_path, env=given, input="asked", start_new_session=True)

    said = json.loads(done.stdout)
    assert said[:3] == [["-c", "a", "b"], str(tmp_path), "given"]
    assert said[3][0] == str(tmp_path / "here") and said[3].count(said[3][0]) == 1
    assert said[4:] == ["asked", os.getpid(), "__main__", True, ["0", "1", "2"], True]


@pytest.mark.parametrize("how", ENDS)
def test_a_process_ends_as_it_would(started: bool, how: str) -> None:
    done = told(ENDS[how])

    assert done.returncode == {"a code": 3, "a word": 1, "raised": 1, "a signal": -6, "at exit": 5}.get(
        how, 0
    )
    assert done.stderr.strip().rpartition("\n")[2] == {
        "a word": "word",
        "raised": "ZeroDivisionError: division by zero",
    }.get(how, "")
    assert ("tests/warm.py" in done.stderr) == (how == "raised" and not started)


@pytest.mark.parametrize(("words", "given"), [(["-O"], {}), ([], {"PYTHONOPTIMIZE": "1"})])
def test_what_says_more_of_the_interpreter_is_started(words: list[str], given: dict[str, str]) -> None:
    line = [
        sys.executable,
        *words,
        "-P",
        "-c",
        "import sys; print(sys.flags.optimize, 'numpy' in sys.modules)",
    ]
    done = subprocess.run(line, env={**os.environ, **given}, capture_output=True, text=True, check=True)

    assert done.stdout == "1 False\n"
    assert told("import sys; print(sys.flags.optimize, 'numpy' in sys.modules)").stdout == "0 True\n"


def test_what_waits_outlives_the_thread_that_asked_first() -> None:
    warm.close()
    warm.begin()
    thread = threading.Thread(target=told, args=("",))
    thread.start()
    place = Path(f"/proc/self/task/{thread.native_id}")
    thread.join()
    while place.exists():
        time.sleep(0.001)

    assert told("import sys; print('numpy' in sys.modules)").stdout == "True\n"
