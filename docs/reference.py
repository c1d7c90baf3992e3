"""What is made when the documentation is built: pages from the code (commands, tables and views, the library), and the search.

The search is a script with the text of every section, so that it also works from a folder, where a page may not fetch.
"""

from __future__ import annotations

import ast
import dataclasses
import html
import inspect
import io
import json
import re
import textwrap
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click


def on_files(files: Any, config: Any) -> Any:
    """MkDocs asks for the files of the site: those that are not written by hand come here."""
    from mkdocs.structure.files import File

    for name, page in PAGES.items():
        files.append(File.generated(config, f"reference/{name}.md", content="\n".join(page()) + "\n"))
    return files


SECTION = re.compile(r'<h[1-4] id="([^"]*)">(.*?)</h[1-4]>', re.DOTALL)
sections: list[tuple[str, str, str, str]] = []  # address, page, heading, text


def on_pre_build(config: Any) -> None:
    """A server builds again and again."""
    sections.clear()


def on_page_content(content: str, page: Any, config: Any, files: Any) -> str:
    """MkDocs asks what to do with a page: its sections are remembered for the search."""
    parts = SECTION.split(content)
    for anchor, heading, text in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        told = (page.title or "", *(_text(part) for part in (heading, text)))
        sections.append((f"{page.url}#{anchor}", *told))
    return content


def on_post_build(config: Any) -> None:
    """The sections as a script beside the pages."""
    written = f"const SECTIONS = {json.dumps(sections, ensure_ascii=False, separators=(',', ':'))};\n"
    (Path(config.site_dir) / "search-sections.js").write_text(written, encoding="utf-8")


def _text(part: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", part)).split())


def commands() -> Iterator[str]:
    """Every command with its options, as `--help` prints them."""
    from spook_tracker.tracker.cli.main import main

    yield "# Commands\n"
    yield "Exit codes everywhere: 0 same, better or green; 1 a regression or a red test; 2 usage, no data; 3 not comparable.\n"
    yield 'Completion for the shell: `eval "$(_TRACKER_COMPLETE=bash_source tracker)"` (or `zsh_source`, `fish_source`).\n'
    yield from _command(main, "tracker")


def _command(command: click.Command, name: str) -> Iterator[str]:
    context = click.Context(command, info_name=name, max_content_width=100, terminal_width=100)
    yield f"## {name}\n\n```text\n{click.unstyle(command.get_help(context))}\n```\n"
    if isinstance(command, click.Group):
        for word, inner in sorted(command.commands.items()):
            yield from _command(inner, f"{name} {word}")


def schema() -> Iterator[str]:
    """Every table and view with its columns, as the models say them."""
    from spook_tracker.tracker.store.models import Base
    from spook_tracker.tracker.store.views import ABOUT, COLUMNS, columns_of

    yield "# Tables and views\n"
    yield "Made from the models. Times are UTC; ids are hashes of their content, 53 bits. `column_comments` holds this page.\n"
    for view, words in ABOUT.items():
        yield f"## View {view}\n\n{words}\n\n| column | holds |\n|---|---|"
        yield from (f"| `{column}` | {COLUMNS[column]} |" for column in columns_of(view))
        yield ""
    for table in Base.metadata.sorted_tables:
        yield f"## Table {table.name}\n\n{table.comment}\n\n| column | type | key | holds |\n|---|---|---|---|"
        for column in table.columns:
            key = "primary" if column.primary_key else ""
            key += f" → `{next(iter(column.foreign_keys)).target_fullname}`" if column.foreign_keys else ""
            yield f"| `{column.name}` | {_type(column)} | {key} | {column.comment} |"
        yield ""


def _type(column: Any) -> str:
    return str(column.type) + ("" if not column.nullable else ", may be NULL")


def library() -> Iterator[str]:
    """The public names of the library and of the engine, with their docstrings."""
    from spook_tracker import engine, tracker

    yield "# The Python library\n"
    for title, module, path in (
        ("The tracker", tracker, "spook_tracker.tracker"),
        ("The engine", engine, "spook_tracker.engine"),
    ):
        yield f"## {title}: `{path}`\n"
        for name in sorted(module.__all__):
            thing = getattr(module, name)
            told = inspect.getdoc(thing) if inspect.isclass(thing) or inspect.isroutine(thing) else None
            yield f"### {name}\n\n```text\n{_signature(name, thing)}{told or 'A value of the type ' + type(thing).__name__}\n```\n"
            if rows := list(fields(thing)):
                yield "| field | holds |\n|---|---|"
                yield from (f"| `{field}` | {holds} |" for field, holds in rows)
                yield ""


def fields(thing: Any) -> Iterator[tuple[str, str]]:
    """The fields of a dataclass, its bases' first, with what the comment behind each says: unit, axes, meaning."""
    if not (inspect.isclass(thing) and dataclasses.is_dataclass(thing)):
        return
    told: dict[str, str] = {}
    for kind in reversed(inspect.getmro(thing)):
        if dataclasses.is_dataclass(kind):
            told |= _commented(textwrap.dedent(inspect.getsource(kind)))
    for field in dataclasses.fields(thing):
        if field.init and told.get(field.name):
            yield field.name, told[field.name]


def _commented(source: str) -> dict[str, str]:
    """What the comments behind the fields of a class say."""
    lines = io.StringIO(source).readline
    comments = {
        token.start[0]: token.string.lstrip("# ")
        for token in tokenize.generate_tokens(lines)
        if token.type == tokenize.COMMENT
    }
    told = {}
    for line in ast.parse(source).body[0].body:
        if isinstance(line, ast.AnnAssign):
            words = [comments[at] for at in range(line.lineno, line.end_lineno + 1) if at in comments]
            told[line.target.id] = " ".join(words).replace("|", "\\|")
    return told


def _signature(name: str, thing: Any) -> str:
    try:
        return f"{name}{inspect.signature(thing)}\n\n" if callable(thing) else ""
    except (TypeError, ValueError):
        return ""


PAGES = {"commands": commands, "schema": schema, "library": library}
