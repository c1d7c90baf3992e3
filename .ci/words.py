"""The native side is told in the field's words: which retired ones its code, comments and tests still hold.

    python .ci/words.py [FOLDER]

Text in quotes is left alone: names that results and methods have had for long are kept. Exit code 1 if some are found.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

# What is not to be written, and what is: where a word had several meanings, each of them.
RETIRED = {
    r"[Ss]weep\w*|[Ss]wept|\w+_(sweep|swept)\w*": "iteration of projected Gauss-Seidel (PGS); shape cast; pass",
    r"[Ss]trikes?|[Ss]truck|\w+_strikes?\w*": "impact; time of impact (toi)",
    r"[Bb]lows?|\w+_blows?\w*": "impact",
    r"[Ss]eams?|\w+_seams?\w*": "internal edge",
    r"[Pp]artings?|\w+_parting\w*": "position projection; rate of separation",
    r"[Ll]aps?|laps?_": "penetration record",
    r"[Rr]ous(e|es|ed|ing)": "wake",
    r"keeps?_off|let_pass|let past": "occludes; skipped",
    r"whole_fall|let_go|foresee\w*|unheld|fundable|free_ties": "see the glossary in ARCHITECTURE.md",
    r"[Hh](ang|angs|ung) together": "are connected",
    r"he|him|his|she|[Ww]ho|whom|[Nn]obody|[Ss]omebody|[Aa]nybody|[Ee]verybody|[Aa]nyone|[Ee]veryone": "it; which body; none",
}
PATTERN = re.compile("|".join(rf"\b(?:{words})\b" for words in RETIRED))
QUOTED = re.compile(r'"(?:\\.|[^"\\\n])*"')


def said_instead(word: str) -> str:
    return next(say for words, say in RETIRED.items() if re.fullmatch(words, word))


def found(folder: Path) -> list[str]:
    """Each place with a retired word, and what to say instead."""
    files = sorted(path for path in folder.rglob("*") if path.suffix in (".cpp", ".hpp", ".inl"))
    return [
        f'{path}:{number}: "{word.group()}": say {said_instead(word.group())}'
        for path in files
        for number, line in enumerate(path.read_text().splitlines(), 1)
        for word in PATTERN.finditer(QUOTED.sub('""', line))
    ]


if __name__ == "__main__":
    places = found(Path(sys.argv[1] if len(sys.argv) > 1 else "engine/native"))
    print("\n".join(places), end="\n" if places else "")
    sys.exit(1 if places else 0)
