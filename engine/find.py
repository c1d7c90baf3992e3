"""An engine by its name: ours, one of `engine/peers/`, one a package announces, or module:attribute.

    spook                      ours (also "engine", the older name)
    mujoco, exudyn, cannon …   another engine behind an adapter of ours: an optional extra (from PyPI or npm), or built
    any other word             what an installed package announces as an entry point "spook_tracker.engines"
    my_engine, my_engine:NAME  a module with simulate and build_info, or an `Adapter` called ENGINE or NAME

The folder one stands in is looked at, too: a team's own engine needs no installation.
"""

from __future__ import annotations

import importlib
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .build_info import BuildInfo
from .errors import EngineError
from .observe import Observable
from .protocol import Adapter, Configuration, run
from .result import Result
from .scene import Scene

OURS = ("spook", "engine")
GROUP = "spook_tracker.engines"
EXTRAS: Mapping[str, str] = {
    "mujoco": "mujoco",
    "exudyn": "exudyn",
    "pybullet": "pybullet",
    "drake": "drake",
    "dart": "dartpy",
    "rapier3d": "rapier3d",
    "sapien": "sapien",
    "mjx": "mujoco-mjx",
    "newton": "newton",
    "mujoco_warp": "mujoco-warp",
    "motrixsim": "motrixsim",
    "simbody": "opensim",
}  # engine: its package, from PyPI
NODE: Mapping[str, str] = {
    "cannon": "cannon-es",
    "rapier": "@dimforge/rapier3d-compat",
    "jolt": "jolt-physics",
    "p2": "p2-es",
}  # engine: its package, from npm
BUILT: Mapping[str, str] = {
    "box3d": ".ci/box3d"
}  # engine: what builds it from its source, in a checkout of ours


class EngineMissing(EngineError):
    """There is no such engine, or it is not installed; the message names the way out."""


@dataclass(frozen=True, slots=True)
class Peer:
    """An adapter with the face of an engine: simulate, build_info and its configurations."""

    adapter: Adapter
    gating: bool = False  # whether its values decide an exit code

    @property
    def configurations(self) -> tuple[Configuration, ...]:
        """Its settings; the first is its gate."""
        return self.adapter.configurations

    @property
    def build_info(self) -> BuildInfo:
        """Which version of it is installed."""
        return self.adapter.build_info()

    def simulate(
        self, scene: Scene, *, observe: Mapping[str, Observable] | None = None, **options: Any
    ) -> Result:
        """`engine.simulate` with one option more: configuration."""
        return run(self.adapter, scene, observe=observe or {}, **options)


def find(name: str) -> Any:
    """The engine of that name: our package, a Peer, or a module. Raises EngineMissing."""
    if name in OURS:
        return importlib.import_module("spook_tracker.engine")
    if name in EXTRAS or name in NODE or name in BUILT:
        return Peer(_peer(name).ENGINE)
    from importlib.metadata import entry_points

    for point in entry_points(group=GROUP):
        if point.name == name:
            return _faced(_loaded(name, point.load))
    module, _, attribute = name.partition(":")
    look_beside()
    found = _loaded(name, lambda: _module(module))
    if attribute:
        found = _loaded(name, lambda: getattr(found, attribute))
    return _faced(getattr(found, "ENGINE", found))


def look_beside(folder: str = "") -> None:
    """Let modules be found in `folder` and in the one where one stands, where the console script does not look.

    Only once such a module is wanted: until then none of them can stand in for one of ours or of Python's.
    """
    for place in filter(None, (folder, str(Path.cwd()))):
        if place not in sys.path:
            sys.path.insert(0, place)


def _module(name: str) -> Any:
    if not all(name.split(".")) or "\0" in name:
        raise ImportError(f"{name!r} is no name of a module")
    return importlib.import_module(name)


def known() -> tuple[str, ...]:
    """Names of the engines that can be asked for, installed or not."""
    from importlib.metadata import entry_points

    return ("spook", *EXTRAS, *NODE, *BUILT, *sorted(point.name for point in entry_points(group=GROUP)))


def _faced(found: Any) -> Any:
    """Adapters get the face of an engine; a team that brings one wants to be told, so it gates unless it says not."""
    if isinstance(found, Adapter):
        return Peer(found, gating=getattr(found, "gating", True))
    return found


def _peer(name: str) -> Any:
    try:
        return importlib.import_module(f"spook_tracker.engine.peers.{name}")
    except ImportError as error:
        if name in BUILT:
            how = f"build it with: {BUILT[name]}"
        elif name in NODE:
            how = f"install it with: npm install {NODE[name]}"
        else:
            how = f"install it with: pip install 'spook-tracker[{name}]'"
        raise EngineMissing(f"engine {name!r} is not installed ({error}); {how}") from None
    except Exception as error:
        raise EngineMissing(f"engine {name!r} does not load: {thrown(error)}") from None


def thrown(error: Exception) -> str:
    """What a module from elsewhere raised while it was imported, and where, in a line."""
    *_, last = traceback.extract_tb(error.__traceback__)
    told = " ".join(str(error).split())
    return f"{type(error).__name__}: {told} ({last.filename}, line {last.lineno})"


def _loaded(name: str, load: Any) -> Any:
    try:
        return load()
    except (ImportError, AttributeError) as error:
        names = ", ".join(known())
        raise EngineMissing(
            f"there is no engine {name!r} ({error}); name one of {names}, or a module, or module:attribute"
        ) from None
    except Exception as error:
        raise EngineMissing(f"engine {name!r} does not load: {thrown(error)}") from None
