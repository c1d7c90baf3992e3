"""What cannot be simulated is refused with one sentence that names the culprit, before anything runs."""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
from collections.abc import Callable
from typing import Any

import pytest

from spook_tracker.engine import (
    WORLD,
    AngularMomentum,
    Ball,
    Box,
    Capsule,
    CentralGravity,
    Compound,
    ContactForce,
    ConvexHull,
    Distance,
    Energy,
    EngineError,
    Final,
    Hinge,
    JointCoordinate,
    JointSpring,
    Limit,
    Load,
    Lock,
    Material,
    Method,
    MethodError,
    Motor,
    Orientation,
    Part,
    Particle,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    Spring,
    Trace,
    Universal,
    Velocity,
    Violation,
    compile,
    simulate,
)
from spook_tracker.misuse import explain_misuse
from spook_tracker.scalar_tests.case import Metric

ORIGIN = (0.0, 0.0, 0.0)
A = Particle(name="a", mass=1.0, position=(1.0, 0.0, 0.0))
B = Particle(name="b", mass=1.0, position=(2.0, 0.0, 0.0))
STONE = RigidBody(name="stone", mass=1.0, shape=Sphere(0.1), position=(0.0, 0.0, 1.0))
WALL = RigidBody(name="wall", motion="static", shape=Box((1.0, 1.0, 1.0)), position=(0.0, 9.0, 0.0))


def particle(**changes: Any) -> Particle:
    return Particle(**{"name": "a", "mass": 1.0, "position": ORIGIN} | changes)


def rigid(**changes: Any) -> RigidBody:
    return RigidBody(**{"name": "stone", "mass": 1.0, "shape": Sphere(0.1), "position": ORIGIN} | changes)


def distance(**changes: Any) -> Distance:
    return Distance(**{"name": "rod", "between": ("a", "b")} | changes)


def hinge(**changes: Any) -> Hinge:
    return Hinge(**{"name": "pin", "between": (WORLD, "stone")} | changes)


def particles(*constraints: Any, forces: Any = (), bodies: Any = (A, B)) -> Scene:
    return Scene(bodies=bodies, constraints=constraints, forces=forces)


def stones(*constraints: Any, **changes: Any) -> Scene:
    return Scene(bodies=(STONE, WALL), constraints=constraints, **changes)


