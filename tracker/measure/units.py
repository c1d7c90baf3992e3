"""Units as other tools write them, brought to one: s, B, or something per second; and which way is better."""

from __future__ import annotations

from typing import Literal

import msgspec

SECONDS = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ms": 1e-3, "min": 60.0}  # s
SECONDS |= {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9, "minutes": 60.0, "hours": 3600.0}
SECONDS |= {"msec": 1e-3, "usec": 1e-6, "nsec": 1e-9}
SECONDS |= dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0)
BYTES = {"b": 1.0, "byte": 1.0, "bytes": 1.0}  # B
BYTES |= {f"{letter}b": 1e3**power for power, letter in enumerate("kmgt", 1)}
BYTES |= {f"{letter}ib": 1024.0**power for power, letter in enumerate("kmgt", 1)}
RATES = {
    "fps": "frames/s",
    "hz": "1/s",
    "khz": "1/ms",
    "mhz": "1/us",
    "qps": "queries/s",
    "rps": "requests/s",
}
RATES |= {f"{size}flops": f"{size}flop/s" for size in ("", "k", "m", "g", "t")}
PHYSICAL = (
    "m",
    "mm",
    "rad",
    "deg",
    "J",
    "N",
    "kg",
)  # per second a velocity, a power, a flow: no rate of work


class Unit(msgspec.Struct, frozen=True):
    """What a value is in after it was multiplied by `scale`."""

    name: str
    scale: float = 1.0
    better: Literal["smaller", "larger"] = "smaller"


def unit_of(text: str) -> Unit:
    """`us/iter` is s, `KB` is B, `ops/ms` is ops/s, larger is better; an unknown unit stays, smaller is better."""
    text = RATES.get(text.strip().lower(), text)
    above, _, below = (part.strip() for part in text.partition("/"))
    if (scale := SECONDS.get(above.lower())) is not None:
        return Unit("s", scale)
    size = BYTES.get(above.lower())
    if below.lower() in SECONDS and above and above not in PHYSICAL:
        name = "B" if size is not None else above
        return Unit(f"{name}/s", (size or 1.0) / SECONDS[below.lower()], "larger")
    return Unit("B", size) if size is not None else Unit(text or "1")
