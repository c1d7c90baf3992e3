"""The house rules that a reader would otherwise have to trust."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import FunctionType

import pytest

from spook_tracker import engine
from spook_tracker.engine.observe import Quantity
from spook_tracker.scalar_tests.catalogue import CATALOGUE, QUESTIONS
from tests.places import ROOT
from tests.test_changelog import faults

PYTHON_FILES = sorted(
    path for package in ("engine", "scalar_tests", "tracker") for path in (ROOT / package).rglob("*.py")
)
ROOMS = (
    ".ci/a", ".clang-tidy", ".github/workflows/a.yml", "Makefile", "README.md", "action.yml", "bench/a.py", "docs/how-to/a.md",
    "docs/a.toml", "engine/a.py", "engine/native/a.cmake", "engine/native/src/a.hpp", "engine/peers/a.mjs",
    "examples/a/a.cpp", "examples/a/a.json", "migrations/versions/a.py", "scalar_tests/a/a.py", "site/static/a.css", "site/static/a.js",
    "site/templates/a.html", "spook_tracker/a.py", "tests/a/test_a.py", "tracker/judge/a.py",
)  # fmt: skip


def test_site_holds_data_only() -> None:
    """A .py file under site/ could shadow the standard library's module of that name."""
    assert list((ROOT / "site").rglob("*.py")) == []


def test_only_the_engine_touches_its_binary() -> None:
    """import-linter cannot name a binary module, so this guards engine._core."""
    outside = [path for path in PYTHON_FILES if path.parent.name != "engine" and "_core" in path.read_text()]

    assert outside == []


def test_native_code_takes_nothing_from_the_c_library_that_it_may_round_as_it_likes() -> None:
    """sqrt, abs, round, ldexp and frexp are exact by definition; the others differ between C libraries."""
    inexact = r"std::(sin|cos|tan|a(sin|cos|tan|tan2)|(sin|cos|tan)h|hypot|pow|exp2?|expm1|log(2|10|1p)?|cbrt|fma)\("

    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in sorted((ROOT / "engine" / "native" / "src").rglob("*.[chi]*"))
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if re.search(inexact, line)
    ]

    assert found == []


def retired(folder: Path) -> tuple[int, list[tuple[str, str]]]:
    """What `make lint` says of a folder: the exit code, and each file with a retired word in it."""
    ask = [sys.executable, str(ROOT / ".ci" / "words.py"), str(folder)]
    told = subprocess.run(ask, capture_output=True, text=True)
    found = re.findall(r'^(.*):\d+: "(\w+)": say', told.stdout, re.MULTILINE)
    assert len(found) == len(told.stdout.splitlines())
    return told.returncode, [(Path(file).relative_to(folder).as_posix(), word) for file, word in found]


def test_native_code_is_told_in_the_words_of_the_field(tmp_path: Path) -> None:
    """Retired words come back neither in code nor in comments; `make lint` names them and what to say instead."""
    text = 'int sweeps = 0;  // who "strikes" who-m\nPartingAxis parting_axes(const char* name = "blow");\n'.replace(
        "-", ""
    )
    (tmp_path / "some.cpp").write_text(text)

    assert retired(tmp_path) == (
        1,
        [("some.cpp", word) for word in ("sweeps", "who", "who" + "m", "PartingAxis", "parting_axes")],
    )
    assert retired(ROOT / "engine" / "native") == (0, [])


@pytest.mark.parametrize("clone", [True, False], ids=["clone", "archive"])
def test_every_room_is_told_without_persons(tmp_path: Path, clone: bool) -> None:
    """A retired word is seen in each room, in text, in quotes and in names; not in what others wrote."""
    said = "No-body some-bodys ANY-body every-body who-ever who-m some-one any-one every-one h-e h-im h-is sh-e h-er h-ers"
    words = said.replace("-", "").split()
    lines = [f"{words[0]} reads this", f"is_{words[1]} = 1", f"'{words[2]}'", f'"by {words[3]}"', *words[4:]]
    fuzzed = ("tests/fuzz/settings/a", "engine/native/fuzz/corpus/a/a")
    others = ("LICENSE", "site/static/a-LICENSE.txt", "site/static/a.min.js", *fuzzed)
    for name in (*ROOMS, *others):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("\n".join(lines))
    (tmp_path / "a.png").write_bytes(b"\x89" + words[0].encode())
    if clone:
        subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)

    code, found = retired(tmp_path)

    assert code == 1
    assert sorted(found) == sorted((room, word) for room in ROOMS for word in words)


