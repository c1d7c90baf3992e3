"""What all commands share: options, and errors as one line that names what to do next.

Exit codes everywhere: 0 same, better or green; 1 a regression or a red test; 2 usage error, no such version,
no data, unreadable database; 3 not comparable. Only click and numbers are imported here, so that `--help` answers at once.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click

from spook_tracker.tracker.measure.bounds import LOOK, MEMORY, TIME_LIMIT

from . import settings as tracker_toml

if TYPE_CHECKING:
    from spook_tracker.tracker.website.options import SiteOptions

Command = TypeVar("Command", bound=Callable[..., None])
Value = TypeVar("Value")

SQLITE = b"SQLite format 3\0"  # a file that holds a history begins so
DEFAULT_DATABASE = "sqlite:///tracker.db"
MOST = 600  # characters of a complaint
GREEN, RED, UNUSABLE, NOT_COMPARABLE = 0, 1, 2, 3


def database_option(command: Command) -> Command:
    """--db URL, or TRACKER_DB."""
    return click.option(
        "--db",
        "database",
        metavar="URL",
        envvar="TRACKER_DB",
        default=DEFAULT_DATABASE,
        show_default=True,
        help="History: sqlite:///FILE or postgresql://…; also TRACKER_DB.",
    )(command)


SITE = "what the website is told"


def _kept(
    check: Callable[[Value], None] = lambda value: None,
) -> Callable[[click.Context, click.Parameter, Value], None]:
    """A callback that looks at an option of the website before anything is measured; `site_options` has it then."""

    def keep(context: click.Context, option: click.Parameter, value: Value) -> None:
        check(value)
        context.meta.setdefault(SITE, {})[option.name] = value

    return keep


def site_options() -> SiteOptions:
    """What the command line says of the website."""
    from spook_tracker.tracker.website.options import SiteOptions

    return SiteOptions(**click.get_current_context().meta.get(SITE, {}))


out_option = click.option(
    "--out", metavar="DIR", default="public", show_default=True, type=click.Path(path_type=Path), help="Folder for the website."
)  # fmt: skip


def with_database_option(command: Command) -> Command:
    """--with-database: let readers of the website load the history."""
    return click.option(
        "--with-database",
        is_flag=True,
        expose_value=False,
        callback=_kept(),
        help="Publish the SQLite file as data/tracker.db.",
    )(command)


def _each_named(context: click.Context, option: click.Parameter, names: str) -> str:
    """A stray comma is said before the first of several engines is measured."""
    if not all(name.strip() for name in names.split(",")):
        raise click.BadParameter(f"there is no {option.name} without a name: {names!r}")
    return names


MODELS = "model files named on the command line"


def _model(context: click.Context, option: click.Parameter, files: tuple[str, ...]) -> None:
    """A model file is a catalogue of one test; `_catalogue`, which is read after this, adds it."""
    context.meta[MODELS] = files
    if not files:
        return
    from spook_tracker.tracker.measure.model_files import is_model

    for file in files:
        if "," in file:
            raise click.BadParameter(f"{file!r}: a comma parts catalogues; give the file another name")
        if not is_model(file):
            raise click.BadParameter(f"{file!r} is no model file: it ends in .xml, .mjcf, .urdf or .sdf")


def _catalogue(context: click.Context, option: click.Parameter, names: str) -> str:
    """With models on the command line, they alone; with --catalogue beside them, both."""
    names = _each_named(context, option, names)
    models = context.meta.get(MODELS, ())
    if not models:
        return names
    named = context.get_parameter_source(str(option.name)) is click.core.ParameterSource.COMMANDLINE
    return ",".join([names] * named + [*models])


def look() -> float | None:
    """Seconds of the processor for a first look, where models on the command line are all that is asked."""
    context = click.get_current_context()
    beside = context.get_parameter_source("catalogue") is click.core.ParameterSource.COMMANDLINE
    return LOOK if context.meta.get(MODELS) and not beside else None


def model_option(command: Command) -> Command:
    """--model FILE, which becomes a part of the catalogue."""
    return click.option(
        "--model",
        multiple=True,
        metavar="[NAME=]FILE",
        is_eager=True,
        expose_value=False,
        callback=_model,
        help="Test this MJCF, URDF or SDF file instead; may be repeated. For every night, list it as [[model]] in tracker.toml.",
    )(command)


def catalogue_option(command: Command) -> Command:
    """--catalogue NAME."""
    return click.option(
        "--catalogue",
        metavar="NAME[,NAME]",
        envvar="TRACKER_CATALOGUE",
        default="standard",
        callback=_catalogue,
        help="Catalogues of scalar tests, as module:NAME, separated by commas; also TRACKER_CATALOGUE.",
    )(command)


def source_options(command: Command) -> Command:
    """Which questions are put to which engine."""
    for option in (
        model_option,
        click.option(
            "--engine",
            metavar="NAME[,NAME]",
            envvar="TRACKER_ENGINE",
            default="spook",
            callback=_each_named,
            help="spook, mujoco, … (see: tracker engines) or module:NAME; also TRACKER_ENGINE.",
        ),
        catalogue_option,
    ):
        command = option(command)
    return command


def _readable(colour: str) -> None:
    from spook_tracker.tracker.website.colours import accent

    accent(colour)


def _web_address(address: str) -> None:
    """What is no address of the web becomes no link."""
    from spook_tracker.tracker.document.wording import web_address

    if address and not web_address(address):
        raise click.BadParameter(f"{address[:80]!r} is no address of the web; write https://…")


def website_options(command: Command) -> Command:
    """--title, --home-page and --colour: whose website it is."""
    for option in (
        click.option(
            "--home-page",
            metavar="URL",
            default="",
            expose_value=False,
            callback=_kept(_web_address),
            help="Address of your project, linked at the foot of every page.",
        ),
        click.option(
            "--colour",
            metavar="#RRGGBB",
            default="",
            expose_value=False,
            callback=_kept(_readable),
            help="Colour of links and buttons, dark enough to be read on white.",
        ),
        click.option(
            "--title",
            metavar="TEXT",
            default="",
            expose_value=False,
            callback=_kept(),
            help="Title of the website.",
        ),
    ):
        command = option(command)
    return command


def pages_options(command: Command) -> Command:
    """--mutants FILE and --recorded DIR: pages of what was measured before, and elsewhere."""
    for option in (
        click.option(
            "--recorded",
            metavar="DIR",
            expose_value=False,
            callback=_kept(),
            type=click.Path(exists=True, file_okay=False, path_type=Path),
            help="Recorded nights of other engines, as `make recorded` writes them, for pages of the website.",
        ),
        click.option(
            "--mutants",
            metavar="FILE",
            expose_value=False,
            callback=_kept(),
            type=click.Path(path_type=Path),
            help="Results of deliberately wrong engines, as `make mutants` writes them, for a page of the website.",
        ),
    ):
        command = option(command)
    return command


def _with_first_page(folder: Path | None) -> None:
    if folder is not None and not (folder / "index.html").is_file():
        raise click.BadParameter(f"{folder} has no index.html; build the documentation first")


def documents_option(command: Command) -> Command:
    """--documents DIR: a built documentation that is published with the website."""
    return click.option(
        "--documents",
        metavar="DIR",
        expose_value=False,
        callback=_kept(_with_first_page),
        type=click.Path(exists=True, file_okay=False, path_type=Path),
        help="HTML documentation to publish as docs/ and link on every page.",
    )(command)


class Seconds(click.FloatRange):
    """Of a range: what is not a number is in none."""

    def convert(self, value: float, option: click.Parameter | None, context: click.Context | None) -> float:
        found: float = super().convert(value, option, context)
        if found != found:
            self.fail(f"{value} is no number of seconds", option, context)
        return found


def limit_option(command: Command) -> Command:
    """--limit SECONDS, so that a slow engine does not hold up a night."""
    return click.option(
        "--limit",
        metavar="SECONDS",
        type=Seconds(min=0.0, min_open=True),
        help="Wall time of one simulation; by default 10 s for other engines.",
    )(command)


def workers_option(command: Command) -> Command:
    """How many processes measure values, and what one may take; run times are always taken alone."""
    for option in (
        click.option(
            "--memory",
            metavar="MB",
            default=MEMORY,
            show_default=True,
            type=click.IntRange(0, 1 << 30),
            help="Memory that one task may add to its process; 0: no limit. Linux only.",
        ),
        click.option(
            "--time-limit",
            metavar="SECONDS",
            default=TIME_LIMIT,
            show_default=True,
            type=Seconds(0.1, 1e6),
            help="Wall time of one task; one that takes longer is stopped and recorded as timed out.",
        ),
        click.option(
            "--workers",
            default=2,
            show_default=True,
            type=click.IntRange(0, 256),
            help="Processes that measure values; 0: this one, where no task can be stopped.",
        ),
    ):
        command = option(command)
    return command


def executor_option(command: Command) -> Command:
    """--executor NAME: where values are measured."""
    return click.option(
        "--executor",
        metavar="NAME",
        default="process",
        show_default=True,
        help="Where values are measured: process, dask://HOST:PORT, or module:factory of any executor.",
    )(command)


ACCEPTED = "accepted.toml"


def accepted_option(command: Command) -> Command:
    """--accepted FILE: levels that people have accepted."""
    return click.option(
        "--accepted",
        metavar="FILE",
        type=click.Path(path_type=Path),
        callback=_there_if_named,
        help=f"Accepted levels; default {ACCEPTED}.",
    )(command)


def _there_if_named(context: click.Context, option: click.Parameter, file: Path | None) -> Path | None:
    """A file that the command line names must be there; one that is there by default need not."""
    named = context.get_parameter_source(str(option.name)) is click.core.ParameterSource.COMMANDLINE
    if named and file is not None and not file.is_file():
        raise click.BadParameter(f"there is no file {file}")
    return file


def example(*lines: str) -> str:
    """The example at the end of a command's help."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in lines)


