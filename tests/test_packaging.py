"""What is installed: one name, complete, beside a team's own packages called engine, tracker and scalar_tests.

The wheel here is made without compiling: its binary is the one of this environment, so that the test takes
seconds, and what it depends on is this environment's, too. `make package` builds the real one from the archive of the
sources, installs it by pip with all it depends on into environments of their own, and weighs those.
"""

from __future__ import annotations

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from spook_tracker.engine import _core
from tests.installed_wheel import ASKS, THEIRS, ask, lay_out, run
from tests.places import ROOT

backend = pytest.importorskip("scikit_build_core.build", reason="the build backend is not installed here")

REAL = os.environ.get("SPOOK_TEST_REAL_WHEEL") == "1"
FOLDERS = ("engine", "scalar_tests", "tracker", "migrations", "site")
SLIM, EVERYTHING = 150, 350  # MB (10⁶ bytes) on the disk: without an extra, and with all of ours
OURS = (
    "standard,data,dask,postgresql"  # the other extras are other people's engines, and tools of development
)
elsewhere = pytest.mark.skipif(sys.platform == "win32", reason="environments look different there")


def tracked() -> set[str]:
    """Every file of this tree that git knows, or would if it were added."""
    done = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    if done.returncode:
        pytest.skip("not a clone, so git cannot say which files belong to it")
    return {name for name in done.stdout.splitlines() if (ROOT / name).is_file()}