def test_this_tree_is_told_without_persons() -> None:
    tops = subprocess.run(
        ["git", "ls-tree", "--name-only", "HEAD"], cwd=ROOT, capture_output=True, text=True
    ).stdout
    if not tops:
        pytest.skip("not a git checkout")

    assert retired(ROOT) == (0, [])
    rooms = {top for top in tops.splitlines() if (ROOT / top).is_dir()}
    assert rooms == {room.partition("/")[0] for room in ROOMS if "/" in room}, "plant a word in each room"


def test_all_names_of_the_engine_exist_and_are_public() -> None:
    assert len(engine.__all__) == len(set(engine.__all__))
    for name in engine.__all__:
        assert hasattr(engine, name)
        assert not name.startswith("_")


def test_the_catalogue_lists_every_scalar_test() -> None:
    """A file whose module has a TEST is a scalar test, and must be in the table."""
    folder = ROOT / "scalar_tests"
    files = {
        ".".join(path.relative_to(folder).with_suffix("").parts)
        for path in folder.rglob("*.py")
        if re.search(r"^TEST\b", path.read_text(), re.MULTILINE)
    }

    assert set(QUESTIONS.values()) == files
    assert set(CATALOGUE) == set(QUESTIONS)


def test_every_path_in_the_architecture_exists() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text()
    paths = re.findall(r"`([\w.-]+(?:/[\w.-]*)+)`", text)

    missing = [path for path in paths if not (ROOT / path).exists()]

    assert len(paths) > 20
    assert missing == []


def test_the_drawing_of_a_step_is_the_step() -> None:
    """What step.cpp calls, in its order; each stage is a file of its name that says what it reads and writes."""
    drawing = (ROOT / "ARCHITECTURE.md").read_text().split("\n    step\n")[1].split("\n\n")[0]
    drawn = re.findall(r"^[ │┌└─]+(\w+)", drawing, re.MULTILINE)
    folder = ROOT / "engine/native/src/rigid"
    told = re.sub(r"//.*", "", (folder / "step.cpp").read_text())

    def calls(name: str) -> list[str]:
        body = re.search(rf"^void RigidSystem::{name}\(\) {{\n(.*?)^}}", told, re.MULTILINE | re.DOTALL)
        assert body is not None
        return [call for call in re.findall(r"(\w+)\(\)", body.group(1)) if call in drawn]

    order = [
        inner for call in calls("step") for inner in (call, *(calls(call) if call.startswith("find") else ()))
    ]
    order.insert(order.index("solve_velocities") + 1, "impact")
    assert [*order, "observe"] == drawn
    assert "impact()" in (folder / "solve_velocities.cpp").read_text()
    for stage in set(drawn) - {"find_velocities", "wake_met"}:
        top = (folder / f"{stage}.cpp").read_text().split("#include")[0]
        assert "reads:" in top and "writes:" in top, stage


def test_a_new_shape_and_a_new_joint_touch_the_files_that_are_said() -> None:
    """The cone and the point on a line are found in those, and nowhere else in the engine."""
    section = (ROOT / "CONTRIBUTING.md").read_text().split("## Add a shape or a joint")[1].split("\n## ")[0]
    table, rest = section.split("\nThen put")
    joints = rest.split("A joint that")[1]
    shape = r"\b(Cone|cone_plane|Primitive cone)\b|ShapeKind::cone|Primitive::cone"
    joint = r"\bPointOnLine\b|\bpoint_on_line\b"
    sources = [*(ROOT / "engine").rglob("*.py"), *(ROOT / "engine/native/src").rglob("*.[ch]pp")]
    for text, pattern, count in ((table, shape, 11), (joints, joint, 3)):
        said = set(re.findall(r"`(engine/[\w./]+)`", text))
        found = {
            path.relative_to(ROOT).as_posix() for path in sources if re.search(pattern, path.read_text())
        }
        assert found == said and len(said) == count