BAD = (math.nan, math.inf, -math.inf, "heavy", None)
SCENES: list[tuple[Callable[[], object], tuple[str, ...]]] = [
    *((lambda m=m: particle(mass=m), ("'a'", "mass")) for m in (*BAD, 0.0, -1.0)),
    *((lambda x=x: particle(position=(x, 0.0, 0.0)), ("'a'", "position")) for x in BAD),
    *((lambda x=x: particle(velocity=x), ("'a'", "velocity")) for x in ((1.0, 2.0), 3.0, (0.0, math.nan, 0.0))),
    *((lambda n=n: particle(name=n), ("name",)) for n in ("", " ", None, 3)),
    (lambda: particle(name=WORLD), ("'world'", "taken")),
    *((lambda m=m: rigid(mass=m), ("'stone'", "mass")) for m in (math.nan, 0.0, -2.0, None)),
    (lambda: rigid(shape="ball"), ("'stone'", "shape")),
    (lambda: rigid(shape=None), ("'stone'", "inertia")),
    (lambda: rigid(inertia=(1.0, 1.0, 3.0)), ("'stone'", "triangle")),
    *((lambda i=i: rigid(inertia=i), ("'stone'", "inertia")) for i in ((0.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (math.nan,) * 3)),
    (lambda: rigid(orientation=(0.0,) * 4), ("'stone'", "orientation")),
    (lambda: rigid(orientation=(1.0, 0.0, 0.0)), ("'stone'", "orientation")),
    (lambda: rigid(angular_velocity=(0.0, math.inf, 0.0)), ("'stone'", "angular_velocity")),
    (lambda: rigid(motion="flying"), ("'stone'", "motion")),
    (lambda: rigid(motion="static", velocity=(1.0, 0.0, 0.0)), ("'stone'", "static")),
    (lambda: rigid(shape=Plane()), ("'stone'", "plane")),
    (lambda: rigid(material="ice"), ("'stone'", "material")),
    (lambda: Sphere(0.0), ("sphere", "radius")),
    (lambda: Box((1.0, -1.0, 1.0)), ("box", "size")),
    (lambda: Capsule(0.1, math.nan), ("capsule", "length")),
    (lambda: Plane(ORIGIN), ("plane", "normal")),
    (lambda: Compound(()), ("compound",)),
    (lambda: Part(shape=Plane()), ("compound", "part")),
    (lambda: rigid(shape=Compound((Part(shape=Sphere(1.0), position=(1.0, 0.0, 0.0)),))), ("compound", "inertia")),
    (lambda: Material(friction=-0.1), ("material", "friction")),
    (lambda: Material(restitution=1.1), ("material", "restitution")),
    (lambda: Material(damping=math.nan), ("material", "damping")),
    *((lambda c=c: distance(compliance=c), ("'rod'", "compliance")) for c in (*BAD, -1e-9)),
    *((lambda d=d: distance(damping=d), ("'rod'", "damping")) for d in (math.nan, -1.0)),
    *((lambda r=r: distance(rest_length=r), ("'rod'", "rest_length")) for r in (0.0, -1.0, math.inf)),
    (lambda: distance(between=("a", "a")), ("'rod'", "itself")),
    (lambda: distance(between="ab"), ("'rod'", "two ends")),
    (lambda: distance(between=(ORIGIN, (1.0, 0.0, 0.0))), ("'rod'", "body")),
    (lambda: particles(distance(between=("a", "ghost"))), ("'rod'", "'ghost'")),
    (lambda: particles(distance(between=(A.position, "a"))), ("'rod'", "coincide")),
    (lambda: particles(distance(anchors=((0.1, 0.0, 0.0), ORIGIN))), ("'rod'", "'a'", "centre")),
    (lambda: particles(distance(), distance()), ("'rod'", "two constraints")),
    (lambda: particles(bodies=(A, A)), ("'a'", "two bodies")),
    (lambda: particles(bodies=()), ("at least one body",)),
    (lambda: particles(bodies=("a",)), ("'a'", "neither")),
    (lambda: particles("rod"), ("'rod'", "not a constraint")),
    (lambda: particles(forces=("wind",)), ("'wind'", "not a force")),
    (lambda: Scene(bodies=(A,), gravity=(0.0, 0.0, math.nan)), ("gravity",)),
    (lambda: Spring(name="s", between=("a", "b"), stiffness=-1.0), ("'s'", "stiffness")),
    (lambda: Spring(name="s", between=("a", "b"), stiffness=1.0, viscosity=math.nan), ("'s'", "viscosity")),
    (lambda: particles(forces=(Spring(name="s", between=("a", "ghost"), stiffness=1.0),)), ("'s'", "'ghost'")),
    (
        lambda: particles(forces=(Spring(name="s", between=(A.position, "a"), stiffness=1.0, rest_length=1.0),)),
        ("'s'", "coincide"),
    ),
    (lambda: CentralGravity(name="sun", strength=math.nan), ("'sun'", "strength")),
    (lambda: particles(forces=(CentralGravity(name="sun", strength=1.0, centre=A.position),)), ("'sun'", "'a'")),
    (lambda: Load(name="push", body="a", force=(math.inf, 0.0, 0.0)), ("'push'", "force")),
    (lambda: particles(forces=(Load(name="push", body="ghost"),)), ("'push'", "'ghost'")),
    (lambda: particles(forces=(Load(name="twist", body="a", torque=(1.0, 0.0, 0.0)),)), ("'twist'", "torque")),
    (lambda: particles(Ball(name="ball", between=("a", "b"))), ("'ball'", "'a'", "particle")),
    (lambda: stones(Lock(name="bolt", between=(WORLD, "ghost"))), ("'bolt'", "'ghost'")),
    (lambda: stones(Lock(name="bolt", between=(WORLD, "wall"))), ("'bolt'", "neither end can move")),
    (lambda: Lock(name="bolt", between=(ORIGIN, "stone")), ("'bolt'", "names")),
    (lambda: Lock(name="bolt", between=("stone", "stone")), ("'bolt'", "itself")),
    (lambda: Lock(name="bolt", between=(WORLD, "stone"), compliance=(1e-8, 1e-8)), ("'bolt'", "compliance", "6")),
    (lambda: Lock(name="bolt", between=(WORLD, "stone"), damping=-1.0), ("'bolt'", "damping")),
    (lambda: Lock(name="bolt", between=(WORLD, "stone"), at=(0.0, 0.0)), ("'bolt'", "at")),
    (lambda: hinge(axis=ORIGIN), ("'pin'", "axis")),
    (lambda: hinge(motor=3.0), ("'pin'", "motor")),
    (lambda: Prismatic(name="rail", between=(WORLD, "stone"), limit="end"), ("'rail'", "limit")),
    (lambda: Universal(name="cross", between=(WORLD, "stone"), axis=(1.0, 0.0, 0.0), cross_axis=(1.0, 1.0, 0.0)), ("'cross'", "normal")),
    (lambda: Motor(speed=math.nan), ("motor", "speed")),
    (lambda: Motor(speed=1.0, max_force=-1.0), ("motor", "max_force")),
    (lambda: Limit(lower=1.0, upper=0.0), ("limit", "lower")),
    (lambda: Limit(lower=math.nan, upper=0.0), ("limit", "lower")),
    (lambda: JointSpring(stiffness=0.0), ("spring", "stiffness")),
    (lambda: JointSpring(stiffness=1.0, rest=math.inf), ("spring", "rest")),
    (lambda: stones(no_contact=(("stone", "ghost"),)), ("no_contact", "'ghost'")),
    (lambda: stones(no_contact=("stone",)), ("no_contact", "pair")),
    (lambda: stones(no_contact=(5,)), ("no_contact", "pair", "5")),
    (lambda: stones(no_contact=(("stone", "stone"),)), ("no_contact", "'stone'", "itself")),
    (lambda: stones(contacts="no"), ("contacts", "'no'")),
    (lambda: stones(no_contact=5), ("no_contact", "sequence", "5")),
    (lambda: Scene(bodies=None), ("bodies", "sequence", "None")),
    (lambda: Scene(bodies=(A,), constraints=A), ("constraints", "sequence")),
    (lambda: particle(mass="1"), ("'a'", "mass", "number", "'1'")),
    (lambda: particle(mass=True), ("'a'", "mass", "number", "True")),
    (lambda: particle(mass=10**400), ("'a'", "mass", "too large")),
]  # fmt: skip


@pytest.mark.parametrize(("build", "words"), SCENES, ids=[" ".join(words) for _, words in SCENES])
def test_a_senseless_scene_is_refused_in_one_sentence(
    build: Callable[[], object], words: tuple[str, ...]
) -> None:
    with pytest.raises(SceneError) as refused:
        build()
    sentence = str(refused.value)

    assert all(word in sentence for word in words), sentence
    assert "\n" not in sentence and len(sentence) < 160
    assert isinstance(refused.value, EngineError) and isinstance(refused.value, ValueError)


def test_what_is_refused_is_shown_in_part_where_it_is_long() -> None:
    hull = ConvexHull.placed([(math.cos(k), math.sin(k), k % 3) for k in range(30)]).shape
    with pytest.raises(SceneError) as refused:
        Compound((Part(shape=Compound((Part(shape=hull), Part(shape=Box((1, 1, 1)))))),))
    sentence = str(refused.value)

    assert sentence.startswith("compound: a part must be a bounded shape and no compound, not Compound(")
    assert len(sentence) == 800 and " … " in sentence and sentence.endswith(")))")


METHODS: list[dict[str, Any]] = [
    {"corrections": 3},
    {"correction_cap": 0.0},
    {"correction_cap": math.nan},
    {"substeps": 0},
    {"substeps": 1.5},
    {"composition": "order5"},
    {"solver": "magic"},
    {"iterations": 0},
    {"iterations": 10**400},
    {"correction_cap": "0.3"},
    {"residual_tolerance": True},
    {"unsettled_residual": 10**400},
    {"residual_tolerance": math.nan},
    {"friction": "pyramid"},
    {"refinements": -1},
    {"floor": 1.0},
    {"floor": math.nan},
    {"force_stages": ("observe",)},
    {"force_stages": "rotation"},
    {"force_stages": 5},
    {"half_step_velocities": "no"},  # true, as Python reads it
    {"half_step_velocities": 1},
    {"string_stiffness": None},
    {"corrections": True},
    {"substeps": True},
    {"iterations": True},
    {"refinements": False},
    {"threads": 0},
    {"threads": 1.5},
]


@pytest.mark.parametrize("options", METHODS, ids=str)
def test_a_senseless_method_is_refused_by_name(options: dict[str, Any]) -> None:
    with pytest.raises(MethodError, match=r"|".join([*options, "observe"])):
        Method(**options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"runge_kutta": "order4"}, "runge_kutta must be none or order8"),
        ({"runge_kutta": "order8", "composition": "order4"}, "a composition or one of Runge-Kutta"),
        ({"tolerance": 1e-6}, "tolerance is of runge_kutta"),
        ({"runge_kutta": "order8", "tolerance": -1.0}, "tolerance must be from 0"),
        ({"runge_kutta": "order8", "sleep_speed": 0.1}, "leave runge_kutta at 'none'"),
        *(
            ({"sleep_speed": speed}, "sleep_speed must be a speed from 0")
            for speed in (-1.0, math.inf, math.nan)
        ),
        *(({"sleep_speed": speed}, "sleep_speed must be a number") for speed in (True, "slow")),
        *(({"sleep_after": after}, "sleep_after must be a time above 0") for after in (0.0, math.nan)),
        ({"sleep_speed": 0.1, "composition": "order4"}, "leave composition at 'none'"),
        ({"sleep_speed": 0.1, "half_step_velocities": True}, "leave half_step_velocities at False"),
        ({"sleep_speed": 0.1, "string_stiffness": True}, "leave string_stiffness at False"),
        ({"sleep_speed": 0.1, "corrections": 1}, "leave corrections at 0"),
    ],
)
def test_options_that_make_no_sense_together_are_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(MethodError, match=said):
        Method(**options)


