"""Processes of ours that begin with their modules read: a claim about what a process does need not pay, each time, the third of
a second of processor that Python takes to import what it does it with.

One process has imported all that and waits. Where a test, or what it tests, starts our Python with a program or our command, that
one forks instead: a child of the process that asked, with the streams, folder, environment and path that were asked for, nothing
else open, and the program as its `__main__`. Whatever says more of the interpreter starts one, as all do but on Linux.
"""

from __future__ import annotations

import _posixsubprocess
import array
import atexit
import ctypes
import fcntl
import gc
import importlib
import marshal
import os
import pickle
import resource
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
import types
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, NoReturn

import spook_tracker

ADOPTS = 36  # PR_SET_CHILD_SUBREAPER
IMPORTED = (
    "measure.again", "measure.apart", "measure.catalogues", "measure.fitting", "measure.run", "measure.workers",
    "cli.main", "cli.report_table", "cli.report_sweep", "store.database", "store.history", "store.record",
)  # fmt: skip
AS_STARTED = ("PYTHON", "LD_", "OPENBLAS", "LC_", "LANG", "TZ")  # of the environment: what is read once
LIMITS = [getattr(resource, f"RLIMIT_{name}") for name in ("AS", "CPU", "DATA", "FSIZE", "NOFILE")]
COMMAND = str(Path(sys.executable).with_name("tracker"))
PACKAGE = Path(str(spook_tracker.__file__)).parent.resolve()
CALL = """#!{python} -IS
import marshal, os, socket, sys
asked = socket.socket(socket.AF_UNIX)
asked.connect({name!r})
socket.send_fds(asked, [b"."], [0, 1, 2])
asked.sendall(marshal.dumps((sys.argv[1:], os.getcwd(), dict(os.environb))))
asked.shutdown(socket.SHUT_WR)
os._exit(asked.recv(1)[0])
"""
_start: Callable[..., int] = _posixsubprocess.fork_exec
_lock = threading.Lock()
_source: socket.socket | None = None  # of the one that waits
_usual: object = None  # what it has read at its start
_forks = False  # one that was forked as a command of ours: it forks what it starts itself


class Order(NamedTuple):
    """What a fork is to be."""

    kind: str  # of the command line
    words: list[str]  # its arguments
    program: str
    place: str  # the folder it runs in
    environment: dict[bytes, bytes]
    numbers: list[int]  # of its descriptors
    session: bool  # of its own
    deaf: list[int]  # signals it does not hear
    limits: list[tuple[int, int]]  # of what it may take


def begin() -> None:
    """From here on processes of ours are forked, where they may be."""
    global _usual
    if sys.platform == "linux" and not sys.flags.no_site:
        _usual = _read(dict(os.environb))
        _posixsubprocess.fork_exec = subprocess._fork_exec = _fork_exec  # type: ignore[attr-defined]


def end() -> None:
    """From here on every process is started."""
    _posixsubprocess.fork_exec = subprocess._fork_exec = _start  # type: ignore[attr-defined]


def close() -> None:
    """The one that waits ends."""
    global _source
    end()
    if _source is not None:
        _source.close()
        _source = None


def command(program: Path) -> None:
    """Make a program of it that shells can call for our command, which this process then starts."""
    called = socket.socket(socket.AF_UNIX)
    called.bind("")  # to a name of no file
    called.listen()
    program.write_text(CALL.format(python=sys.executable, name=called.getsockname()))
    program.chmod(0o755)

    def answer() -> None:
        while True:
            asked, _ = called.accept()
            with asked:
                _, streams, *_ = socket.recv_fds(asked, 1, 3)
                with asked.makefile("rb") as told:
                    words, place, environment = marshal.loads(told.read())
                line = [sys.executable, "-m", "spook_tracker", *words]
                stdin, stdout, stderr = streams
                ended = subprocess.run(
                    line, stdin=stdin, stdout=stdout, stderr=stderr, cwd=place, env=environment, check=False
                )
                asked.sendall(bytes([ended.returncode & 255]))
                for stream in streams:
                    os.close(stream)

    threading.Thread(target=answer, daemon=True).start()


