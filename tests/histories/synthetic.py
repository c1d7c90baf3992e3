"""Run documents that no engine made: versions, a regression, NaN, hostile texts, for tests of the website."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import Any

import msgspec

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import (
    Curve,
    DrawnLink,
    DrawnSolid,
    EngineVersion,
    FigureData,
    Machine,
    MapData,
    RunDocument,
    Sample,
    SceneDrawing,
    SeriesDefinition,
    StageChoice,
    TestCard,
    Timing,
)
from spook_tracker.tracker.store.documents import DocumentHistory

HOSTILE = "<img src=x onerror=alert(1)></script><script>alert('x')</script> {{7*7}} %{x} =cmd() ../ \u202egnp.exe\x00 🚀"
START = datetime(2025, 10, 1, 3, 17, tzinfo=UTC)
STEPS = (0.1, 0.05, 0.025, 0.0125, 0.00625)
SEVEN = {  # name: title, unit, limit, values of plain and of its companion, question
    "beam": (
        "Beam on two piles",
        "%",
        4.9e-9,
        4.1e-16,
        "Do lock joints hold a beam of 80 boxes on two piles?",
    ),
    "door": ("Door on hinges", "%", 0.02, 0.009, "Does an overdetermined system carry its weight rightly?"),
    "falling_object": ("Falling object", "m", 4.904, 1.635, "How accurate is the integrator?"),
    "friction": (
        "Friction",
        "1",
        (0.4999, 0.5001),
        0.5 + 8e-14,
        "Is Coulomb’s law obeyed, in every direction?",
    ),
    "pendulum": ("Pendulum", "%", 0.004, 9.3e-4, "How well is a length kept?"),
    "n_pendulum": ("Chain of 26 spheres", "%", 16.0, 10.0, "Does a chain of 26 spheres hold?"),
    "planetarium": ("Planetarium", "%", 2.37, 9.84e-4, "Is the integrator stable for a long time?"),
}


def engine(night: int, name: str = "spook", text: str = "") -> EngineVersion:
    """One commit a night, each with the one before as its parent."""
    commit, parent = (hashlib.sha1(f"{name}{n}".encode()).hexdigest() for n in (night, night - 1))
    return EngineVersion(
        name=name, version=f"0.{1 + night // 10}.{night % 10}+g{commit[:8]}{text}", git_hash=commit, dirty=False,
        commit_time=(START + timedelta(days=night, hours=-5)).isoformat(), parents=(parent,) if night else (),
        compiler="g++ 12.2.0", flags="-O3 -ffp-contract=off",
    )  # fmt: skip


MACHINE = Machine(
    fingerprint="f3a9c1d2", processor="Example processor 2.4 GHz", cores=2, operating_system="Linux 6.1",
    float_environment="9ab3",
)  # fmt: skip


def series(test: str, metric: str, **changes: Any) -> SeriesDefinition:
    """A definition with everything that is not said filled in."""
    configuration, time_step = changes.get("configuration", "plain"), changes.get("time_step", 1.0 / 60.0)
    facts: dict[str, Any] = {
        "key": f"{test}/{configuration}/{metric}" + (f"/h={time_step:.6g}" if time_step else ""),
        "test": test, "title": test, "configuration": configuration, "metric": metric,
        "description": metric.replace("_", " "), "unit": "1", "role": "reported", "better": "smaller_magnitude",
        "kind": "scalar", "time_step": time_step, "parameters": {}, "limit": None, "limit_source": "",
        "set_point": None, "set_point_source": "", "reference": None, "tolerance": 0.0, "relative_tolerance": 1e-9,
        "test_version": "v1",
    }  # fmt: skip
    return SeriesDefinition(**(facts | changes))


def sample(definition: SeriesDefinition, value: float, **changes: Any) -> Sample:
    """A sample judged as the tracker would."""
    limit, outcome = definition.limit, "value"
    if not math.isfinite(value):
        outcome = "not_finite"
    elif isinstance(limit, tuple):
        outcome = "value" if limit[0] <= value <= limit[1] else "out_of_limit"
    elif limit is not None:
        outcome = "value" if abs(value) <= limit else "out_of_limit"
    band = definition.set_point
    facts: dict[str, Any] = {
        "series": definition.key, "value": Number(value), "outcome": outcome, "passed": outcome == "value",
        "set_point_held": math.isfinite(value) and (band is None or band[0] <= value <= band[1]),
        "counters": {"steps": 1320, "block_operations": 2640}, "state_hash": "a1b2",
    }  # fmt: skip
    return Sample(**(facts | changes))


def document(night: int, *, broken: int = 10**9, hostile: bool = False, name: str = "spook") -> RunDocument:
    """The run of one night. From night `broken` on friction is out of its limit and a ladder point is NaN."""
    pairs: list[tuple[SeriesDefinition, Sample]] = []
    for test, (_, unit, limit, value, _) in SEVEN.items():
        pairs += _scalars(test, unit, limit, value, night, broken)
        pairs += _ladder(test, unit, night, broken)
    if hostile:
        bad = series(
            HOSTILE, HOSTILE, unit="<b>m</b>", description=HOSTILE, role="gate", limit=1.0, title=HOSTILE
        )
        pairs.append((bad, sample(bad, 0.5, failure=HOSTILE)))
    moment = START + timedelta(days=night)
    return RunDocument(
        schema_version=1, id=f"run-{name}-{night:04d}", idempotency_key=f"key-{name}-{night}",
        started=moment.isoformat(), finished=(moment + timedelta(minutes=4)).isoformat(), trigger="nightly",
        tracker_version="0.1", ci_address="https://github.com/example/spook/actions/runs/17",
        engine=engine(night, name, HOSTILE[:90] if hostile else ""), machine=MACHINE,
        tests=tuple(_cards(hostile)), series=tuple(d for d, _ in pairs), samples=tuple(s for _, s in pairs),
        figures=tuple(_figures(hostile)), maps=tuple(_maps(night >= broken + 3)),
    )  # fmt: skip


def _scalars(test: str, unit: str, limit: Any, value: float, night: int, broken: int) -> list[Any]:
    gate = series(
        test, "deviation", unit=unit, role="gate", limit=limit, limit_source="thesis, section 4.2",
        better="inside" if isinstance(limit, tuple) else "smaller_magnitude", description=f"largest {test} deviation",
    )  # fmt: skip
    bad = test == "friction" and night >= broken
    measured = 0.5003 if bad else value * (1.0 + (2e-4 if night < 12 and test != "friction" else 0.0))
    tight = series(
        test, "energy_error", unit="%", role="companion", set_point=(0.0, 1e-3), configuration="half-step",
        set_point_source="theory: h² v²/4", description="largest relative energy error",
    )  # fmt: skip
    drift = 2e-3 if test == "door" and night >= broken else 4.2e-4
    loss = series(test, "energy_loss", unit="%", description="energy lost at the end of the run")
    point = series(
        test, "stability:largest-time-step", unit="s", kind="break_point", role="companion", better="larger",
        time_step=None, set_point=(0.05, 0.07), description="largest stable time step (energy, violation bounded)",
    )  # fmt: skip
    return [
        (gate, sample(gate, measured)),
        (tight, sample(tight, drift)),
        (loss, sample(loss, -0.35 - 1e-3 * (night // 16 if test == "beam" else 0))),
        (point, sample(point, 0.061 + 1e-4 * (night // 9))),
    ]


def _ladder(test: str, unit: str, night: int, broken: int) -> list[Any]:
    pairs = []
    for configuration, order in (("plain", 1.0), ("half-step", 2.0)):
        for h in STEPS:
            rung = series(
                test, "ladder:length", configuration=configuration, time_step=h, kind="ladder", unit=unit,
                description="largest error against the reference",
            )  # fmt: skip
            error = math.nan if night >= broken and h == 0.1 and test == "n_pendulum" else 0.3 * h**order
            noise = 1.0 + 0.01 * math.sin(7.0 * night + h)
            timing = Timing(
                seconds=(2e-6 / h * order * noise, 2.1e-6 / h * order),
                runs_per_repeat=10,
                stage_seconds={"solve_path": 3e-6 / h, "apply_gravity": 1e-6 / h},
            )
            steps = round(20.0 / h)
            counters = {"steps": steps, "block_operations": round(steps * 4 * order)}
            pairs.append((rung, sample(rung, error, timing=timing, counters=counters)))
        found = series(
            test, "ladder:length:order", configuration=configuration, time_step=None, kind="order", role="companion",
            better="inside", limit=(order - 0.1, order + 0.1), reference=order, description="observed order of accuracy",
        )  # fmt: skip
        pairs.append((found, sample(found, order + 0.01)))
        quick = series(
            test, "ladder:length:time-to-error", configuration=configuration, time_step=None, kind="time", unit="s",
            better="smaller", description="time to reach 0.001", parameters={"target_error": 1e-3},
        )  # fmt: skip
        pairs.append((quick, sample(quick, 4e-4 / order * (1.0 + 0.01 * math.sin(5.0 * night)))))
    return pairs


def _cards(hostile: bool) -> Iterable[TestCard]:
    for test, (title, _, _, _, question) in SEVEN.items():
        yield TestCard(
            name=test, title=title, question=question,
            why="A number that moves here moves in every scene built from the same parts, and cannot be seen by eye.",
            model="A sphere of 1 kg at the end of a massless rod of 1 m, released at 90°, for 22 s at h = 1/60 s.",
            parameters=(("mass", "1 kg"), ("length", "1 m"), ("gravity", "9.81 m/s²"), ("time step", "1/60 s")),
            theory=(
                "One linearised step lets the length grow by the second-order term of the motion.",
                "Δl/l = h² v² (1 + 2θ) / (4 l²)",
                "E(t) = ½ m v² + m g z",
            ),
            reference="Elliptic functions; the period is 2.36784194757624 s.",
            conclusion="Green: the length is kept as the method promises. Red: look at the constraint rows first.",
            source="thesis, section 3.5",
            misprints=("The thesis prints 0.004 %, while its Figs 3.20 and 3.24 show 0.4: the print is a ratio.",)
            if test == "pendulum" else (),
            seven=True,
            stages=(
                StageChoice(stage="collision", kept=False, reason="no two shapes can touch", saved_seconds_per_step=2e-8),
                StageChoice(stage="apply_gravity", kept=True, reason="gravity is not zero"),
                StageChoice(stage="solve_path", kept=True, reason="the constraints form a path"),
                StageChoice(stage="integrate_positions", kept=True, reason="bodies move"),
            ),
            scene=SceneDrawing(
                solids=(
                    DrawnSolid(kind="plane", position=(0.0, 0.0, -1.2), size=(0.0, 0.0, 1.0), fixed=True),
                    DrawnSolid(kind="box", position=(0.0, 0.0, 0.0), size=(1.0, 0.4, 0.3)),
                    DrawnSolid(kind="sphere", position=(1.0, 0.0, 0.0), size=(0.2,), velocity=(0.0, 0.0, 1.0)),
                ),
                links=(DrawnLink(kind="distance", ends=((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))),),
                gravity=(0.0, 0.0, -9.81),
            ),
        )  # fmt: skip
    if hostile:
        yield TestCard(
            name=HOSTILE, title=HOSTILE, question=HOSTILE, why=HOSTILE, model=HOSTILE,
            parameters=((HOSTILE, HOSTILE),), theory=(HOSTILE,), reference=HOSTILE, conclusion=HOSTILE,
            source=HOSTILE, misprints=(HOSTILE,), seven=False,
            stages=(StageChoice(stage=HOSTILE, kept=False, reason=HOSTILE),),
        )  # fmt: skip


def _figures(hostile: bool) -> Iterable[FigureData]:
    times = tuple(i / 20 for i in range(441))
    for test, (title, unit, *_) in SEVEN.items():
        wave = tuple(0.2 * (1 - math.cos(5.3 * t)) for t in times)
        yield FigureData(
            test=test, name="deviation-against-time", title=f"{title}: deviation against time", thesis="Fig 3.20",
            x_label="time [s]", y_label=f"deviation [{unit}]", x_scale="linear", y_scale="linear",
            note="The deviation follows the speed, as theory says.",
            curves=(
                Curve(name="measured", x=times, y=wave, style="line"),
                Curve(name="theory", x=times, y=tuple(1.02 * w for w in wave), style="reference"),
            ),
        )  # fmt: skip
        yield FigureData(
            test=test, name="deviation-against-step", title=f"{title}: deviation against time step", thesis="Fig 3.21",
            x_label="time step [s]", y_label=f"deviation [{unit}]", x_scale="log", y_scale="log", note="",
            curves=(Curve(name="plain", x=STEPS, y=tuple(map(Number, ("nan", *(0.4 * h * h for h in STEPS[1:-1]), 0.0))), style="both"),),
        )  # fmt: skip
    angles = tuple(float(a) for a in range(0, 361, 10))
    yield FigureData(
        test="friction", name="anisotropy", title="Force ratio in every direction", thesis="Fig 3.18",
        x_label="direction [°]", y_label="F_t/F_n", x_scale="angle", y_scale="linear", note="A circle is isotropic.",
        curves=(
            Curve(name="cone", x=angles, y=(0.5,) * 37, style="both"),
            Curve(name="box", x=angles, y=tuple(0.5 / max(abs(math.cos(math.radians(a))), abs(math.sin(math.radians(a)))) for a in angles), style="line"),
        ),
    )  # fmt: skip
    if hostile:
        yield FigureData(
            test=HOSTILE, name=HOSTILE, title=HOSTILE, thesis=HOSTILE, x_label=HOSTILE, y_label=HOSTILE,
            x_scale="linear", y_scale="linear", note=HOSTILE,
            curves=(Curve(name=HOSTILE, x=(0.0, 1.0), y=(0.0, Number("inf")), style="both"),) * 2,
        )  # fmt: skip


def _maps(worse: bool) -> Iterable[MapData]:
    x, y = tuple(0.25 * i for i in range(12)), tuple(10.0**-i for i in range(8))
    words = ("settled", "bounded", "growing", "diverged", "not_finite")
    yield MapData(
        test="pendulum", name="damping-compliance", title="Damping against compliance", configuration="plain",
        definition="settled: energy falls, the violation stays under 1e-3 m and everything is finite",
        x_label="tau/h", y_label="eps [1/kg]", x=x, y=y,
        cells=tuple(tuple(words[min(4, max(0, (j - i + worse) // 2 + 1))] for i in range(12)) for j in range(8)),
        prediction=tuple(tuple(1.0 + 0.1 * (j - i) for i in range(12)) for j in range(8)), note="Damping below one step grows.",
    )  # fmt: skip


def history(nights: int = 24, *, broken: int = 10**9, hostile: bool = False) -> DocumentHistory:
    """A history of that many nights."""
    return DocumentHistory(
        [document(n, broken=broken, hostile=hostile and n == nights - 1) for n in range(nights)]
    )


def rival(version: str, *, door: float = 0.5, machine: Machine = MACHINE, name: str = "rival") -> RunDocument:
    """Another engine on the same questions: quicker below an error of 1e-4, without friction, one door too heavy."""
    pairs: list[tuple[SeriesDefinition, Sample]] = []
    for test, (_, unit, limit, value, _) in SEVEN.items():
        for configuration, factor in (("rk4", 1.0), ("euler", 3.0)):
            gate = series(
                test, "deviation", unit=unit, limit=limit, configuration=configuration,
                better="inside" if isinstance(limit, tuple) else "smaller_magnitude",
            )  # fmt: skip
            if test == "friction":
                lacking = f"{name} ({configuration}) does not support friction"
                facts = {"outcome": "not_supported", "passed": False, "failure": lacking}
                pairs.append((gate, sample(gate, math.nan, **facts)))
            else:
                pairs.append((gate, sample(gate, factor * (door if test == "door" else value))))
        if test == "pendulum":
            for h in STEPS:
                rung = series(
                    test, "ladder:length", configuration="rk4", time_step=h, kind="ladder", unit=unit,
                    description="largest error against the reference",
                )  # fmt: skip
                timing = Timing(seconds=(2e-5 / h,), runs_per_repeat=10)
                pairs.append((rung, sample(rung, 0.3 * h**4, timing=timing)))
    found = document(0, name=name)
    return msgspec.structs.replace(
        found, id=f"run-{name}-{version}", idempotency_key=f"key-{name}-{version}", trigger="backfill", machine=machine,
        engine=msgspec.structs.replace(
            found.engine, version=version, git_hash="", commit_time="", parents=(), compiler="wheel", flags=""
        ),
        series=tuple(d for d, _ in pairs), samples=tuple(s for _, s in pairs), figures=(), maps=(), tests=(),
    )  # fmt: skip


def with_rival(found: DocumentHistory) -> DocumentHistory:
    """The same history and three releases of another engine, the last of which changed the door."""
    releases = [rival("3.1"), rival("3.2"), rival("3.3", door=0.0125)]
    return DocumentHistory([*found.documents.values(), *releases])


def of_test(run: RunDocument, test: str) -> RunDocument:
    """What a run says of one test."""
    keys = {s.key for s in run.series if s.test == test}
    return msgspec.structs.replace(
        run,
        series=tuple(s for s in run.series if s.key in keys),
        samples=tuple(s for s in run.samples if s.series in keys),
        tests=tuple(t for t in run.tests if t.name == test),
    )


def decade(nights: int = 3650, test: str = "") -> DocumentHistory:
    """Ten years of nights: the values of forty, again and again; of one test, or of all."""
    few = [of_test(document(n), test) if test else document(n) for n in range(40)]
    return DocumentHistory(
        [
            msgspec.structs.replace(
                few[n % 40],
                id=f"run-spook-{n:04d}",
                started=(START + timedelta(days=n)).isoformat(),
                engine=engine(n),
            )
            for n in range(nights)
        ]
    )


__all__ = ["DocumentHistory", "decade", "document", "history", "of_test", "rival", "with_rival"]