def head() -> str:
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def built(kind: str, folder: Path, tree: Path = ROOT) -> Path:
    """An archive of a tree, made by its own backend in a process of its own: the backend changes folders."""
    code = f"import sys; sys.path.insert(0, {str(tree / '.ci')!r}); import build_backend as build; "
    code += (
        "build.build_sdist(sys.argv[1])"
        if kind == "sdist"
        else f"build.build_wheel(sys.argv[1], {{}} if {REAL} else {{'wheel.cmake': 'false', 'wheel.platlib': 'true'}})"
    )
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)], cwd=tree, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (archive,) = folder.iterdir()
    return archive


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The archive of the sources."""
    return built("sdist", tmp_path_factory.mktemp("sources") / "sdist")


def test_the_archive_of_sources_holds_each_file_once(sources: Path) -> None:
    """The folders are linked below the installed name: archived once, there, as files and not as links."""
    wanted = {f"spook_tracker/{name}" if name.split("/")[0] in FOLDERS else name for name in tracked()}

    with tarfile.open(sources) as archive:
        members = archive.getmembers()

    names = {member.name.partition("/")[2] for member in members}
    assert len(names) == len(members)
    assert all(member.isfile() for member in members)
    assert names - wanted == {"PKG-INFO"}
    assert wanted - names == set()


def test_the_archive_of_sources_knows_its_commit(sources: Path, tmp_path: Path) -> None:
    tracked()  # or there is no commit
    told = (unpacked(sources, tmp_path) / ".source-archive").read_text()
    changed = subprocess.run(
        ["git", "status", "--porcelain", "--untracked-files=no"], cwd=ROOT, capture_output=True, check=True
    )

    assert told.startswith(f"node: {head()}\ntime: 2")
    assert "$Format" not in told
    assert ("changed: true" in told) == bool(changed.stdout)
    assert "$Format" in (ROOT / ".source-archive").read_text(), "the tree stays as it is"


def unpacked(archive: Path, folder: Path) -> Path:
    """The tree in an archive."""
    with tarfile.open(archive) as opened:
        safely = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}  # Python 3.11.4 on
        opened.extractall(folder, **safely)
    (tree,) = folder.iterdir()
    return tree


def pip(python: Path, *words: str) -> None:
    """Install into that environment by the pip of this one, from wherever this machine's pip is told to."""
    command = [sys.executable, "-m", "pip", "--python", str(python), "install", "-q", *words]
    environment = {k: v for k, v in os.environ.items() if k != "PIP_COMPILE"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def environment(place: Path) -> tuple[Path, Path]:
    """A new environment without pip: its Python, and where packages go."""
    venv.create(place, with_pip=False, symlinks=True)
    return place / "bin" / "python", next(place.glob("lib/python3*/site-packages"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory, sources: Path) -> Path:
    """The wheel; the real one is built from the archive of the sources."""
    folder = tmp_path_factory.mktemp("wheel")
    tree = unpacked(sources, folder / "sources") if REAL else ROOT
    return built("wheel", folder / "dist", tree)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory, wheel: Path) -> Path:
    """A slim installation, as pip makes it."""
    place = tmp_path_factory.mktemp("installed") / "environment"
    python, site = environment(place)
    if REAL:
        pip(python, str(wheel))
        return place
    pip(python, "--no-deps", "--no-index", str(wheel))
    shutil.copy(str(_core.__file__), site / "spook_tracker" / "engine")
    (site / "dependencies.pth").write_text(f"{sysconfig.get_path('purelib')}\n")  # its own .pth stay unread
    return place


def test_the_wheel_is_complete_under_one_name(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    wanted = {f"spook_tracker/{name}" for name in tracked() if name.split("/")[0] in FOLDERS}
    wanted = {name for name in wanted if not name.startswith("spook_tracker/engine/native/")}

    assert wanted - names == set()
    assert "spook_tracker/py.typed" in names  # type checkers of a team see our types
    assert {name.split("/")[0].partition("-")[0] for name in names} == {"spook_tracker"}


@elsewhere
def test_it_works_beside_a_teams_own_engine_tracker_and_scalar_tests(installed: Path, tmp_path: Path) -> None:
    """Theirs are installed beside it and lie in the folder they work in; the questions are ours."""
    site = next(installed.glob("lib/python3*/site-packages"))
    for name in THEIRS:
        for place in (site, tmp_path):
            (place / name).mkdir(exist_ok=True)
            (place / name / "__init__.py").write_text('OWNER = "the team"\n')
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "TRACKER"))
    }

    def said(*command: str) -> str:
        done = subprocess.run(
            [str(installed / "bin" / command[0]), *command[1:]],
            cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, (command, done.stdout, done.stderr)
        return done.stdout

    try:
        assert said("python", "-c", ASKS).startswith(str(installed))
        assert said("python", "-m", "spook_tracker", "--version") == said("tracker", "--version")
        if not REAL:  # what is installed as pip makes it has no SciPy, which our own questions want
            said("tracker", "run", "falling_object", "--workers", "2")  # spawned workers import by name
            assert "falling_object" in said("tracker", "trend", "falling_object")
            said("tracker", "publish", "--out", "public")
            assert (tmp_path / "public" / "index.html").is_file()
            said("tracker", "db", "check")
    finally:
        for name in THEIRS:
            shutil.rmtree(site / name)


HIDDEN = """
import sys

class Hidden:
    \"\"\"What an installation without extras has not.\"\"\"

    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("scipy", "pandas", "plotly", "distributed", "fastparquet"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Hidden())
"""


@elsewhere
def test_a_night_of_a_teams_own_questions_needs_no_extra_and_no_compiler(
    installed: Path, tmp_path: Path
) -> None:
    """With nothing in PATH but the environment itself, and their own engine/, tracker/ and so on in the folder."""
    lay_out(tmp_path)
    if not REAL:
        (tmp_path / "sitecustomize.py").write_text(HIDDEN)

    ask(tmp_path, installed / "bin")
    standard = run(tmp_path, installed / "bin", "tracker", "list", "--catalogue", "standard")
    table = run(tmp_path, installed / "bin", "tracker", "export", "--format", "csv", "--out", "x.csv")

    assert standard.returncode == table.returncode == 2
    assert "pip install 'spook-tracker[standard]'" in standard.stderr
    assert "tables need pandas; install it with: pip install 'spook-tracker[standard]'" in table.stderr
    assert not {"scipy", "pandas", "plotly"} & {
        name.partition(">")[0]
        for name in importlib.metadata.requires("spook-tracker") or ()
        if "extra" not in name
    }


DRAWN = """
from spook_tracker import tracker
from spook_tracker.engine import Particle, Position, Scene, Trace, simulate
ball = Scene(bodies=(Particle(name="ball", mass=1.0, position=(0.0, 0.0, 0.0)),), gravity=(0.0, 0.0, -9.81))
fallen = simulate(ball, time_step=0.1, steps=9, observe={"place": Trace(quantity=Position("ball"))})
with tracker.History.open("sqlite:///tracker.db") as history:
    print(fallen.show()._repr_html_()[1:7], type(history.plot("falling_object")).__name__, end=" ")
    print(type(history.to_dataframe()).__name__)
"""


def megabytes(folder: Path) -> float:
    """What a folder takes on the disk, in 10⁶ bytes."""
    return sum(path.lstat().st_blocks * 512 for path in folder.rglob("*")) / 1e6


@pytest.mark.package
def test_a_slim_installation_is_small(installed: Path, tmp_path: Path) -> None:
    """As pip leaves it, byte code of everything included, and after a night."""
    lay_out(tmp_path)
    ask(tmp_path, installed / "bin")

    found = megabytes(next(installed.glob("lib/python3*/site-packages")))
    print(f"slim: {found:.0f} MB")
    assert found <= SLIM


@pytest.mark.package
def test_everything_installed_is_small(wheel: Path, tmp_path: Path) -> None:
    """As `pip install --no-compile` leaves it. A night and tables compile what they import, and pip without that word
    compiles everything: both are more, and said."""
    python, site = environment(tmp_path / "environment")
    pip(python, "--no-compile", f"{wheel}[{OURS}]")
    installed = megabytes(site)
    team = tmp_path / "team"
    team.mkdir()
    (team / "tracker.toml").write_text('catalogue = "standard"\n')
    values = [
        ("nightly", "--quick", "--out", "public"),
        ("export", "--format", "parquet", "--out", "values.parquet"),
        ("export", "--format", "csv", "--out", "values.csv"),
    ]
    for words in values:
        done = run(team, python.parent, "tracker", *words)
        assert done.returncode == 0, (words, done.stdout, done.stderr)

    after = megabytes(site)
    run(team, python.parent, "python", "-m", "compileall", "-q", str(site))
    print(
        f"everything ({OURS}): {installed:.0f} MB; used {after:.0f} MB; all compiled {megabytes(site):.0f} MB"
    )
    assert installed <= EVERYTHING


@pytest.mark.package
@pytest.mark.timeout(2400)  # s: it compiles the engine
def test_a_commit_is_installed_from_its_repository(tmp_path: Path) -> None:
    """As README says before an index has the package: the version counts the commits, and compare takes it as printed."""
    origin = tmp_path / "origin.git"
    done = subprocess.run(
        ["git", "clone", "-q", "--bare", str(ROOT), str(origin)], capture_output=True, check=False
    )
    if done.returncode or (origin / "shallow").exists():
        pytest.skip("not a full clone, so its commits cannot be counted")
    python, _ = environment(tmp_path / "environment")
    address = origin.as_uri().replace("file:///", "file://localhost/")  # pip before 24 asks for a host
    pip(python, f"spook-tracker[standard] @ git+{address}@{head()}")
    team = tmp_path / "team"
    team.mkdir()
    printed = run(team, python.parent, "tracker", "--version").stdout.split()[1].rstrip(",")

    for _ in range(2):
        assert run(team, python.parent, "tracker", "run", "falling_object").returncode == 0
    compared = run(team, python.parent, "tracker", "compare", printed, printed.partition("+")[0])
    drawn = run(team, python.parent, "python", "-c", DRAWN)

    assert re.fullmatch(rf"\S+\+g{head()[:9]}", printed)
    assert compared.returncode == 0, compared.stderr
    assert drawn.stdout.split() == ["iframe", "Figure", "DataFrame"], drawn.stderr


@pytest.mark.package
def test_the_commit_travels_from_the_archive_into_the_wheel(
    installed: Path, sources: Path, tmp_path: Path
) -> None:
    told_of = (unpacked(sources, tmp_path / "sources") / ".source-archive").read_text().splitlines()
    told = run(
        tmp_path, installed / "bin", "python", "-c",
        "from spook_tracker.engine.build_info import build_info as b; print(b.git_hash, b.commit_time, b.version)",
    )  # fmt: skip

    found, time, version = told.stdout.split()
    assert f"node: {found}" == told_of[0]
    assert time.startswith("2")
    assert version != "0+unknown"


@pytest.mark.package
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="manylinux is Linux")
def test_the_wheel_needs_nothing_that_linux_distributions_lack(wheel: Path) -> None:
    """auditwheel names a manylinux policy for it: nothing but what every distribution has is linked. abi3audit sees the
    stable interface of Python only."""
    programs = Path(sys.executable).parent

    def said(*command: str) -> str:
        done = subprocess.run(
            [str(programs / command[0]), *command[1:]], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return " ".join((done.stdout + done.stderr).split())

    shown = said("auditwheel", "show", str(wheel))
    print(shown)
    assert re.search(r"following platform tag: \"manylinux_2_\d+_", shown), shown
    said("abi3audit", "--strict", str(wheel))


@pytest.mark.package
def test_the_release_builds_one_wheel_a_machine() -> None:
    """cibuildwheel reads our settings; to build by them it wants containers, which not every machine has."""
    programs = Path(sys.executable).parent
    told = {}
    for platform, arch in (("linux", "x86_64"), ("linux", "aarch64"), ("macos", "arm64")):
        done = subprocess.run(
            [str(programs / "cibuildwheel"), "--platform", platform, "--archs", arch, "--print-build-identifiers"],
            cwd=ROOT, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        told[platform, arch] = done.stdout.split()

    assert told == {
        ("linux", "x86_64"): ["cp311-manylinux_x86_64"],
        ("linux", "aarch64"): ["cp311-manylinux_aarch64"],
        ("macos", "arm64"): ["cp311-macosx_arm64"],
    }


@elsewhere
def test_there_is_a_manual_page_for_every_command(tmp_path: Path) -> None:
    """With its options; the wheel brings them to share/man."""
    command = [sys.executable, ".ci/manual_pages.py", str(tmp_path), "1.2.3"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert {"tracker.1", "tracker-run.1", "tracker-db-copy.1"} <= {path.name for path in tmp_path.iterdir()}
    page = (tmp_path / "tracker-run.1").read_text().replace("\\-", "-")
    assert "--executor" in page
    assert "1.2.3" in page


@pytest.mark.package
@elsewhere
def test_the_manual_pages_are_installed(installed: Path) -> None:
    page = installed / "share" / "man" / "man1" / "tracker-run.1"

    assert "--executor" in page.read_text().replace("\\-", "-")


def test_what_is_released_is_named_as_it_is() -> None:
    """The tools of the release are pinned, and the index is told who made this and under what licences."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    lines = (ROOT / ".ci" / "constraints.txt").read_text().lower().replace("_", "-").splitlines()
    pinned = {line.partition("==")[0] for line in lines}
    release = (ROOT / ".github" / "workflows" / "release.yml").read_text()

    assert {"build", "cibuildwheel", "auditwheel", "abi3audit"} <= pinned
    tools = ROOT / ".ci" / "release-tools.txt"
    installs = re.findall(r"pip install (.*)", release)
    assert installs
    assert {*installs} == {f"--quiet --require-hashes -r {tools.relative_to(ROOT)}"}
    versions = [line for line in tools.read_text().splitlines() if not line.startswith("#")]
    assert {"build", "cibuildwheel"} <= {line.partition("==")[0] for line in versions}
    for line in versions:
        name = line.split()[0]
        assert "--hash=sha256:" in line, name
        assert name in lines, f"{name} is not the one that is tested"
    assert {"authors", "keywords", "classifiers"} <= set(settings["project"])
    script = settings["tool"]["cibuildwheel"]["test-command"].partition("{project}/")[2]
    assert (ROOT / script).is_file()