def _line(args: Sequence[str]) -> tuple[str, list[str], str] | None:
    """Kind, arguments and program of a command line that can be forked."""
    match args:
        case [sys.executable, "-P", "-c", code, *words]:
            return "safe code", ["-c", *words], code
        case [sys.executable, "-c", code, "--multiprocessing-fork" as word]:
            return "code", ["-c", word], code
        case [sys.executable, "-m", module, *words] if module.partition(".")[0] == "spook_tracker":
            return "module", ["-m", *words], module
        case [command, *words] if command == COMMAND:
            return "command", [command, *words], command
    return None


def _path(order: Order) -> list[str]:
    """What comes before the path of every process."""
    given = order.environment.get(b"PYTHONPATH", b"").decode().split(os.pathsep)
    first = {"safe code": [], "code": [""], "module": [order.place], "command": [str(Path(COMMAND).parent)]}
    return [*first[order.kind], *(str(Path(order.place, place)) for place in given if place)]


def _ours(order: Order) -> bool:
    """Whether such a process would find the tracker that was imported."""
    found = (Path(order.place, place, "spook_tracker") for place in _path(order))
    return all(place.resolve() == PACKAGE for place in found if place.exists())


def _read(environment: dict[bytes, bytes]) -> dict[bytes, bytes]:
    """What a process has read at its start, and no fork could change; dask tells all processes one seed of hashes."""
    seed = environment.get(b"PYTHONHASHSEED") == os.environb.get(b"PYTHONHASHSEED")
    aside = {b"PYTHONPATH", *[b"PYTHONHASHSEED"] * seed}
    return {k: v for k, v in environment.items() if k.decode().startswith(AS_STARTED) and k not in aside}


def _fork_exec(
    args: Sequence[str | bytes], programs: object, closes: bool, keeps: tuple[int, ...], place: str | bytes | None,
    pairs: Sequence[bytes] | None, stdin: int, to: int, by: int, stdout: int, error: int, stderr: int, seen: int,
    failing: int, restores: bool, session: bool, group: int, gid: object, gids: object, uid: object, umask: int,
    before: object, *more: object,
) -> int:  # fmt: skip
    """As `_posixsubprocess.fork_exec`."""
    line = _line([os.fsdecode(arg) for arg in args])
    streams = [usual if own < 0 else own for usual, own in enumerate((stdin, stdout, stderr))]
    plain = closes and (gid, gids, uid, before) == (None,) * 4 and group < 0 and umask < 0
    if line and plain and not any(map(os.isatty, streams)):
        environment = dict(os.environb) if pairs is None else dict(pair.split(b"=", 1) for pair in pairs)
        kept = [number for number in keeps if number != failing]
        deaf = [number for number in signal.valid_signals() if signal.getsignal(number) == signal.SIG_IGN]
        limits = [resource.getrlimit(limit) for limit in LIMITS]
        folder = os.fsdecode(place or Path.cwd())
        order = Order(*line, folder, environment, [0, 1, 2, *kept], session, deaf, limits)
        with _lock, suppress(OSError):
            if found := _forked(order, [*streams, *kept]):
                return found
    return _start(
        args, programs, closes, keeps, place, pairs, stdin, to, by, stdout, error, stderr, seen, failing, restores,
        session, group, gid, gids, uid, umask, before, *more,
    )  # fmt: skip


def _forked(order: Order, descriptors: list[int]) -> int:
    """The number of a process that is as ordered; 0 if none can be."""
    global _source
    if _read(order.environment) != _usual or not _ours(order):
        return 0
    if _forks:
        return os.fork() or _run(order, descriptors)
    if _source is None:
        _source = _imported()
    content = pickle.dumps(tuple(order))
    passed = socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors)
    control = ctypes.CDLL(None).prctl
    control(ADOPTS, 1, 0, 0, 0)
    try:
        _source.sendmsg([len(content).to_bytes(8, "little")], [passed])
        _source.sendall(content)
        return int.from_bytes(_source.recv(8, socket.MSG_WAITALL), "little")
    finally:
        control(ADOPTS, 0, 0, 0, 0)


