"""How a page words numbers, limits, margins and names.

Everything here returns plain text (Unicode, no markup); escaping is the template's business.
"""

from __future__ import annotations

import hashlib
import math
import re
from dataclasses import dataclass
from datetime import UTC, datetime

from . import outside
from .run_document import EngineVersion, SeriesDefinition

clean = outside.clean  # the website takes it from here
SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
SLUG = re.compile(r"[a-z0-9][a-z0-9_-]{0,59}")
RESERVED = {"con", "prn", "aux", "nul", *(f"com{i}" for i in range(10)), *(f"lpt{i}" for i in range(10))}
GITHUB_RUN = re.compile(r"(https://github\.com/[\w.-]+/[\w.-]+)/actions/runs/\d+")


def number(value: float | None, digits: int = 4) -> str:
    """A number for a reader: 1.635, 4.9×10⁻⁹, 0, ∞; an en dash for none."""
    if value is None:
        return "–"
    if math.isnan(value):
        return "not a number"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e6:
        text = f"{value:.{digits}g}"
        if "e" in text:
            text = f"{value:.0f}"
    else:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        if "." in mantissa:
            mantissa = mantissa.rstrip("0").rstrip(".")
        text = f"{mantissa}×10{str(int(exponent)).translate(SUPERSCRIPTS)}"
        if mantissa in ("1", "-1"):
            text = text.replace("1×", "", 1)
    return text.replace("-", "−")


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """A number with its unit; the unit "1" is not written."""
    text = number(value, digits)
    if value is None or not math.isfinite(value) or unit in ("", "1"):
        return text
    return f"{text}\N{NARROW NO-BREAK SPACE}{clean(unit)}"


def times(factor: float, of: str, more: str) -> str:
    """A factor in words: "18.7 × its limit", or from .9 to 1.1 the difference: "2.1 % beyond its limit"."""
    if 0.9 < factor < 1.1:
        return f"{number(100.0 * abs(factor - 1.0), 2)} % {more}"
    return f"{number(factor, 3)} × {of}"


def pair(before: float, after: float, unit: str, digits: int = 5) -> tuple[str, str]:
    """Two values with enough digits that they read unlike, as many as a double has at most."""
    while digits < 17 and before != after and number(before, digits) == number(after, digits):
        digits += 1
    return quantity(before, unit, digits), quantity(after, unit, digits)


def seconds(value: float) -> str:
    """A run time with a fitting prefix: 1.2 ms, 340 ns."""
    if not math.isfinite(value):
        return number(value)
    for factor, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if abs(value) >= factor:
            return quantity(value / factor, unit, 3)
    return quantity(value / 1e-9, "ns", 3)


def whose(kind: str) -> str:
    """Of a limit's or a set point's kind: whether any engine owes it, or one method alone."""
    return "physical" if kind == "physical" else "method-specific"


def limit(definition: SeriesDefinition) -> str:
    """The limit as a condition: ≤ 4.904 m, ≥ 10, 0.4999 … 0.5001."""
    unit = definition.unit
    if definition.limit is None:
        return "no limit"
    if isinstance(definition.limit, tuple):
        low, high = definition.limit
        return band((low, high), unit)
    sign = "≥" if definition.better == "larger" else "≤"
    return f"{sign}\N{NARROW NO-BREAK SPACE}{quantity(definition.limit, unit, 7)}"


def band(ends: tuple[float, float] | None, unit: str) -> str:
    """A band with enough digits that its ends differ: 0.4999 … 0.5001 m."""
    if ends is None:
        return "–"
    low, high = ends
    if low == high:
        return quantity(low, unit, 7)
    for digits in range(4, 16):
        if number(low, digits) != number(high, digits):
            break
    return f"{number(low, digits)} … {quantity(high, unit, digits)}"


@dataclass(frozen=True)
class Margin:
    """How far a value is from its limit: words, and the share of the limit used (above 1: broken)."""

    text: str
    share: float | None