@pytest.mark.parametrize("scene", [particles(), stones()], ids=["particles", "rigid"])
@pytest.mark.parametrize(
    "quantity", [Position("ghost"), Violation("ghost"), JointCoordinate("ghost")], ids=str
)
def test_observing_what_is_not_there_is_refused_by_name(scene: Scene, quantity: Any) -> None:
    with pytest.raises(MethodError, match=r"ghost|JointCoordinate"):
        compile(scene, time_step=0.01, observe={"x": Final(quantity=quantity)})


@pytest.mark.parametrize(
    ("quantity", "way_out"),
    [
        (Position("ston"), "no body named 'ston'; did you mean 'stone'?"),
        (Position("ghost"), "no body named 'ghost'; there are 'stone', 'wall'"),
        (ContactForce("stone", "ghost"), "no body named 'ghost'; there are 'stone', 'wall'"),
        (Violation("ghost"), "no constraint named 'ghost', nor any other"),
    ],
)
def test_observing_what_is_not_there_names_what_is(quantity: Any, way_out: str) -> None:
    with pytest.raises(MethodError, match=f"{re.escape(way_out)}$"):
        compile(stones(), time_step=0.01, observe={"x": Final(quantity=quantity)})


def test_of_many_bodies_the_first_are_named() -> None:
    heap = tuple(particle(name=f"ball {k}") for k in range(1000))
    with pytest.raises(SceneError, match=r"there are 'ball 0', .* 'ball 7' and 992 more$"):
        Scene(bodies=heap).body("ghost")


