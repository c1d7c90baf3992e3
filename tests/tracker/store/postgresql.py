"""A throw-away PostgreSQL server: its own folder, a socket in that folder, no port, no durability."""

from __future__ import annotations

import contextlib
import itertools
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import psycopg

WITHOUT_RIGHTS = 65534  # the id of the user that Linux gives no file
MISSING = "no PostgreSQL server binaries (initdb) here; .ci/install-system installs them"


def binaries() -> Path | None:
    """The folder of the newest installed server, or None."""
    installed = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    if installed:
        return installed[-1].parent
    found = shutil.which("initdb")
    return Path(found).parent if found else None


class Server:
    """A running server that makes databases."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._numbers = itertools.count(1)

    @contextlib.contextmanager
    def new_database(self, copied: str = "template1") -> Iterator[str]:
        """The URL of a new database, dropped at the end: empty, or a copy of one that is not open."""
        name = f"tracker_{next(self._numbers)}"  # made here: nothing given from outside enters a statement
        with self._connection() as connection:
            files = " STRATEGY FILE_COPY" if connection.info.server_version >= 150000 else ""  # less work
            connection.execute(f"CREATE DATABASE {name} TEMPLATE {copied}{files}")
        try:
            yield f"postgresql://tracker@/{name}?host={self.folder}"
        finally:
            with self._connection() as connection:
                connection.execute(f"DROP DATABASE {name} WITH (FORCE)")

    def _connection(self) -> psycopg.Connection[Any]:
        return psycopg.connect(f"host={self.folder} user=tracker dbname=postgres", autocommit=True)


@contextlib.contextmanager
def running_server(
    programs: Path, more: Mapping[str, str] | None = None, where: str | None = None
) -> Iterator[Server]:
    """Start a server, as another user if we are root (it refuses to run as root), and stop it at the end.

    `more` are further settings; the server's folder is made in `where`, or where it is quickest.
    """
    folder = Path(tempfile.mkdtemp(prefix="pg-", dir=where or _where()))
    user: dict[str, int] = {}
    if os.geteuid() == 0:
        other = _other_user()
        user = {"user": other.pw_uid, "group": other.pw_gid}
        os.chown(folder, other.pw_uid, other.pw_gid)
    data, log = folder / "data", folder / "log"
    settings = {
        "listen_addresses": "",
        "unix_socket_directories": str(folder),
        "fsync": "off",
        "synchronous_commit": "off",
        "full_page_writes": "off",
        "shared_buffers": "32MB",
        "wal_level": "minimal",
        "max_wal_senders": "0",
        "max_wal_size": "64MB",
    } | dict(more or {})
    process = None
    try:
        initialise = [
            programs / "initdb",
            "-D",
            data,
            "-U",
            "tracker",
            "-A",
            "trust",
            "-E",
            "UTF8",
            "--no-sync",
        ]
        subprocess.run([*initialise, "--locale=C"], check=True, capture_output=True, cwd="/", **user)
        options = [word for name, value in settings.items() for word in ("-c", f"{name}={value}")]
        with log.open("wb") as output:
            process = subprocess.Popen(
                [programs / "postgres", "-D", data, *options], stdout=output, stderr=output, cwd="/", **user
            )
        _wait_until_ready(process, folder, log)
        yield Server(folder)
    finally:
        if process is not None:
            process.send_signal(signal.SIGINT)  # fast shutdown
            process.wait(timeout=30)
        shutil.rmtree(folder, ignore_errors=True)


def _where() -> str:
    """Memory where there is enough of it: on a busy disk a new database takes ten times as long.

    Either path is short: a socket's allows no long one.
    """
    memory = Path("/dev/shm")
    return str(memory) if memory.is_dir() and shutil.disk_usage(memory).free > 1 << 30 else "/tmp"


def _other_user() -> pwd.struct_passwd:
    for known in (lambda: pwd.getpwnam("postgres"), lambda: pwd.getpwuid(WITHOUT_RIGHTS)):
        with contextlib.suppress(KeyError):
            return known()
    raise RuntimeError("there is no user but root to run PostgreSQL")


def _wait_until_ready(process: subprocess.Popen[bytes], folder: Path, log: Path) -> None:
    end = time.monotonic() + 30
    while time.monotonic() < end and process.poll() is None:
        try:
            psycopg.connect(f"host={folder} user=tracker dbname=postgres", connect_timeout=2).close()
            return
        except psycopg.OperationalError:
            time.sleep(0.05)
    raise RuntimeError(f"PostgreSQL did not start: {log.read_text(errors='replace')[-500:]}")
