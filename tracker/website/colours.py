"""A team's own colour on the website: of links and buttons. One that cannot be read on white is refused.

Contrast is that of WCAG 2, which asks 4.5 of text. For the dark theme the colour is lightened until it has that.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from spook_tracker.tracker.document.errors import TrackerError

LIGHT = ("#ffffff", "#f6f7f9")  # grounds of text in site.css, by theme
DARK = ("#11161c", "#0c1014", "#151b22")
LEAST = 4.5
TINT, SHADE = 0.08, 0.18  # share of the colour in a soft ground
Colour = tuple[float, float, float]  # red, green, blue, 0 to 255


class ColourError(TrackerError):
    """What was given is no colour, or none that can be read; one sentence."""


@dataclass(frozen=True)
class Accent:
    """The colour and its soft ground, for both themes."""

    light: str
    light_soft: str
    dark: str
    dark_soft: str


def accent(colour: str) -> Accent | None:
    """The colours of a site whose team has one, as #rrggbb; None without one. ColourError if it cannot be read."""
    if not colour:
        return None
    if re.fullmatch("#[0-9a-fA-F]{6}", colour) is None:
        raise ColourError(f"{colour!r} is no colour; write it as #rrggbb, such as #00609a")
    given = _parsed(colour)
    soft = _mixed(given, _parsed(LIGHT[0]), TINT)
    least = min(contrast(colour, ground) for ground in (*LIGHT, _written(soft)))
    if least < LEAST:
        raise ColourError(
            f"text in {colour} cannot be read on white: its contrast is {least:.1f}, {LEAST} is needed; take a darker one"
        )
    for percent in range(101):
        lighter = _mixed(_parsed("#ffffff"), given, percent / 100.0)
        dark, shade = _written(lighter), _written(_mixed(lighter, _parsed(DARK[0]), SHADE))
        if min(contrast(dark, ground) for ground in (*DARK, shade)) >= LEAST:
            break
    return Accent(_written(given), _written(soft), dark, shade)


def contrast(one: str, other: str) -> float:
    """Of two colours, 1 to 21 (WCAG 2.2, "contrast ratio")."""
    high, low = sorted((_luminance(_parsed(one)), _luminance(_parsed(other))), reverse=True)
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: Colour) -> float:
    red, green, blue = (
        v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in (c / 255.0 for c in colour)
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _mixed(one: Colour, other: Colour, share: float) -> Colour:
    red, green, blue = (share * a + (1.0 - share) * b for a, b in zip(one, other, strict=True))
    return red, green, blue


def _parsed(text: str) -> Colour:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


def _written(colour: Colour) -> str:
    return "#" + "".join(f"{round(part):02x}" for part in colour)