MISCALLED: tuple[tuple[Callable[..., object], tuple[object, ...], dict[str, object], str], ...] = (
    (Trace, (Position("stone"),), {}, "Trace takes its values by name: write Trace(quantity=…)"),
    (
        RigidBody,
        ("stone", 1.0),
        {},
        "RigidBody takes its values by name: write RigidBody(name=…, position=…)",
    ),
    (Scene, ((A, B),), {}, "Scene takes its values by name: write Scene(bodies=…)"),
    (Box, (0.2, 0.2, 0.2), {}, "Box takes them as one value, size: write Box((0.2, 0.2, 0.2))"),
    (Sphere, (0.2, 0.2, 0.2), {}, "Sphere takes radius, not 3 values"),
    (Sphere, (), {}, "Sphere needs radius: write Sphere(radius=…)"),
    (Sphere, (0.2,), {"radius": 0.2}, "Sphere is given 'radius' twice, by its place and by its name"),
    (Capsule, (0.2,), {}, "Capsule needs length: write Capsule(radius=…, length=…)"),
    (Material, (), {"frictoin": 0.5}, "Material has no 'frictoin'; did you mean 'friction'"),
    (Box, (), {"edges": (1.0, 1.0, 1.0)}, "Box has no 'edges'; there is 'size'"),
    (Energy, ("stone",), {}, "Energy takes no values: write Energy()"),
    (Energy, (), {"body": "stone"}, "Energy takes no values: write Energy()"),
    (Position, ("stone", "wall", ORIGIN), {}, "Position takes body and point, not 3 values"),
    (Metric, (), {"limits": 1.0}, "Metric has no 'limits'; did you mean 'limit'"),
)


