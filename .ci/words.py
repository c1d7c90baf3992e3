"""The project is told in the field's words: which retired ones are still written.

    python .ci/words.py [FOLDER]

PERSONS are looked for in every text that is written here, in names and in quotes as well, RETIRED in C++ alone. There
text in quotes is left alone: names that results and methods have had for long are kept. Exit code 1 if some are found.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

# What is not to be written, and what is: where a word had several meanings, each of them.
RETIRED = {
    r"[Ss]weep\w*|[Ss]wept|\w+_(sweep|swept)\w*": "iteration of projected Gauss-Seidel (PGS); shape cast; pass",
    r"[Ss]trikes?|[Ss]truck|\w+_strikes?\w*": "impact; time of impact (toi)",
    r"[Bb]lows?|\w+_blows?\w*": "impact",
    r"[Ss]eams?|\w+_seams?\w*": "internal edge",
    r"[Pp]artings?|\w+_parting\w*": "position projection; rate of separation",
    r"Parting[A-Z]\w*|parting_\w+": "separating axis",
    r"[Ll]aps?|laps?_": "penetration record",
    r"[Rr]ous(e|es|ed|ing)": "wake",
    r"keeps?_off|let_pass|let past": "occludes; skipped",
    r"whole_fall|let_go|foresee\w*|unheld|fundable|free_ties": "see the glossary in ARCHITECTURE.md",
    r"[Hh](ang|angs|ung) together": "are connected",
    r"[Ww]ho": "it; which body; none",
}
PATTERN = re.compile("|".join(rf"\b(?:{words})\b" for words in RETIRED))
QUOTED = re.compile(r'"(?:\\.|[^"\\\n])*"')
PERSONS = re.compile(
    r"(?<![a-z])(?:(?:no|some|any|every)body|(?:some|any|every)one|who(?:ever|m))\w*|\b(?:s?h[e]|h(?:im|is|ers?))\b",
    re.IGNORECASE,
)
INSTEAD = "it; which; none; no test; any reader; people"
NATIVE = {".cpp", ".hpp", ".inl"}
# Not written here: licences, libraries in one line, what a fuzzer found.
OTHERS = re.compile(r"LICENSE|\.min\.|tests/fuzz/\w+/|fuzz/corpus/")


def said_instead(word: str) -> str:
    return next(say for words, say in RETIRED.items() if re.fullmatch(words, word))


def listed(folder: Path) -> list[Path]:
    """Its files that are written here: in a clone of those that git has or would take, else of all."""
    ask = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(ask, cwd=folder, capture_output=True, text=True, check=False)
    inside = (str(path.relative_to(folder)) for path in folder.rglob("*"))
    names = done.stdout.split("\0") if done.returncode == 0 else inside
    paths = (folder / name for name in names if not OTHERS.search(name.replace("\\", "/")))
    return sorted(path for path in paths if path.is_file() and not path.is_symlink())


def text_of(path: Path) -> str:
    """What is written there; empty for pictures and other bytes."""
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return ""


def found(folder: Path) -> list[str]:
    """Each place with a retired word, and what to say instead."""
    places = []
    for path in listed(folder):
        for number, line in enumerate(text_of(path).splitlines(), 1):
            native = PATTERN.finditer(QUOTED.sub('""', line)) if path.suffix in NATIVE else ()
            words = [(word.group(), said_instead(word.group())) for word in native]
            words += [(word.group(), INSTEAD) for word in PERSONS.finditer(line)]
            places += [f'{path}:{number}: "{word}": say {instead}' for word, instead in words]
    return places


if __name__ == "__main__":
    places = found(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
    print("\n".join(places), end="\n" if places else "")
    sys.exit(1 if places else 0)