class OneLineErrors(click.Group):
    """A group whose errors are one line on standard error; a traceback only with TRACKER_DEBUG=1."""

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> NoReturn:
        options["standalone_mode"] = False
        _recorded.clear()
        try:
            settings = tracker_toml.read(Path.cwd())
            options |= {"default_map": tracker_toml.defaults(self, settings), "obj": settings}
            code = super().main(args, *rest, **options)
        except click.ClickException as error:
            command = (
                error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "tracker"
            )
            complain(f"{error.format_message()} (see: {command} --help)")
            code = UNUSABLE
        except (click.Abort, KeyboardInterrupt) as error:
            kept = "nothing of this command was recorded"
            if _recorded:
                kept = f"run {_recorded[-1]} is recorded (see: tracker compare previous {_recorded[-1]})"
            ended = error.__cause__ or error  # click makes an Abort of every interruption
            complain(str(ended) if getattr(ended, "recorded", False) else f"interrupted; {kept}")
            code = UNUSABLE
        except BrokenPipeError:
            sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115 - the reader is gone
            code = GREEN
        except SystemExit as ended:
            if _of_click(ended):  # it answers a shell that completes words
                raise
            code = _unusable(ended)
        except BaseException as error:
            code = _unusable(error)
        sys.exit(code if isinstance(code, int) else GREEN)