def margin(definition: SeriesDefinition, value: float) -> Margin:
    """How far inside or outside its limit a value lies."""
    bound = definition.limit
    if bound is None:
        return Margin("–", None)
    if not math.isfinite(value):
        return Margin("no value", None)
    if isinstance(bound, tuple):
        centre, half = (bound[0] + bound[1]) / 2.0, (bound[1] - bound[0]) / 2.0
        used, allowed = abs(value - centre), half
    elif definition.better == "larger":
        used, allowed = bound, value
        if value <= 0.0 < bound or bound <= 0.0:
            return Margin("inside" if value >= bound else "outside", None)
    elif definition.better == "smaller":
        used, allowed = value, bound
        if value <= 0.0 or bound <= 0.0:
            return Margin("inside" if value <= bound else "outside", None)
    else:
        used, allowed = abs(value), bound
    if used == 0.0:
        return Margin("exact", 0.0)
    if allowed <= 0.0:
        return Margin("outside", None)
    share = used / allowed
    if share > 1.0:
        over = (
            f"{number(share, 3)} times the limit"
            if share >= 1.1
            else f"{number(100 * (share - 1), 2)} % over"
        )
        return Margin(over, share)
    if share < 1e-2:
        below = allowed / used
        times_below = "over a million" if below >= 1e6 else number(float(f"{below:.2g}"))
        return Margin(f"{times_below} times below the limit", share)
    return Margin(f"{number(100 * share, 3)} % of the limit", share)


def opening(text: str) -> str:
    """The text with a capital letter where it begins with a plain word; a formula stays as it is."""
    first = text.split(" ", 1)[0].rstrip(",:;").replace("'", "").replace("’", "")
    return text[:1].upper() + text[1:] if len(first) > 1 and first.isalpha() and first.islower() else text


def named(definition: SeriesDefinition) -> tuple[str, str]:
    """What a series is called, and, for a break point, what counts as stable (which follows in brackets)."""
    text = definition.description
    if definition.kind == "break_point" and text.endswith(")") and " (" in text:
        name, _, meaning = text[:-1].partition(" (")
        return opening(name), opening(meaning)
    return opening(text), ""


def conditions(definition: SeriesDefinition) -> str:
    """Configuration, parameters, and of a ladder's rung the time step: plain, N = 80, h = 0.0125 s."""
    named_values = [f"{key} = {number(value)}" for key, value in sorted(definition.parameters.items())]
    if definition.kind == "ladder" and definition.time_step is not None:
        named_values.append(f"h = {quantity(definition.time_step, 's')}")
    return ", ".join([definition.configuration, *named_values])


def slug(name: str) -> str:
    """A file name for any text: the name itself where that is safe, else its letters and eight hex digits."""
    if SLUG.fullmatch(name) and name not in RESERVED:
        return name
    letters = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40].strip("-")
    return f"{letters or 'x'}-{hashlib.sha256(name.encode('utf-8', 'replace')).hexdigest()[:8]}"


def version(engine: EngineVersion) -> str:
    """The version of an engine without the commit that follows the plus sign."""
    return clean(engine.version.partition("+")[0]) + (" (changed tree)" if engine.dirty else "")


def short_hash(engine: EngineVersion) -> str:
    """The first ten digits of the commit; empty for an engine without one."""
    return clean(engine.git_hash[:10])


def day(moment: str) -> str:
    """The day of an ISO 8601 moment in UTC: 2026-11-21; the text itself if it is no moment."""
    parsed = instant(moment)
    return parsed.strftime("%Y-%m-%d") if parsed else clean(moment)


def clock(moment: str) -> str:
    """Day and time of an ISO 8601 moment in UTC: 2026-11-21 03:17."""
    parsed = instant(moment)
    return parsed.strftime("%Y-%m-%d %H:%M") if parsed else clean(moment)


def instant(moment: str) -> datetime | None:
    """The moment in UTC, or None if the text is not ISO 8601."""
    try:
        parsed = datetime.fromisoformat(moment)
    except ValueError:
        return None
    return parsed.replace(tzinfo=UTC) if parsed.tzinfo is None else parsed.astimezone(UTC)


def commit_address(engine: EngineVersion, ci_address: str) -> str:
    """The page of the commit where the CI service is known to have one; empty otherwise."""
    found = GITHUB_RUN.fullmatch(ci_address)
    if not found or not re.fullmatch(r"[0-9a-f]{7,64}", engine.git_hash):
        return ""
    return f"{found[1]}/commit/{engine.git_hash}"


def web_address(address: str) -> str:
    """The address if it is a plain web address that may become a link; empty otherwise."""
    return address if re.fullmatch(r"https?://[^\s\"'<>\\]{1,500}", address) else ""
