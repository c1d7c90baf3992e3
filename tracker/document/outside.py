"""Text from outside on its way out: to terminals, to the logs of CI services, into JSON.

Names, units and failure texts come from other people's files. What a terminal or a log would obey instead of
showing is made visible; in JSON it is written as an escape, so that nothing is lost.
"""

from __future__ import annotations

import re
import unicodedata

INVISIBLE = {
    "Cc",
    "Cf",
    "Cs",
    "Co",
    "Zl",
    "Zp",
}  # control, direction, surrogate, private use, other ends of lines
UNSEEN = re.compile(
    "[\x7f-\x9f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\U000e0000-\U000e007f]"
)
COLOUR = re.compile("(\x1b\\[(?:0|1|2|3[0-7]|9[0-7])m)")  # what we write ourselves
# What a CI service would run: GitHub a line that begins with ::, and anywhere in a line ##[…, as Azure Pipelines
# does with ##vso[… and TeamCity with ##teamcity[…. Colours do not break it: they are taken out for a pipe.
COMMAND = re.compile(r"(?m)^((?:\s|\x1b\[\d+m)*)(?=:(?:\x1b\[\d+m)*:)")
MARK = re.compile(r"#((?:\x1b\[\d+m)*)#(?=(?:[\w.-]|\x1b\[\d+m)*\[)")


class _Seen(dict[int, str]):
    """What each character is shown as, remembered: most texts have a narrow space or a line's end."""

    def __missing__(self, code: int) -> str:
        hidden = unicodedata.category(chr(code)) in INVISIBLE and chr(code) not in "\n\t"
        return self.setdefault(code, "\N{REPLACEMENT CHARACTER}" if hidden else chr(code))


_SEEN = _Seen()


def clean(text: str) -> str:
    """Text from outside with what cannot be seen made visible: control and direction characters."""
    if text.isprintable():
        return text
    if text.replace("\n", "").replace("\N{NARROW NO-BREAK SPACE}", "").isprintable():
        return text  # most of what else is not printable to Python
    return text.translate(_SEEN)


def clean_text(text: str) -> str:
    """Text that every database and every JSON takes: NUL and lone surrogates become U+FFFD, all else stays as it is."""
    text = text.replace("\0", "\N{REPLACEMENT CHARACTER}")
    return (
        text if text.isascii() else text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")
    )


def inert(text: str) -> str:
    """Lines that a terminal only shows and no CI service runs; our own colours stay."""
    if not text.isprintable():
        lines = text.split("\n")  # most of many lines hold nothing that a colour or a trap needs
        text = "\n".join(line if line.isprintable() else _seen(line) for line in lines)
    return MARK.sub("#\\1#\N{REPLACEMENT CHARACTER}", COMMAND.sub("\\1\N{REPLACEMENT CHARACTER}", text))


def _seen(line: str) -> str:
    return "".join(part if COLOUR.fullmatch(part) else clean(part) for part in COLOUR.split(line))


def escaped(json: str) -> str:
    """The same JSON, with escapes for what cannot be seen, and for what a CI service would run where it is printed."""

    def escape(found: re.Match[str]) -> str:
        code = ord(found[0])
        if code < 0x10000:
            return f"\\u{code:04x}"
        code -= 0x10000
        return f"\\u{0xD800 + (code >> 10):04x}\\u{0xDC00 + (code & 0x3FF):04x}"

    seen = json if json.isascii() and "\x7f" not in json else UNSEEN.sub(escape, json)
    return MARK.sub(r"#\\u0023", seen) if "#" in seen else seen
