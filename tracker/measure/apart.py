"""Measuring in a process of its own: what engines, catalogues and executors do to that process they do to no verdict.

They are imported there and nowhere else, our own as well. What comes back are lines of JSON: how far it is, and at the end one run
document. A process that ends without having told one has measured nothing, whatever it ended with; the caller says
so, judges what was told and nothing else, and ends whatever the process has left behind.
"""

from __future__ import annotations

import base64
import json
import os
import pickle
import secrets
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import IO, TextIO

import msgspec

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.json_form import decode, encode
from spook_tracker.tracker.document.run_document import RunDocument, keeps_limit

from . import left_behind
from .bounds import PROCESS, START_LIMIT
from .questions import EngineUnavailable, Questions, RunError
from .request import Interrupted, Progress, Request, Watch

LONGEST = 1 << 26  # bytes of a line: twice the largest document that can be stored
PATIENCE = 10.0  # s in which an interrupted process tells what was finished
BEGIN = """import json, sys
sys.path[:] = json.loads(sys.argv[1])
from spook_tracker.tracker.measure.left_behind import end_with
end_with(0)
from spook_tracker.tracker.measure.apart import serve
serve()
"""


class Step(msgspec.Struct, tag=True):
    """Another piece of work is done."""

    progress: Progress


class Done(msgspec.Struct, tag=True):
    """All of it; or, of a run that was interrupted, what was finished of `asked` tests."""

    document: RunDocument
    asked: int | None = None


class Refused(msgspec.Struct, tag=True):
    """It was not begun, or broke off: why, in a sentence."""

    sentence: str
    exit_code: int = 2
    unavailable: bool = False  # the engine is not here; others may be
    interrupted: bool = False


News = Step | Done | Refused
Order = tuple[str, Questions, Request, tuple[bytes | list[str], ...]]


def run(source: Questions, request: Request, watch: Watch = lambda progress: None) -> RunDocument:
    """As tracker.measure.run.run. RunError also if the process that measures ends before it has told its run."""
    if not request.apart:
        from . import run as here

        return answering(here.run(source, request, watch))
    return answering(_asked("run", source, request, (), watch))


def timed_again(
    source: Questions, request: Request, document: RunDocument, names: Iterable[str], watch: Watch
) -> RunDocument:
    """As tracker.measure.again.timed_again; RunError as for `run`."""
    if not request.apart:
        from . import again

        return again.timed_again(source, request, document, names, watch)
    found = _asked("timed_again", source, request, (encode(document), sorted(set(names))), watch)
    if [s.series for s in found.samples] != [s.series for s in document.samples]:
        raise RunError("the repeated timings are not of what was measured; none of them is used")
    return found


def answering(run: RunDocument) -> RunDocument:
    """The document, if it holds a value or the reason why there is none, each called what its limit calls it."""
    if not run.samples:
        asked = f"{len(run.tests)} tests that ask for no value" if run.tests else "no test"
        raise RunError(f"nothing was measured: the catalogue has {asked}; name another with --catalogue")
    definitions = {definition.key: definition for definition in run.series}
    for sample in run.samples:
        definition = definitions[sample.series]
        kept = keeps_limit(sample.value, definition.limit, definition.better)
        if sample.passed != (sample.outcome == "value" and kept):
            told = "good" if sample.passed else "bad"
            raise RunError(
                f"{sample.series} is {sample.value:g} and was called {told} against its limit by the process that "
                "measured it: an engine or a catalogue has changed the tracker there; nothing of it is taken"
            )
    return run


def _asked(
    what: str, source: Questions, request: Request, more: tuple[bytes | list[str], ...], watch: Watch
) -> RunDocument:
    """Have another process do it."""
    interrupted = False
    patience = START_LIMIT + request.time_limit  # s: as a worker has to its first answer
    with _started((what, source, request, more)) as process, _Ending(process, patience) as importing:
        assert process.stdout is not None
        lines = _Lines(process.stdout.fileno())
        news: News | None = None
        while not isinstance(news, Done | Refused):
            try:
                news = _next(lines)
                importing.cancel()  # the first news is that all is imported
                if news is None and importing.over:
                    news = Refused(
                        f"nothing was measured: the engine {source.engine} and the catalogue {source.catalogue} were "
                        f"not imported within {patience:g} s, so the process that imports them was ended; "
                        "more time for it is --time-limit"
                    )
                elif news is None:
                    how = left_behind.how_ended(process, PATIENCE)
                    news = Refused(
                        f"nothing was measured: the process that imports the engine {source.engine} and the "
                        f"catalogue {source.catalogue} {how} before it was done; what is imported may not end it"
                    )
                elif isinstance(news, Step):
                    watch(news.progress)
            except KeyboardInterrupt:
                if interrupted:  # asked twice: do not wait
                    raise
                interrupted = True
                process.send_signal(signal.SIGINT)
                _Ending(process, PATIENCE).start()
    if isinstance(news, Refused):
        if news.interrupted or interrupted:
            raise KeyboardInterrupt
        error = (EngineUnavailable if news.unavailable else RunError)(news.sentence)
        error.exit_code = news.exit_code  # type: ignore[misc]
        raise error
    if interrupted and what != "run":
        raise KeyboardInterrupt
    if interrupted or news.asked is not None:
        raise Interrupted(news.document, news.asked or len(news.document.tests))
    return news.document


