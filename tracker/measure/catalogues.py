"""A catalogue by its name: ours, one a package announces, module:NAME, or several with commas between.

    standard                   ours, which needs SciPy
    any other word             what an installed package announces as an entry point "spook_tracker.catalogues"
    robot.xml, arm=arm.urdf    a model file; a tracker.toml with [[model]] tables (tracker.measure.model_files)
    my_tests, my_tests:NAME    a module with a table name → ScalarTest, called CATALOGUE or NAME

The folder one stands in is looked at, too: a team's own questions need no installation.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from importlib.util import find_spec

from spook_tracker.engine.find import look_beside, thrown
from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.scalar_tests.catalogue import CATALOGUE, Catalogue
from spook_tracker.tracker.document.errors import TrackerError

from .bounds import STANDARD as STANDARD
from .model_files import catalogue as catalogue_of_models
from .model_files import is_model

GROUP = "spook_tracker.catalogues"


class CatalogueError(TrackerError):
    """There is no such catalogue, or it is none; one sentence that names the way out."""


class Several(Mapping[str, ScalarTest]):
    """Catalogues one after the other; none of our own tests is imported before it is asked for."""

    def __init__(self, parts: Mapping[str, Mapping[str, ScalarTest]]) -> None:
        self.owner: dict[str, Mapping[str, ScalarTest]] = {}
        first: dict[str, str] = {}
        for name, part in parts.items():
            for test in part:
                if test in first:
                    raise CatalogueError(f"{first[test]} and {name} both have a test {test!r}; rename one")
                self.owner[test], first[test] = part, name

    def __getitem__(self, test: str) -> ScalarTest:
        return self.owner[test][test]

    def __iter__(self) -> Iterator[str]:
        return iter(self.owner)

    def __len__(self) -> int:
        return len(self.owner)


class Changed(Mapping[str, ScalarTest]):
    """The tests of a catalogue asked otherwise, each when it is asked for: none of the others is imported."""

    def __init__(
        self, tests: Mapping[str, ScalarTest], change: Callable[[str, ScalarTest], ScalarTest]
    ) -> None:
        self.tests, self.change = tests, change
        self.found: dict[str, ScalarTest] = {}

    def __getitem__(self, name: str) -> ScalarTest:
        if name not in self.found:
            self.found[name] = self.change(name, self.tests[name])
        return self.found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.tests)

    def __len__(self) -> int:
        return len(self.tests)


def find(names: str) -> Mapping[str, ScalarTest]:
    """The tests of the catalogues named, in that order. A test that two of them have is refused."""
    asked_for = [part.strip() for part in names.split(",")]
    if len(asked_for) == 1:
        return _one(asked_for[0])
    return Several({name: _one(name) for name in asked_for})


def import_ours(names: str) -> None:
    """Import every test of our own catalogue, if it is among those named: processes forked after that need not."""
    if {"standard", STANDARD} & {part.strip() for part in names.split(",")}:
        with suppress(ImportError):  # what is missing is said when the catalogue is looked for
            tuple(CATALOGUE.values())


def _one(name: str) -> Mapping[str, ScalarTest]:
    if is_model(name):
        return catalogue_of_models(name)
    try:
        found = _loaded(STANDARD if name == "standard" else name)
        if isinstance(found, Catalogue) and find_spec("scipy") is not None:
            return found  # ours: none of its tests is imported before it is asked for
        fit = isinstance(found, Mapping) and all(isinstance(test, ScalarTest) for test in found.values())
    except (ImportError, AttributeError) as error:
        if isinstance(error, ModuleNotFoundError) and error.name == "scipy":
            raise CatalogueError(
                f"the catalogue {name!r} needs SciPy; install it with: pip install 'spook-tracker[standard]', "
                "or name tests of your own with --catalogue or in tracker.toml"
            ) from None
        raise CatalogueError(f"there is no catalogue {name!r} ({error}); name one as module:NAME") from None
    except Exception as error:
        raise CatalogueError(f"catalogue {name!r} does not load: {thrown(error)}") from None
    if not fit or not isinstance(found, Mapping):
        raise CatalogueError(f"{name!r} is no catalogue: a mapping from name to ScalarTest")
    catalogue: Mapping[str, ScalarTest] = found
    return catalogue


def _loaded(name: str) -> object:
    from importlib.metadata import entry_points

    for point in () if ":" in name else entry_points(group=GROUP):
        if point.name == name:
            found: object = point.load()
            return found
    module, _, attribute = name.partition(":")
    if not all(module.split(".")) or "\0" in module:
        raise ImportError(f"{module!r} is no name of a module")
    if not module.startswith("spook_tracker."):
        look_beside()
    named: object = getattr(importlib.import_module(module), attribute or "CATALOGUE")
    return named