def test_every_module_says_what_it_is() -> None:
    without = [path.name for path in PYTHON_FILES if not re.match(r'r?"""\S', path.read_text())]

    assert without == []


def test_the_public_names_of_the_engine_are_documented() -> None:
    """Quantities are a table in the docstring of their module; everything else speaks for itself."""
    names = [name for name in engine.__all__ if isinstance(getattr(engine, name), type | FunctionType)]

    without = [name for name in names if not (getattr(engine, name).__doc__ or "").strip()]

    assert len(names) > 30
    assert [name for name in without if not issubclass(getattr(engine, name), Quantity)] == []


def test_no_file_names_the_machine_it_was_written_on() -> None:
    names = subprocess.run(
        ["git", "ls-files", "*.py", "*.md", "*.cpp", "*.hpp", "*.toml", "*.yml", "Makefile"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    ).stdout.split()
    if not names:
        pytest.skip("not a git checkout")

    guilty = [n for n in names if re.search(r"(^|[^\w.])/(home|root|work)/\w", (ROOT / n).read_text())]

    assert guilty == []


def test_help_is_quick_because_it_imports_nothing_heavy() -> None:
    """`tracker --help` must not pay for pandas, SciPy, SQLAlchemy or Plotly."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "spook_tracker", "--help"],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )

    assert done.returncode == 0
    assert re.search(r"\| +click\b", done.stderr)
    for heavy in ("numpy", "pandas", "scipy", "sqlalchemy", "plotly", "rich", "jinja2", "msgspec", "engine"):
        assert not re.search(rf"\| +(spook_tracker\.)?{heavy}\b", done.stderr), heavy


def test_files_of_long_tests_are_there() -> None:
    """A file that was renamed would silently start last."""
    from tests.conftest import FIRST

    assert [path for path in FIRST if not path.exists()] == []


def test_no_file_is_longer_than_contributing_says() -> None:
    (most,) = map(int, re.findall(r"none has more than (\d+)", (ROOT / "CONTRIBUTING.md").read_text()))
    rooms = ("engine", "scalar_tests", "tracker", "tests", "bench", "migrations", "docs", "examples")
    files = [
        path
        for room in rooms
        for path in (ROOT / room).rglob("*")
        if path.suffix in (".py", ".cpp", ".hpp", ".inl")
    ]
    files += [
        path
        for path in (ROOT / "site").rglob("*")
        if path.suffix in (".js", ".css", ".html") and ".min." not in path.name
    ]

    assert len(files) > 500
    assert {".js", ".css", ".html"} <= {path.suffix for path in files}
    assert {path.name: n for path in files if (n := len(path.read_text().splitlines())) > most} == {}


def test_the_changelog_is_one_effect_a_line_under_its_kind() -> None:
    assert faults((ROOT / "CHANGELOG.md").read_text(encoding="utf-8")) == []


def test_any_and_object_become_rarer_in_the_tracker() -> None:
    """What is `Any` is checked by no tool, and what is `object` says nothing to a reader; sixty of the one and fewer of
    the other are meant to be left, as names in the code. A change that removes some lowers the numbers."""
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "tracker").rglob("*.py")]
    assert sum(len(re.findall(r"\bAny\b", source)) for source in sources) <= 60
    names = Counter(
        node.id for source in sources for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Name)
    )
    assert names["object"] <= 49


def test_what_marks_a_module_is_said_once() -> None:
    """A second `pytestmark` replaces the first: tests that should stand in a folder of their own wrote into this one."""
    twice = [
        path.name for path in (ROOT / "tests").rglob("*.py") if path.read_text().count("\npytestmark = ") > 1
    ]

    assert twice == []