def _of_click(ended: SystemExit) -> bool:
    *_, (frame, _) = traceback.walk_tb(ended.__traceback__)
    return str(frame.f_globals.get("__name__", "")).startswith("click.")


def _unusable(error: BaseException) -> int:
    """Say what went wrong and return the exit code: no module that is imported has a say in it."""
    if os.environ.get("TRACKER_DEBUG"):
        raise error
    from spook_tracker.tracker.document.errors import TrackerError

    if isinstance(error, TrackerError):
        complain(str(error))
        return error.exit_code
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        complain(f"{where}{error.strerror or error}; check the path and its permissions")
        return UNUSABLE
    if not isinstance(error, Exception):
        *_, last = traceback.extract_tb(error.__traceback__)
        complain(
            f"{type(error).__name__} {error} in {last.filename}, line {last.lineno}: nothing may end the tracker"
        )
        return UNUSABLE
    complain(f"{type(error).__name__}: {error}; this is a defect: TRACKER_DEBUG=1 shows where")
    return UNUSABLE


_recorded: list[
    str
] = []  # ids of what this command has recorded: an interruption after that must not deny it


def recorded(run_id: str) -> None:
    """Remember that a run is stored, whatever happens to the command from now on."""
    _recorded.append(run_id)


def recorded_runs() -> tuple[str, ...]:
    """Ids of the runs that this command has recorded, in that order."""
    return tuple(_recorded)


@contextmanager
def terminated_is_interrupted() -> Iterator[None]:
    """SIGTERM ends this the way Ctrl-C does: in order, with what is finished kept."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield  # only there can signals be handled
        return
    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def refuse_unwritable(*files: Path | None) -> None:
    """TrackerError if a file cannot be written: asked before anything is measured, not after."""
    from spook_tracker.tracker.document.errors import TrackerError

    for file in files:
        if file is None:
            continue
        folder = file.absolute().parent
        if file.is_dir():
            raise TrackerError(f"{file} is a folder; name a file")
        if file.is_symlink() and _leads_back(file):
            raise TrackerError(f"{file} is a link that leads back to itself; name a file")
        if file.is_fifo() and not file.is_relative_to("/dev"):  # there a shell has a reader behind it
            raise TrackerError(f"{file} is a pipe that cannot be read; name a file")
        if folder.exists() and not folder.is_dir():
            raise TrackerError(f"{folder} is not a folder; choose another place")
        if not folder.is_dir():
            raise TrackerError(f"the folder of {file} does not exist; make it first")
        if not os.access(file if file.exists() else folder, os.W_OK):
            raise TrackerError(f"{file} cannot be written; check its permissions")
        if file.is_file():
            with file.open("rb") as there:
                if there.read(len(SQLITE)) == SQLITE:
                    raise TrackerError(f"{file} is a database; name another file")


def _leads_back(link: Path) -> bool:
    try:
        link.stat()
    except OSError as error:
        return error.errno == errno.ELOOP
    return False


def write(file: Path, text: str) -> bool:
    """Whether it could be written; if not, that is said, and takes nothing from what was measured."""
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        complain(f"{file} cannot be written: {error.strerror}; what was measured stands")
        return False
    return True


def complain(sentence: str) -> None:
    """One line on standard error, which repeats only so much of what it was given."""
    import spook_tracker.tracker.document.outside as outside

    line = outside.inert(outside.clean(" ".join(sentence.split())))
    click.echo("tracker: " + (line if len(line) <= MOST else f"{line[: MOST - 1]}…"), err=True)
