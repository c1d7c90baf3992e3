"""A gate is green only if it has measured: whatever an engine or a catalogue does to the process that imports it.

Every way that was found to end a gate with exit code 0 and nothing measured, put to the command line.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.store.history import History
from tests.places import TOYS

TOY = "from toy_engine import build_info, simulate\n"
QUESTIONS = "from toy_questions import CATALOGUE\n"
NIGHT = ("nightly", "--quick")
GATES = [("run",), NIGHT, ("ci", "night", "--quick"), ("ci", "change")]
DECIDES = "imported by the process that decides"

pytestmark = pytest.mark.timeout(120)  # a gate that never ends is no gate

ENDS_THE_PROCESS = {
    "sys.exit()": "import sys; sys.exit()",
    "sys.exit(0) with an atexit": "import atexit, os, sys; atexit.register(os._exit, 0); sys.exit(0)",
    "os._exit(0)": "import os; os._exit(0)",
    "an exception that is no Exception": "class Stop(BaseException): pass\nraise Stop('now')",
    "killed": "import os, signal; os.kill(os.getpid(), signal.SIGKILL)",
    "a thread that exits": "import os, threading, time\n"
    "threading.Thread(target=lambda: (time.sleep(0.01), os._exit(0))).start()\ntime.sleep(5)",
    "every descriptor closed": "import os; os.closerange(3, 256); os._exit(0)",
    "a tale of its own": 'import os\nfor n in range(3, 256):\n try: os.write(n, b\'{"type":"Done"}\\n\')\n'
    " except OSError: pass\nos._exit(0)",
}
WHERE = {
    "an engine": lambda act: {"engine": act + "\n" + TOY, "catalogue": QUESTIONS},
    "a catalogue": lambda act: {"engine": TOY, "catalogue": act + "\n" + QUESTIONS},
    "build_info": lambda act: {
        "engine": TOY + "class BuildInfo:\n def __getattr__(self, name):\n  "
        + act.replace("\n", "\n  ") + "\nbuild_info = BuildInfo()\n", "catalogue": QUESTIONS,
    },
}  # fmt: skip


@pytest.fixture(autouse=True)
def empty(desk: None, sqlite_template: Path) -> None:
    """A database at its newest revision, without runs."""
    shutil.copyfile(sqlite_template, "tracker.db")


def gate(command: tuple[str, ...], **modules: str) -> Result:
    """The command with an engine and a catalogue of these texts, found where one stands."""
    stops = f"import os\nif os.getpid() == {os.getpid()}: raise BaseException('{DECIDES}')\n"  # or it ends this test, too
    for name, text in modules.items():
        Path(f"their_{name}.py").write_text(stops + text)
    asked = ["--engine", "their_engine", "--catalogue", "their_catalogue", "--workers", "1"]
    done = CliRunner().invoke(main, [*command, *asked], prog_name="tracker")
    assert DECIDES not in f"{done.output}{done.exception}"
    return done


def runs() -> int:
    with History.open("sqlite:///tracker.db") as history:
        return len(history.runs())


@pytest.mark.parametrize("command", GATES, ids=" ".join)
def test_a_gate_that_measures_is_green(command: tuple[str, ...]) -> None:
    done = gate(command, engine=TOY, catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (0, 1), done.output


@pytest.mark.parametrize("command", GATES, ids=" ".join)
def test_what_is_imported_cannot_end_any_gate(command: tuple[str, ...]) -> None:
    done = gate(command, engine="import os; os._exit(0)", catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (2, 0)
    assert "nothing was measured" in done.stderr
    assert "ended with exit code 0 before it was done" in done.stderr


@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("act", ENDS_THE_PROCESS)
def test_whatever_ends_the_process_that_imports_it_is_said_and_is_not_green(act: str, where: str) -> None:
    done = gate(("run",), **WHERE[where](ENDS_THE_PROCESS[act]))

    assert (done.exit_code, runs()) == (2, 0), done.output
    assert "nothing was measured" in done.stderr
    assert not {"their_engine", "their_catalogue"} & set(sys.modules), DECIDES


def test_an_exit_is_told_with_the_line_it_stands_in() -> None:
    done = gate(("run",), engine="import sys\nsys.exit()", catalogue=QUESTIONS)

    assert "SystemExit" in done.stderr
    assert "their_engine.py, line 4" in done.stderr


def test_a_tale_without_end_is_not_listened_to_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("spook_tracker.tracker.measure.apart.LONGEST", 1 << 16)
    monkeypatch.setattr("spook_tracker.tracker.measure.apart.PATIENCE", 0.1)
    talks = (
        "import os\nwhile True:\n for n in range(3, 12):\n  try:\n   os.set_blocking(n, False)\n"
        "   os.write(n, b'x' * 4096)\n  except OSError: pass\n"
    )

    done = gate(("run",), engine=talks, catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (2, 0)
    assert "stopped answering before it was done" in done.stderr


HANGS = {
    "waits": "import time; time.sleep(3600)",
    "works": "while True: pass",
    "starts what holds its streams and waits": "import os, time\nos.fork()\ntime.sleep(3600)",
    "cannot be asked to end": "import signal, time\nsignal.pthread_sigmask(signal.SIG_BLOCK, range(1, 64))\n"
    "time.sleep(3600)",
}


@pytest.mark.parametrize(
    ("act", "where"),
    [*((act, "an engine") for act in HANGS), ("waits", "a catalogue"), ("waits", "build_info")],
)
def test_what_hangs_while_it_is_imported_is_ended_at_the_time_limit(
    act: str, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("spook_tracker.tracker.measure.apart.START_LIMIT", 0.5)

    done = gate(("run", "--time-limit", "1"), **WHERE[where](HANGS[act]))

    assert (done.exit_code, runs()) == (2, 0), done.output
    assert "their_engine and the catalogue their_catalogue were not imported within 1.5 s" in done.stderr


HURTS = {
    "prints without being asked": ("print('x' * 1000000)", 0, ""),
    "leaves what it forked": ("import os, time\nif os.fork() == 0: time.sleep(3600)", 0, ""),
    "takes all memory": (
        "import resource\nresource.setrlimit(resource.RLIMIT_AS, (1 << 31, 1 << 31))\nbytearray(1 << 40)", 2, "MemoryError",
    ),
    "lacks an instruction of this processor": (
        "import os, signal; os.kill(os.getpid(), signal.SIGILL)", 2, "was ended by signal 4 (SIGILL)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", HURTS)
def test_what_an_engine_does_while_it_is_imported_is_an_outcome(what: str) -> None:
    act, code, said = HURTS[what]

    done = gate(("run",), engine=act + "\n" + TOY, catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (code, 1 - code // 2), done.output
    assert said in done.stderr


JUDGES = {
    "the judge": "import spook_tracker.tracker.judge.standing as s\ns.is_red = lambda *a: False\n"
    "import spook_tracker.tracker.cli.report_table as r\nr.is_red = lambda *a: False\nr.red = lambda *a: []\n"
    "import spook_tracker.tracker.cli.measuring as m\nm.ended = lambda *a: None\n",
    "the exit": "import sys\nsys.exit = lambda *a: None\nimport spook_tracker.tracker.cli.options as o\no.RED = 0\n",
}
BAD = "import os; os.environ['TOY_ERROR'] = '9.0'\n" + TOY


@pytest.mark.parametrize("what", JUDGES)
def test_an_engine_that_changes_the_judge_changes_nothing(what: str) -> None:
    done = gate(("run",), engine=JUDGES[what] + BAD, catalogue=QUESTIONS)

    assert done.exit_code == 1
    assert "✗ red" in done.output


def test_a_limit_that_is_changed_where_it_is_asked_is_noticed_where_it_is_judged() -> None:
    lenient = "from spook_tracker.scalar_tests.case import Metric\nMetric.passes = lambda self, value: True\n"

    done = gate(("run",), engine=lenient + BAD, catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (2, 0)
    assert "was called good against its limit by the process that measured it" in done.stderr


NOTHING = {
    "no test": ("CATALOGUE = {}", "the catalogue has no test"),
    "tests that ask for no value": (
        "from dataclasses import replace\nfrom toy_questions import CATALOGUE as THEIRS\n"
        "CATALOGUE = {n: replace(t, measurements=(), ladders=(), stability=()) for n, t in THEIRS.items()}",
        "tests that ask for no value",
    ),
}


@pytest.mark.parametrize("what", NOTHING)
@pytest.mark.parametrize("command", [("run",), NIGHT], ids=" ".join)
def test_a_catalogue_that_asks_nothing_is_no_green(command: tuple[str, ...], what: str) -> None:
    catalogue, said = NOTHING[what]

    done = gate(command, engine=TOY, catalogue=catalogue)

    assert (done.exit_code, runs()) == (2, 0)
    assert said in done.stderr


@pytest.mark.parametrize("command", [("run",), NIGHT], ids=" ".join)
def test_an_engine_that_supports_nothing_is_no_green(command: tuple[str, ...]) -> None:
    lacks = TOY + (
        "from spook_tracker.engine.protocol import NotSupported\n"
        "def simulate(*asked, **more): raise NotSupported('it does not support this')\n"
    )

    done = gate(command, engine=lacks, catalogue=QUESTIONS)

    assert done.exit_code == 2
    assert "toy supports none of the values asked for: it does not support this" in done.stderr


def test_names_that_match_no_test_are_no_green() -> None:
    done = gate(("run", "fal"), engine=TOY, catalogue=QUESTIONS)

    assert done.exit_code == 2
    assert "there is no test named 'fal'" in done.stderr


def test_files_called_like_modules_of_ours_are_not_taken_for_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that decides looks for its own modules in no folder of the repository."""
    import subprocess

    for name in ("lzma", "sqlalchemy", "statistics", "json"):
        Path(f"{name}.py").write_text(f"import os; os.write(2, b'{name} is taken'); os._exit(0)")
    Path("tracker.toml").write_text('engine = "their_engine"\ncatalogue = "their_catalogue"\n')
    Path("their_engine.py").write_text("import os; os.environ['TOY_ERROR'] = '9.0'\n" + TOY)
    Path("their_catalogue.py").write_text(QUESTIONS)
    script = Path(sys.executable).with_name("tracker")
    monkeypatch.setenv("PYTHONPATH", str(TOYS))

    done = subprocess.run(
        [script, "nightly", "--quick"], capture_output=True, text=True, check=False, timeout=120
    )

    assert done.returncode == 1, done.stdout + done.stderr


def test_a_worker_that_ends_with_exit_code_0_has_not_answered() -> None:
    ends = TOY + "import os\ndef simulate(*asked, **more): os._exit(0)\n"

    done = gate(("run",), engine=ends, catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (1, 1)
    assert "died while answering" in done.output


def test_an_executor_cannot_end_a_gate() -> None:
    Path("their_executor.py").write_text("import os; os._exit(0)")

    done = gate(("run", "--executor", "their_executor:make"), engine=TOY, catalogue=QUESTIONS)

    assert (done.exit_code, runs()) == (2, 0)


@pytest.mark.parametrize(
    "command", [("list",), ("show", "fall"), ("explain", "fall"), ("engines",)], ids=" ".join
)
def test_commands_that_only_show_do_not_end_in_silence_either(
    command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("their_engine.py").write_text("import sys; sys.exit()")
    options = () if command[0] == "engines" else ("--engine", "their_engine")
    if not options:
        monkeypatch.setattr("spook_tracker.tracker.cli.report_engines.known", lambda: ("their_engine",))

    done = CliRunner().invoke(main, [*command, *options], prog_name="tracker")

    sys.modules.pop("their_engine", None)
    assert done.exit_code == 2
    assert "their_engine.py, line 1" in done.stderr
