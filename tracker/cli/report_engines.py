"""The engines there are, as `tracker engines` prints them."""

from __future__ import annotations

import textwrap

from spook_tracker.engine.find import EngineMissing, find, known

from .console import width


def engine_lines() -> list[str]:
    """Name and version of each engine, with its configurations and their reasons; or what to install."""
    lines: list[str] = []
    for name in known():
        try:
            engine = find(name)
            version = engine.build_info.version
        except EngineMissing as error:
            lines.append(f"{name}: {error}")
            continue
        configurations = getattr(engine, "configurations", ())
        lines.append(
            f"{name} {version}" + ("" if configurations else ": ours; each test names its configurations")
        )
        for one in configurations:
            order = "" if one.expected_order is None else f" (order {one.expected_order:g})"
            text = f"{one.name}{order}: {one.reason}"
            lines += textwrap.wrap(text, width(), initial_indent="  ", subsequent_indent="      ")
    return lines