@pytest.mark.parametrize(("make", "given", "named", "sentence"), MISCALLED)
def test_a_class_called_wrongly_says_how_it_is_called(
    make: Callable[..., object], given: tuple[object, ...], named: dict[str, object], sentence: str
) -> None:
    with pytest.raises(TypeError) as caught:
        make(*given, **named)
    assert str(caught.value).startswith(sentence)


def test_a_class_still_shows_its_fields_and_what_fails_within_it() -> None:
    assert str(inspect.signature(Box)) == "(size: 'Vector') -> None"

    @dataclasses.dataclass
    class Broken:
        width: float

        def __post_init__(self) -> None:
            len(self.width)  # type: ignore[arg-type]

    explain_misuse([Broken])
    with pytest.raises(TypeError, match="has no len"):
        Broken(1.0)


def test_observe_must_be_a_mapping_and_quantities_numbers() -> None:
    for scene in (particles(), stones()):
        with pytest.raises(MethodError, match=r"observe must map names.*not 5"):
            compile(scene, time_step=0.01, observe=5)  # type: ignore[arg-type]
        with pytest.raises(MethodError, match=r"observe must map names.*5 is not a name"):
            compile(scene, time_step=0.01, observe={5: Final(quantity=Position())})  # type: ignore[dict-item]
    for point in (math.nan, (0.0, math.nan, 0.0), ("x", 0.0, 0.0)):
        with pytest.raises(MethodError, match="observe: about"):
            AngularMomentum(about=point)  # type: ignore[arg-type]
    for make in (Position, Velocity):
        with pytest.raises(MethodError, match="observe: point"):
            make("stone", point=(math.nan, 0.0, 0.0))
        with pytest.raises(MethodError, match="a point of all bodies"):
            make(point=(1.0, 0.0, 0.0))
        with pytest.raises(MethodError, match="a point of a particle"):
            compile(
                particles(), time_step=0.01, observe={"x": Final(quantity=make("a", point=(1.0, 0.0, 0.0)))}
            )
    for too_large in ({"time_step": 10**400, "steps": 1}, {"time_step": 0.01, "duration": 10**400}):
        with pytest.raises(MethodError, match="too large for arithmetic"):
            simulate(particles(), **too_large)  # type: ignore[arg-type]
    with pytest.raises(MethodError, match="duration must be a number of seconds, not '1'"):
        simulate(particles(), time_step=0.01, duration="1")  # type: ignore[arg-type]


def test_a_range_of_samples_must_be_one() -> None:
    for make in (
        lambda: Final(quantity=Orientation(), first=0.5),  # type: ignore[arg-type]
        lambda: Final(quantity=Orientation(), last=True),
        lambda: Final(quantity=Orientation(), first=-1),
        lambda: Final(quantity=Orientation(), first=3, last=2),
        lambda: Trace(quantity=Orientation(), every=0),
        lambda: Final(quantity="position"),  # type: ignore[arg-type]
    ):
        with pytest.raises(MethodError, match="observe"):
            make()


@pytest.mark.parametrize(
    ("former", "words"),
    [
        ({"solver": "hybrid"}, '"hybrid" is gone, and solved as "direct"'),
        ({"threads": 2}, "one thread does the work"),
    ],
)
def test_a_former_option_does_what_is_done_now_and_says_so(former: dict[str, Any], words: str) -> None:
    with pytest.warns(DeprecationWarning, match=words):
        assert Method(**former) == Method()
