"""Write the website: read the history once, make every page from it, swap the folder in.

The same history gives the same bytes: nothing here asks for the time, the machine or a random number. A page
is made again only if what stands on it, its template or the tracker changed.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from spook_tracker.tracker.document.collection import no_collection
from spook_tracker.tracker.document.json_form import Number, plain
from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.wording import clean, slug, web_address
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.causes import Cause
from spook_tracker.tracker.resources import resource

from . import data_files, feed, judged_nights
from .causes import causes_of
from .chart_files import ChartFiles
from .colours import accent
from .comparisons import (
    FILE,
    Comparisons,
    comparisons,
    page_files,
    read_known,
    stored,
)
from .events import Event, all_events
from .folder import FolderError, digest, replacing
from .known_charts import KnownCharts
from .live_module import built_module, module_script
from .nights import Book, Records, book
from .options import DEFAULTS, SiteOptions
from .page_index import health
from .page_mutants import read_mutants
from .page_rows import Page
from .pages import NAVIGATION, pages
from .recorded import read_files
from .recorded import told as told_beside
from .replays import replay_files
from .templates import environment
from .tonight import tonight_scripts

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["FolderError", "Report", "publish"]

ASSETS = {  # name in templates: file under site/static
    "css": "site.css",
    "theme": "theme.js",
    "packed": "packed.js",
    "site": "site.js",
    "judge": "judge.js",
    "nights": "compare-nights.js",
    "compare": "compare.js",
    "plotly": "plotly-cartesian.min.js",
    "three": "three-scene.min.js",
    "poses": "scene-poses.js",
    "marks": "scene-marks.js",
    "view": "scene-view.js",
    "player": "player.js",
    "replay": "replay.js",
    "live_engine": "live-engine.js",
    "live": "live.js",
}
TITLE = "SPOOK tracker"  # of the website, unless a team says otherwise
PLAIN_ASSETS = (
    "icon.svg",
    "formulas.woff2",
    "formulas-LICENSE.txt",
    "plotly-LICENSE.txt",
    "three-LICENSE.txt",
)


@dataclass(frozen=True)
class Report:
    """What a publication did."""

    written: int
    skipped: int  # unchanged since the last time
    out: Path
    failed: tuple[str, ...] = ()  # files that could not be made, each with the reason

    @property
    def pages(self) -> int:
        """All files of the website."""
        return self.written + self.skipped

    @property
    def bytes(self) -> int:
        """Of all files."""
        return sum(path.stat().st_size for path in self.out.rglob("*") if path.is_file())


@no_collection()
def publish(
    history: Records,
    out: Path,
    accepted: Sequence[Accepted] = (),
    database: bytes | None = None,
    options: SiteOptions = DEFAULTS,
) -> Report:
    """Write the website of a history to the folder `out`. FolderError if the folder is not one of ours.

    `accepted` are the levels of accepted.toml: what they take is told as accepted, not as red. `database` is
    the file of the database, where readers shall be able to load it. ColourError if the colour of the options cannot
    be read. What cannot be made says so in its place, and everything else is published.
    """
    site = resource("site")
    static, templates = site / "static", site / "templates"
    contents = {name: (static / file).read_bytes() for name, file in ASSETS.items()}
    names = {name: _hashed(ASSETS[name], content) for name, content in contents.items()}
    making = digest(*(path.read_bytes() for path in sorted([*templates.iterdir(), *_sources()])))
    made = environment(templates)
    place = Path.cwd() / out
    kept = Kept(place.with_name(f".{place.name}.kept"), making)
    told = book(history, accepted, kept)
    beside = told_beside(read_files(options.recorded), told) if options.recorded and told.nights else None
    failed: list[str] = []
    documents, mutants = options.documents, read_mutants(options.mutants) if options.mutants else ()
    whose = {
        "site_title": clean(options.title) or TITLE,
        "home_page": web_address(options.home_page),
        "accent": accent(options.colour),
        "documents": documents is not None and (documents / "index.html").is_file(),
    }
    with replacing(out) as folder:
        for name, content in contents.items():
            folder.add(f"assets/{names[name]}", digest(content), partial(bytes, content))
        module, navigation = "", tuple(entry for entry in NAVIGATION if entry[0] != "live.html")
        if (engine := built_module(static)) is not None:
            worker = contents["packed"] + contents["live_engine"]
            module = f"assets/{_hashed('live-module.js', engine + worker)}"
            folder.add(module, digest(making.encode(), engine), partial(module_script, engine, worker))
            navigation = NAVIGATION
        for file in PLAIN_ASSETS:
            content = (static / file).read_bytes()
            folder.add(f"assets/{file}", digest(content), partial(bytes, content))
        if documents and whose["documents"]:
            for page in sorted(path for path in documents.rglob("*") if path.is_file()):
                content = page.read_bytes()
                folder.add(f"docs/{page.relative_to(documents)}", digest(content), partial(bytes, content))
        events = all_events(told) if told.nights else []
        causes = causes_of(told)
        levels = digest(making.encode(), repr(accepted).encode())
        compared = cache(lambda: comparisons(history, told, accepted, read_known(out, levels)))
        drawn = ChartFiles()

        def render(page: Page) -> tuple[str, bytes]:
            """The page and what it is made from."""
            context = _context(page, names, bool(told.nights)) | {
                "database": database is not None,
                "wrong_on_purpose": bool(mutants),
            }
            context |= whose | {"navigation": navigation}
            source = digest(making.encode(), page.template.encode(), _bytes_of(context))
            if folder.unchanged(page.path, source):
                return source, b""
            return source, made.get_template(page.template).render(context).encode("utf-8", "replace")

        over_nights = KnownCharts(kept, told.nights, events, folder.unchanged)
        for planned in pages(told, events, causes, compared, over_nights, module, mutants, beside):
            charts: dict[str, tuple[str, bytes]] = {}
            try:
                made_page = planned.make()
                found = drawn.add(made_page.context)  # what stands on the page is where the numbers are
                source, text = render(made_page)
                charts = found
                if made_page.nightly:
                    test, times = made_page.nightly
                    drawn.add_part(test, made.get_template("times.html").render(times))
            except Exception as error:  # whatever it is, the other pages are worth publishing
                reason = f"{type(error).__name__}: {clean(str(error))[:300]}"
                failed.append(f"{planned.path}: {reason}")
                context = {"what": planned.title, "reason": reason}
                source, text = render(Page(planned.path, "failed.html", planned.title, "", context))
            folder.add(planned.path, source, partial(bytes, text))
            for address, (mark, content) in charts.items():
                if address not in folder.made:  # the overviews have charts of the tests again
                    folder.add(address, mark, partial(bytes, content))
        for address, content in drawn.nightly_files().items():
            folder.add(address, digest(content), partial(bytes, content))
        for address, content in tonight_scripts(told).items():
            folder.add(address, digest(content), partial(bytes, content))
        files = _data(told, events, causes, str(whose["site_title"]))
        if told.nights:
            files = chain(
                files, _stored(compared, levels, told, accepted), judged_nights.files(history, told)
            )
        if database is not None:
            files = chain(files, [("data/tracker.db", database, partial(bytes, database))])
        for path, made_from, make in _surviving(files, failed):
            try:
                folder.add(path, digest(making.encode(), made_from), make)
            except OSError:
                raise
            except Exception as error:
                failed.append(f"{path}: {type(error).__name__}: {clean(str(error))[:300]}")
    over_nights.keep(kept)
    kept.save()
    return Report(folder.written, folder.skipped, folder.old, tuple(failed))


File = tuple[str, bytes, Callable[[], bytes]]  # path, what it is made from, and how


def _surviving(files: Iterator[File], failed: list[str]) -> Iterator[File]:
    """The files up to one whose making fails, which is written down."""
    try:
        yield from files
    except Exception as error:
        failed.append(f"data: {type(error).__name__}: {clean(str(error))[:300]}")


def _stored(
    compared: Callable[[], Comparisons], levels: str, told: Book, accepted: Sequence[Accepted]
) -> Iterator[File]:
    pairs = stored(compared(), levels)
    yield FILE, pairs, partial(bytes, pairs)
    script = page_files(compared(), told, accepted)
    yield "compare/newest.js", script, partial(bytes, script)


def _data(told: Book, events: Sequence[Event], causes: Sequence[Cause], author: str) -> Iterator[File]:
    """Files of numbers."""
    if not told.nights:
        return
    texts = data_files.NightTexts(told.nights)
    for test in told.tests:
        for kind, content in (
            ("csv", data_files.changes_csv(test, texts)),
            ("json", data_files.test_json(test, texts)),
        ):
            yield f"data/{slug(test.name)}.{kind}", content, partial(bytes, content)
    for month, source, make in data_files.run_times(told):
        yield f"data/run-times-{month}.csv", source, make
    for path, content in replay_files(told.motions).items():
        yield path, content, partial(bytes, content)
    tables = {
        "tonight": data_files.newest(told, told.tests),
        "nights": data_files.nights(told),
        "regressions": data_files.regressions(events),
    }
    for name, (columns, lines) in tables.items():
        source = repr(lines).encode("utf-8", "backslashreplace")
        yield f"data/{name}.csv", source, partial(data_files.table, columns, lines)
        if name != "tonight":  # the same numbers stand in the JSON of each test
            yield f"data/{name}.json", source, partial(data_files.records, columns, lines)
    counted = data_files.table(*data_files.work(told))
    yield "data/work.csv", counted, partial(bytes, counted)
    news = feed.atom(told, causes, author)
    yield "feed.xml", news, partial(bytes, news)
    state, found = health(told)
    words = feed.badge_words(found)
    yield "badge.svg", (state + words).encode(), partial(feed.badge_svg, state, words)
    yield "badge.json", (state + words).encode(), partial(feed.badge_json, state, words)


def _context(page: Page, assets: dict[str, str], any_night: bool) -> dict[str, object]:
    return {
        "title": page.title,
        "description": page.description,
        "root": "../" * page.path.count("/"),
        "here": page.path,
        "assets": assets,
        "plotly": page.plotly,
        "module": "",  # the live page has one
        "any_night": any_night,
        **page.context,
    }


def _hashed(file: str, content: bytes) -> str:
    """A name that changes with the content, so that a browser never shows an old one."""
    stem, _, kind = file.rpartition(".")
    return f"{stem}-{hashlib.sha256(content).hexdigest()[:8]}.{kind}"


def _sources() -> list[Path]:
    """The modules whose change makes every page again."""
    return sorted(Path(__file__).parent.parent.rglob("*.py"))


def _bytes_of(context: Mapping[str, object]) -> bytes:
    """What stands on a page, as bytes to be hashed."""

    def told(thing: object) -> object:
        if not isinstance(thing, Number) and dataclasses.is_dataclass(thing) and not isinstance(thing, type):
            return {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing)}
        return plain(thing)

    return msgspec.json.encode(context, enc_hook=told, order="deterministic")