def _imported() -> socket.socket:
    """The other end of a process that has imported everything and waits."""
    ours, its = socket.socketpair()
    root, number, package = str(Path(__file__).parents[1]), its.fileno(), str(PACKAGE)
    asked = f"wait({number}, {os.getpid()}, {package!r})"
    code = f"import sys; sys.path.insert(0, {root!r}); from tests.warm import wait; {asked}"
    nothing = os.open(os.devnull, os.O_RDWR)
    environment = [k + b"=" + v for k, v in os.environb.items() if k != b"PYTHONPATH"]
    fails = os.pipe()
    _start(
        [sys.executable, "-P", "-c", code], [os.fsencode(sys.executable)], True, tuple(sorted((number, fails[1]))),
        None, environment, nothing, -1, -1, nothing, -1, -1, *fails, True, False, -1, None, None, None, -1, None, True,
    )  # fmt: skip
    for descriptor in (*fails, nothing):
        os.close(descriptor)
    its.close()
    return ours


def wait(number: int, parent: int, package: str) -> None:
    """The life of the process that has imported everything, in which it forks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    asked = socket.socket(fileno=number)
    for name in IMPORTED:
        importlib.import_module(f"spook_tracker.tracker.{name}")
    if str(PACKAGE) != package:
        os._exit(1)  # the one that asks has the tracker from elsewhere: what it starts will, too
    del sys.path[0], sys.modules["tests"], sys.modules[__name__]
    gc.collect()
    gc.freeze()
    while os.getppid() == parent:
        length, descriptors, *_ = socket.recv_fds(asked, 8, 64)
        if not length:
            break
        content = b""
        while len(content) < int.from_bytes(length, "little"):
            content += asked.recv(1 << 20)
        order = Order(*pickle.loads(content))
        told, tells = os.pipe()
        between = os.fork()
        if between == 0:
            number = os.getpid()
            if (process := os.fork()) == 0:
                asked.detach()
                while os.getppid() == number:  # or it could ask to end with this parent, which does
                    time.sleep(1e-4)
                _run(order, descriptors)
            os.write(tells, process.to_bytes(8, "little"))
            os._exit(0)
        os.waitpid(between, 0)  # from now on the fork is a child of the one that asked
        asked.sendall(os.read(told, 8))
        for descriptor in (told, tells, *descriptors):
            os.close(descriptor)
    os._exit(0)


def _become(order: Order, descriptors: list[int]) -> None:
    """Be as if this process had been started for a program."""
    global _forks, _lock
    _lock = threading.Lock()  # the other is held where this one was forked
    if order.session:
        os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in order.deaf:
        signal.signal(number, signal.SIG_IGN)
    high = [fcntl.fcntl(descriptor, fcntl.F_DUPFD, 512) for descriptor in descriptors]
    for number, descriptor in zip(order.numbers, high, strict=True):
        os.dup2(descriptor, number)
    for number in map(int, os.listdir("/proc/self/fd")):  # noqa: PTH208 - numbers, not paths
        if number not in order.numbers:
            with suppress(OSError):
                os.close(number)
    os.chdir(order.place)
    os.environ.clear()
    os.environb.update(order.environment)
    end()
    if order.kind in ("module", "command"):
        _forks = True
        begin()
    sys.path[:0] = _path(order)
    sys.argv[:] = order.words
    importlib.invalidate_caches()
    for limit, given in zip(LIMITS, order.limits, strict=True):
        resource.setrlimit(limit, given)


def _run(order: Order, descriptors: list[int]) -> NoReturn:
    """Its program; at the end what Python does at the end, but for taking its modules apart."""
    code: object = 1
    try:
        _become(order, descriptors)
        if order.kind == "module":
            runpy.run_module(order.program, run_name="__main__", alter_sys=True)
        elif order.kind == "command":
            runpy.run_path(order.program, run_name="__main__")
        else:
            main = sys.modules["__main__"] = types.ModuleType("__main__")
            exec(compile(order.program, "<string>", "exec"), main.__dict__)
        code = 0
    except SystemExit as end:
        code = end.code
    except BaseException:
        sys.excepthook(*sys.exc_info())
    try:
        if not isinstance(code, int | None):
            print(code, file=sys.stderr)
            code = 1
        for thread in threading.enumerate():
            if thread is not threading.main_thread() and not thread.daemon:
                thread.join()
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit((code or 0) & 255)
