"""A bench that misses a limit ends with exit code 1, alone and among others; each of them has one."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from bench import bench_growth, bench_months
from tests.places import ROOT

BENCHES = sorted((ROOT / "bench").glob("bench_*.py"))
KEEPS = "print('kept')\n"
MISSES = "print('NOT KEPT')\nraise SystemExit(1)\n"


def run(folder: Path, benches: dict[str, str], *asked: str) -> subprocess.CompletedProcess[str]:
    """`make bench` of another folder."""
    shutil.copy(ROOT / "bench" / "run.py", folder)
    for name, text in benches.items():
        (folder / f"bench_{name}.py").write_text(text)
    return subprocess.run(
        [sys.executable, str(folder / "run.py"), *asked], capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize(
    ("benches", "code"),
    [
        ({"a": KEEPS, "b": KEEPS}, 0),
        ({"a": MISSES, "b": KEEPS}, 1),
        ({"a": KEEPS, "b": MISSES}, 1),
        ({"a": "raise SystemExit('above the limit')\n"}, 1),
        ({"a": "raise RuntimeError('not even measured')\n"}, 1),
        ({"a": "raise SystemExit(0)\n"}, 0),
    ],
)
def test_a_missed_limit_is_the_exit_code_of_all(tmp_path: Path, benches: dict[str, str], code: int) -> None:
    assert run(tmp_path, benches).returncode == code


def test_those_after_a_missed_limit_run_all_the_same_and_it_is_named(tmp_path: Path) -> None:
    done = run(tmp_path, {"a": MISSES, "b": KEEPS, "c": MISSES})

    assert done.stdout.index("== b ==") < done.stdout.index("kept", done.stdout.index("== b =="))
    assert "limits missed in: a, c" in done.stderr


def test_a_bench_reads_none_of_the_names_as_its_own_arguments(tmp_path: Path) -> None:
    reads = "import argparse\nargparse.ArgumentParser().parse_args()\n"

    assert run(tmp_path, {"a": reads, "b": reads}, "a", "b").returncode == 0


def test_what_takes_minutes_answers_last(tmp_path: Path) -> None:
    done = run(tmp_path, dict.fromkeys(("growth", "storage"), KEEPS))

    assert done.stdout.index("== storage ==") < done.stdout.index("== growth ==")


def test_only_those_named_run(tmp_path: Path) -> None:
    benches = {"a": MISSES, "b": KEEPS}

    assert run(tmp_path, benches, "b").returncode == 0
    assert run(tmp_path, benches, "d").returncode == 2


@pytest.mark.parametrize("bench", BENCHES, ids=lambda path: path.stem)
def test_every_bench_has_a_limit_to_miss(bench: Path) -> None:
    said = bench.read_text()

    assert re.search(r"raise SystemExit\(1\)|sys\.exit\(f?\"|return 1\b|1 if |0 if ", said), (
        "it can only succeed"
    )


def test_benches_run_every_week() -> None:
    weekly = yaml.safe_load((ROOT / ".github" / "workflows" / "weekly.yml").read_text())

    assert {"bench", "bench-heaps", "heaps"} <= set(weekly["jobs"]["heavy"]["strategy"]["matrix"]["target"])


def test_what_grows_faster_than_its_history_is_missed() -> None:
    sizes = (10**5, 10**6, 10**7)

    def grown(power: float, night: float = 1.0) -> list[str]:
        return bench_growth.missed(
            "SQLite",
            [
                bench_growth.Measured(
                    samples=n,
                    size=10**6,
                    seconds={
                        "one night in": night if n == sizes[-1] else 1.0,
                        "the website": 1.0 + (n / 1e5) ** power,
                    },
                )
                for n in sizes
            ],
        )

    assert grown(1.0) == []
    assert len(grown(1.6)) == 1 and "the website" in grown(1.6)[0]
    assert len(grown(1.0, night=2.0)) == 1 and "one night in" in grown(1.0, night=2.0)[0]


def test_a_month_that_costs_as_much_as_the_year_is_missed(capsys: pytest.CaptureFixture[str]) -> None:
    assert not bench_months.missed({"again": (0.07, bench_months.AGAIN)})
    assert bench_months.missed({"again": (1.0, bench_months.AGAIN), "small": (0.0, 1.0)})
    assert bench_months.missed({"again": (float("nan"), 1.0)})
    assert capsys.readouterr().out.count("MISSED") == 2
