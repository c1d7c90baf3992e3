"""`tracker.toml`: what a team says once, in its repository, and every command reads.

    engine = "tracking.adapter"          # as --engine
    catalogue = "standard,tracking.questions"
    database = "sqlite:///history.db"    # as --db; a file is looked for beside tracker.toml
    accepted = "accepted.toml"
    title = "Pebble, every night"        # of the website
    home_page = "https://example.org/pebble"
    colour = "#7a1fa2"                   # of its links and buttons

    [limits]                             # what your engine owes you, by series
    "falling_object/default/velocity_error/*" = 1e-9

    [[model]]                            # a file of yours that every night asks about: tracker.measure.model_files
    file = "assets/robot.xml"

    [build]                              # how a commit is built and asked (tracker/measure/builds.py)
    command = "cmake -S . -B build && cmake --build build"

It is looked for where one stands and in the folders above, up to the root of the repository and no further.
What a command line or an environment variable says goes before it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.toml_file import Toml, read_toml
from spook_tracker.tracker.measure.build_settings import TABLE, Build, build_of

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.limits import Limit, Limits

FILE = "tracker.toml"
KINDS: Mapping[str, tuple[type, ...]] = {  # setting, which is the name of an option: what it may be
    "engine": (str,),
    "catalogue": (str,),
    "database": (str,),
    "accepted": (str,),
    "out": (str,),
    "title": (str,),
    "home_page": (str,),
    "colour": (str,),
    "mutants": (str,),
    "executor": (str,),
    "workers": (int,),
    "memory": (int,),
    "limit": (int, float),
    "time_limit": (int, float),
}
Setting = str | int | float
Defaults = dict[str, "Setting | Defaults"]  # by command, of each by option; a group's within
WORDS = {str: "a text", int: "a whole number", float: "a number"}
NOT_MEANT = {"backfill": {"engine", "catalogue", "out"}, "export": {"out"}, "rank": {"engine"}} | {
    name: {"engine"} for name in ("compare", "judge", "trend")
}


@dataclass(frozen=True)
class Settings:
    """What tracker.toml says; empty without one."""

    values: Mapping[str, Setting] = field(default_factory=dict)
    limits: Limits = ()
    has_models: bool = False
    build: Build | None = None
    folder: Path | None = None  # of tracker.toml

    @property
    def modules(self) -> str:
        """The folder in which engine and catalogue are looked for beside the one where one stands; none if empty."""
        return str(self.folder or "")

    def limits_of(self, engine: str) -> Limits:
        """They are the team's own engine's; another one that is asked beside it is not held to them."""
        return self.limits if engine == str(self.values.get("engine", "spook")).split(",")[0] else ()


class SettingsError(TrackerError):
    """tracker.toml cannot be read, or says something that is not understood."""


def present() -> Settings:
    """Those of the command that is running."""
    context = click.get_current_context(silent=True)
    return (context.find_object(Settings) if context else None) or Settings()


def read(here: Path) -> Settings:
    """The settings that hold in the folder `here`. SettingsError names the file and what is wrong with it."""
    file = _file(here)
    if file is None:
        return Settings()
    try:
        told = read_toml(file)
    except (OSError, ValueError) as error:
        raise SettingsError(f"{file} cannot be read: {error!s:.300}") from None
    limits, models, build = told.pop("limits", {}), told.pop("model", []), told.pop(TABLE, None)
    said: dict[str, Setting] = {}
    for name, value in told.items():
        if name not in KINDS:
            raise SettingsError(
                f"{file}: there is no setting {name!r}; it knows {', '.join(KINDS)}, limits, model, build"
            )
        if not isinstance(value, str | int | float) or type(value) not in KINDS[name] or value != value:
            raise SettingsError(f"{file}: {name} must be {WORDS[KINDS[name][-1]]}, not {value!r}")
        said[name] = value
    if models:
        own = str(file.relative_to(here) if file.is_relative_to(here) else file)
        said["catalogue"] = f"{said.get('catalogue', 'standard')},{own}"
    return Settings(
        values=_placed(said, file.parent, here),
        limits=_limits(file, limits),
        has_models=bool(models),
        build=None if build is None else build_of(build, file),
        folder=file.parent,
    )


def defaults(group: click.Group, settings: Settings) -> Defaults:
    """The same as click wants it: for every command, its options' defaults."""
    found: Defaults = {}
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            found[name] = defaults(command, settings)
        else:
            not_meant = NOT_MEANT.get(name, set()) - ({"catalogue"} if settings.has_models else set())
            known = {p.name for p in command.params} - not_meant
            found[name] = {key: value for key, value in settings.values.items() if key in known}
    return found


def _file(here: Path) -> Path | None:
    """Above the working folder only inside a repository: what lies higher belongs to others."""
    above = [here, *here.parents]
    root = next((place for place, folder in enumerate(above) if (folder / ".git").exists()), 0)
    return next((folder / FILE for folder in above[: root + 1] if (folder / FILE).is_file()), None)


def _placed(said: dict[str, Setting], folder: Path, here: Path) -> dict[str, Setting]:
    """Files beside tracker.toml, wherever in the repository one stands."""
    if folder == here:
        return said
    placed = dict(said)
    for name in ("accepted", "out"):
        if name in said:
            placed[name] = str(folder / str(said[name]))
    url = str(said.get("database", ""))
    if url.startswith("sqlite:///") and not url.startswith("sqlite:////"):
        placed["database"] = f"sqlite:///{folder / url.removeprefix('sqlite:///')}"
    elif url and "://" not in url:
        placed["database"] = str(folder / url)
    return placed


def _limits(file: Path, said: Toml) -> Limits:
    if not isinstance(said, dict):
        raise SettingsError(f"{file}: limits must be a table of series and limits")
    found: list[tuple[str, Limit]] = []
    for series, limit in said.items():
        told = limit if isinstance(limit, list) else [limit]
        numbers = [
            float(n) for n in told if isinstance(n, int | float) and not isinstance(n, bool) and n == n
        ]
        if len(numbers) != len(told) or len(numbers) not in (1, 2):
            raise SettingsError(f"{file}: the limit of {series!r} must be a number or two, not {limit!r}")
        found.append((series, numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])))
    return tuple(found)