def _next(lines: _Lines) -> News | None:
    """What the process says next; None at its end. A line that is no news is said to be that."""
    line = lines.next()
    try:
        return None if line is None else decode(line, News)  # type: ignore[arg-type]
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        return Refused(f"nothing was measured: the measuring process returned no run: {error!s:.200}")


class _Lines:
    """Lines of bytes from a pipe; an interruption loses none of them."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor, self.rest, self.seen = descriptor, bytearray(), 0

    def next(self) -> bytes | None:
        """The next line; None at the end, or where there is no end of it."""
        while (end := self.rest.find(b"\n", self.seen)) < 0:
            self.seen = len(self.rest)
            more = os.read(self.descriptor, 1 << 20)
            if not more or self.seen > LONGEST:
                return None
            self.rest += more
        line, self.rest, self.seen = bytes(self.rest[:end]), self.rest[end + 1 :], 0
        return line


class _Ending(threading.Timer):
    """Ends a process and its session after so many seconds, unless it is cancelled; the waiting caller reaps it."""

    def __init__(self, process: subprocess.Popen[bytes], seconds: float) -> None:
        super().__init__(min(seconds, threading.TIMEOUT_MAX), self._end)
        self.process, self.over, self.daemon = process, False, True

    def _end(self) -> None:
        self.over = True
        self.process.kill()
        if os.name == "posix":
            left_behind.end_session(self.process.pid)

    def __enter__(self) -> _Ending:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.cancel()


@contextmanager
def _started(order: Order) -> Iterator[subprocess.Popen[bytes]]:
    """A process that has its order; at the end nothing of it is left, and none of our streams was ever its own."""
    flags = ["-S"] * sys.flags.no_site + ["-P"]
    command = [sys.executable, *flags, "-c", BEGIN, json.dumps(sys.path)]
    mark = secrets.token_hex(8)
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        start_new_session=os.name == "posix", env={**os.environ, left_behind.MARK: mark},
    )  # fmt: skip
    assert process.stderr is not None
    relay = threading.Thread(target=_relay, args=(process.stderr, sys.stderr), daemon=True)
    relay.start()
    try:
        assert process.stdin is not None
        with suppress(OSError):  # it is dead already, which is found when it is listened to
            process.stdin.write(base64.b64encode(pickle.dumps(order)) + b"\n")
            process.stdin.flush()
        yield process
    finally:
        left_behind.end(process, mark)
        relay.join(1.0)  # what still holds the other end does not hold us


def _relay(told: IO[bytes], to: TextIO | None) -> None:
    """What engines print goes where complaints go, and no process but this one holds that open."""
    with suppress(OSError, ValueError), told:
        for line in iter(lambda: told.readline(1 << 16), b""):
            if to is not None:
                to.write(line.decode(errors="replace"))
                to.flush()


def serve() -> None:
    """The life of such a process: an order, news, a run."""
    order, channel = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)  # whatever an engine prints is no news
    signal.signal(signal.SIGINT, signal.default_int_handler)  # the parent may have been started deaf to it
    what, source, request, more = pickle.loads(base64.b64decode(order.readline()))
    from . import again, workers
    from . import run as here
    from .catalogues import import_ours
    from .fitting import written

    if what == "run" and request.workers and request.executor == PROCESS:
        if not request.tests:
            import_ours(source.catalogue)
        with suppress(OSError):  # then the first worker is spawned as all others are
            workers.fork_ahead()  # nothing of a team's own is imported yet

    def tell(news: News) -> None:
        if isinstance(news, Done):
            news = Done(msgspec.Raw(written(news.document)), news.asked)  # type: ignore[arg-type]
        channel.write(encode(news) + b"\n")
        channel.flush()

    begin: Callable[[], RunDocument] = {
        "run": lambda: here.run(source, request, lambda progress: tell(Step(progress))),
        "timed_again": lambda: again.timed_again(
            source, request, decode(more[0], RunDocument), more[1], lambda progress: tell(Step(progress))
        ),
    }[what]
    tell(_news(begin, source))


def _news(begin: Callable[[], RunDocument], source: Questions) -> News:
    """What comes of measuring, whatever is thrown at it."""
    try:
        return Done(begin())
    except Interrupted as ended:
        return Done(ended.document, ended.asked)
    except KeyboardInterrupt:
        return Refused("interrupted", interrupted=True)
    except EngineUnavailable as error:
        return Refused(str(error), error.exit_code, unavailable=True)
    except TrackerError as error:
        return Refused(str(error), error.exit_code)
    except BaseException as error:
        if os.environ.get("TRACKER_DEBUG"):
            traceback.print_exc()
        *_, last = traceback.extract_tb(error.__traceback__)
        told = " ".join(f"{type(error).__name__} {error}".split())
        return Refused(
            f"nothing was measured: {told} ({last.filename}, line {last.lineno}), raised while the engine "
            f"{source.engine} was asked for the catalogue {source.catalogue}"
        )
