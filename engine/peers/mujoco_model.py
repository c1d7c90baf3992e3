"""A scene as MuJoCo's XML: joint coordinates where the joints make a tree, equality constraints elsewhere."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ..bodies import WORLD, Material, Particle, RigidBody
from ..couplings import Relation, Wire
from ..forces import End, Spring
from ..joints import (
    AxialJoint,
    Ball,
    Constraint,
    Distance,
    Hinge,
    Joint,
    Lock,
    Prismatic,
    Universal,
    frictions,
)
from ..protocol import NotSupported
from ..recorded_joints import conjugate, joint_point, product, turned_back
from ..result import Array
from ..scene import Scene
from ..shapes import Box, Capsule, Compound, Cylinder, Plane, Shape, Sphere
from .joint_tree import (
    UPRIGHT,
    Node,
    alone,
    fixed,
    grown,
    plane_of_motion,
    rod_axes,
    turn_of,
)

POINT_INERTIA = 1e-12  # kg m²: MuJoCo wants one of every moving body; a point mass has none
UNBOUNDED = 1e10  # N or N m
HALF_HINGE = 0.5  # m from a hinge to each of the two points that hold it as equalities


@dataclass(frozen=True)
class Model:
    """The XML, and which constraint became what."""

    xml: str
    tree: Mapping[str, str]  # constraint -> the body it ties to its parent
    equalities: Mapping[str, tuple[int, ...]]  # constraint -> its equalities
    point_bodies: tuple[str, ...]
    speeds: Mapping[str, float] = field(default_factory=dict)  # of motors, by their tendons, rad/s or m/s
    wires: Mapping[str, int] = field(default_factory=dict)  # those that may go slack -> their tendons


def numbers(values: Iterable[float]) -> str:
    """As XML wants them, exact."""
    return '"' + " ".join(repr(float(value)) for value in values) + '"'


def model(
    scene: Scene, *, joint_coordinates: bool, option: str, row: str, hard: str = "", damping: float = 0.0
) -> Model:
    """The whole model; `option` and `row`, how stiff what holds and touches is, are XML attributes of the configuration, and
    so is `hard`, how stiff motors are; `damping` [s] is that of springs in joints that state none."""
    nodes = grown(scene) if joint_coordinates else alone(scene)
    return _Writer(scene, nodes, row, hard, damping).write(option)


class _Writer:
    def __init__(self, scene: Scene, nodes: dict[str, Node], row: str, hard: str, damping: float) -> None:
        self.scene, self.nodes, self.row, self.hard, self.damping = scene, nodes, row, hard, damping
        self.normal = plane_of_motion(scene)
        self.tree = {node.tie.name: name for name, node in nodes.items() if node.tie is not None}
        self.equalities: dict[str, tuple[int, ...]] = {}
        self.equality_lines: list[str] = []
        self.tendon_lines: list[str] = []
        self.speeds: dict[str, float] = {}
        self.wires: dict[str, int] = {}
        self.world_sites: list[str] = []
        self.sites: dict[str, list[str]] = {name: [] for name in nodes}
        self._refuse_what_moves()
        materials = {
            b.material.friction for b in scene.bodies if isinstance(b, RigidBody) and b.shape is not None
        }
        self.one_friction = len(materials) <= 1
        if not self.one_friction and len(scene.bodies) > 50:
            raise NotSupported(
                "our adapter cannot ask mujoco for surfaces of different friction among more than 50 bodies"
            )
        if not self.one_friction and any(_is_compound(body) for body in scene.bodies):
            raise NotSupported(
                "our adapter cannot ask mujoco for a compound among surfaces of different friction"
            )

    def _refuse_what_moves(self) -> None:
        """Kinematic bodies stand still here but for their surfaces: nothing may hang on one."""
        scene = self.scene
        held = {end for one in (*scene.constraints, *scene.forces) for end in getattr(one, "between", ())}
        held |= {end for one in scene.constraints if isinstance(one, Wire) for end, _ in one.through}
        for body in scene.bodies:
            if not isinstance(body, RigidBody) or body.motion != "kinematic":
                continue
            moves = any(body.velocity) or any(body.angular_velocity)
            if moves and (body.name in held or body.shape is None):
                raise NotSupported(
                    f"our adapter cannot ask mujoco for the kinematic {body.name!r}, only for planes that move in themselves "
                    "and that nothing is tied to"
                )

    def write(self, option: str) -> Model:
        for constraint in self.scene.constraints:
            if constraint.name not in self.tree:
                self._hold(constraint)
        for force in self.scene.forces:
            if isinstance(force, Spring):
                self._spring(force)
        lines: list[str] = []
        for name, node in self.nodes.items():
            if node.parent in (None, WORLD):
                self._branch(name, lines)
        contact = self._contacts()
        flag = "" if self.scene.contacts else '<flag contact="disable"/>'
        xml = "\n".join(
            [
                '<mujoco><compiler angle="radian" autolimits="true"/>',
                f'<size memory="200M"/><option gravity={numbers(self.scene.gravity)} {option}>{flag}</option>',
                "<worldbody>",
                *self.world_sites,
                *lines,
                "</worldbody>",
                f"<tendon>{''.join(self.tendon_lines)}</tendon>" if self.tendon_lines else "",
                f"<equality>{''.join(self.equality_lines)}</equality>" if self.equality_lines else "",
                f"<contact>{contact}</contact>" if contact else "",
                "</mujoco>",
            ]
        )
        points = tuple(b.name for b in self.scene.bodies if isinstance(b, Particle))
        return Model(xml, self.tree, self.equalities, points, self.speeds, self.wires)

    def _branch(self, top: str, lines: list[str]) -> None:
        """A body with all that hangs from it, without recursion: chains may be long."""
        stack: list[tuple[str, bool]] = [(top, False)]
        while stack:
            name, closing = stack.pop()
            if closing:
                lines.append("</body>")
                continue
            lines.append(self._body(self.nodes[name]))
            stack.append((name, True))
            stack += [(child, False) for child in reversed(self.nodes[name].children)]

    def _frame(self, name: str | None) -> tuple[Array, Array]:
        """Where a body's frame is at the start."""
        if name is None or name == WORLD:
            return np.zeros(3), UPRIGHT
        body = self.nodes[name].body
        return np.array(body.position), turn_of(body)

    def _body(self, node: Node) -> str:
        body = node.body
        place, turn = self._frame(body.name)
        above, above_turn = self._frame(node.parent)
        at, q = turned_back(above_turn, place - above), product(conjugate(above_turn), turn)
        text = f"<body name={quoteattr(body.name)} pos={numbers(at)} quat={numbers(q)}>"
        if not fixed(body):
            inertia = (POINT_INERTIA,) * 3 if isinstance(body, Particle) else body.inertia
            assert inertia is not None and body.mass is not None
            text += self._joints(node, place, turn)
            text += f'<inertial pos="0 0 0" mass="{body.mass!r}" diaginertia={numbers(inertia)}/>'
        if isinstance(body, RigidBody) and body.shape is not None:
            text += self._geom(body)
        return text + "".join(self.sites[body.name])

    def _joints(self, node: Node, place: Array, turn: Array) -> str:
        if node.tie is None:
            if isinstance(node.body, RigidBody):
                return "<freejoint/>"
            return "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
        tie, second = node.tie, node.tie.between[1] == node.body.name
        if isinstance(tie, Distance):
            anchor = np.array(self.scene.anchor(tie, 0 if second else 1))
            axes, kind, at = rod_axes(anchor - place, self.normal), "hinge", anchor
        else:
            assert isinstance(tie, Joint)
            at = joint_point(self.scene, tie)
            kind = "slide" if isinstance(tie, Prismatic) else "ball" if isinstance(tie, Ball) else "hinge"
            if isinstance(tie, Lock):
                return ""
            if isinstance(tie, Ball):
                axes = [np.array([0.0, 0.0, 1.0])]
            elif isinstance(tie, Universal):
                axes = [np.array(tie.axis), np.array(tie.cross_axis)]
                axes = axes if second else axes[::-1]
            else:
                assert isinstance(tie, Hinge | Prismatic)
                axes = [np.array(tie.axis)]
        where = numbers(turned_back(turn, at - place))
        name = held = ""
        if isinstance(tie, AxialJoint):
            name = f" name={quoteattr(tie.name)}"
            self._motor(tie, 1.0 if second else -1.0)
            held = self._held(tie, 1.0 if second else -1.0)
        return "".join(
            f'<joint{name} type="{kind}" pos={where} axis={numbers(turned_back(turn, axis))} '
            f"{self._loss(tie)}{_armature(tie)}{held}/>"
            for axis in axes
        )

    def _motor(self, tie: AxialJoint, sign: float) -> None:
        """Dry friction of the joint as a tendon's, a row of bounded force, which the run lets hold a speed in place of none."""
        motor = tie.motor
        if motor is None or motor.max_force == 0.0:
            return
        most = UNBOUNDED if motor.max_force is None else float(motor.max_force)  # type: ignore[arg-type]
        name = f"{tie.name}/motor"
        self.tendon_lines.append(
            f'<fixed name={quoteattr(name)} frictionloss="{most!r}" {_of_friction(self.hard)}>'
            f'<joint joint={quoteattr(tie.name)} coef="{sign!r}"/></fixed>'
        )
        self.speeds[name] = float(motor.speed)  # type: ignore[arg-type]

    def _held(self, tie: AxialJoint, sign: float) -> str:
        """Stops, as stiff as everything else, and a spring; of a joint that is written the other way round with `sign` −1."""
        text = ""
        if tie.limit is not None:
            ends = sorted((sign * tie.limit.lower, sign * tie.limit.upper))
            stiff = self.row.replace("solref", "solreflimit").replace("solimp", "solimplimit")
            text += f" range={numbers(ends)} {stiff}"
        if tie.spring is not None:
            size, rest = tie.spring.stiffness, sign * float(tie.spring.rest)  # type: ignore[arg-type]
            lag = self.damping if tie.spring.damping is None else tie.spring.damping
            text += f' stiffness="{size!r}" springref="{rest!r}" damping="{size * lag!r}"'
        return text

    def _loss(self, tie: Constraint) -> str:
        """Dry friction of a slide [N] or a hinge [N m], as stiff as everything else."""
        size = max(frictions(tie)[0])
        return f'frictionloss="{size!r}" {_of_friction(self.row)}' if size else ""

    def _geom(self, body: RigidBody) -> str:
        assert body.shape is not None
        parts: list[tuple[Shape, Any, Any]] = [(body.shape, (0.0, 0.0, 0.0), UPRIGHT)]
        if isinstance(body.shape, Compound):
            parts = [(part.shape, part.position, np.array(part.orientation)) for part in body.shape.parts]
        along, about = self._flow(body)
        text = ""
        for k, (shape, at, turn) in enumerate(parts):
            kind, size, q = _surface(shape)
            name, axes, belt = quoteattr(body.name if k == 0 else f"{body.name}/{k}"), product(turn, q), ""
            if along.any() or about.any():
                flow = (*turned_back(axes, along), *turned_back(axes, about))
                belt = f" surfacevel={numbers(flow)}"
            text += (
                f'<geom name={name} type="{kind}" size={numbers(size)} pos={numbers(at)} '
                f'quat={numbers(axes)} mass="0" '
                f"{_friction(body.material.friction, body.material)} {self.row}{belt}/>"
            )
        return text

    def _flow(self, body: RigidBody) -> tuple[Array, Array]:
        """How its surface moves along itself and turns, in its axes: as a belt, or as a plane that slides and turns in itself."""
        along, about = np.array(body.surface_velocity), np.zeros(3)
        if body.motion != "kinematic":
            return along, about
        turn = turn_of(body)
        moved, about = (turned_back(turn, np.array(v)) for v in (body.velocity, body.angular_velocity))
        normal = np.array(body.shape.normal) if isinstance(body.shape, Plane) else np.zeros(3)
        leaves = abs(moved @ normal) + float(np.linalg.norm(np.cross(about, normal)))
        if not normal.any() or leaves > 1e-12 * float(np.linalg.norm(moved) + np.linalg.norm(about)):
            raise NotSupported(
                f"our adapter cannot ask mujoco for the kinematic {body.name!r}, only for planes that move in themselves"
            )
        along = along + moved
        if along.any() and about.any():
            raise NotSupported(
                f"our adapter cannot ask mujoco for the kinematic {body.name!r}, which turns about a place that moves, or takes along "
                "in a direction that turns"
            )
        return along, about

    def _site(self, end: str | None, point: Array, name: str) -> str:
        """A named point of a body, or of the world, given where it is at the start."""
        place, turn = self._frame(end)
        site = f"<site name={quoteattr(name)} pos={numbers(turned_back(turn, point - place))}/>"
        (self.world_sites if end is None else self.sites[end]).append(site)
        return name

    def _tendon(self, name: str, through: Sequence[tuple[End, Array]], attributes: str) -> None:
        sites = "".join(
            f"<site site={quoteattr(self._site(end if isinstance(end, str) and end != WORLD else None, point, f'{name}/{k}'))}/>"
            for k, (end, point) in enumerate(through)
        )
        self.tendon_lines.append(f"<spatial name={quoteattr(name)} {attributes}>{sites}</spatial>")

    def _ended(self, row: Distance | Spring) -> list[tuple[End, Array]]:
        """Both ends, and where they are at the start."""
        return [(end, np.array(self.scene.anchor(row, k))) for k, end in enumerate(row.between)]

    def _spring(self, spring: Spring) -> None:
        self._tendon(
            spring.name,
            self._ended(spring),
            f'stiffness="{spring.stiffness!r}" damping="{spring.viscosity!r}" springlength="{spring.rest_length!r}"',
        )

    def _hold(self, constraint: Constraint) -> None:
        """A constraint as equality constraints."""
        if isinstance(constraint, Distance):
            ends = self._ended(constraint)
            self._tendon(constraint.name, ends, "")
            longer = 0.0
            if constraint.rest_length is not None:
                longer = constraint.rest_length - math.dist(ends[0][1], ends[1][1])
            self._add(constraint, [self._of_length(constraint.name, longer)])
            return
        if isinstance(constraint, Relation):
            self._relate(constraint)
            return
        if isinstance(constraint, Wire):
            self._wire(constraint)
            return
        assert isinstance(constraint, Joint)
        if any(frictions(constraint)[0]) or any(
            getattr(constraint, name, None) for name in ("armature", "motor", "limit", "spring")
        ):
            raise NotSupported(
                "mujoco does not support friction, armature, a motor, a limit or a spring in an equality constraint, as "
                f"{constraint.name!r} would be"
            )
        at = joint_point(self.scene, constraint)
        if isinstance(constraint, Lock):
            self._add(constraint, [self._weld(constraint, at)])
        elif isinstance(constraint, Ball):
            self._add(constraint, [self._connect(constraint, at)])
        elif isinstance(constraint, Hinge):
            arm = HALF_HINGE * np.array(constraint.axis)
            self._add(constraint, [self._connect(constraint, at - arm), self._connect(constraint, at + arm)])
        else:
            raise NotSupported(
                f"mujoco has no equality constraint for the {constraint.kind} {constraint.name!r}"
            )

    def _of_length(self, tendon: str, longer: float) -> str:
        """An equality that keeps a tendon's length that of the start, or so much longer."""
        return f'<tendon tendon1={quoteattr(tendon)} polycoef="{longer!r} 0 0 0 0" {self.row}/>'

    def _relate(self, relation: Relation) -> None:
        """A fixed tendon, whose length is the sum of joint coordinates, kept as it is."""
        terms = ""
        for name, factor in relation.terms:
            child, joint = self.tree.get(name), self.scene.constraint(name)
            if child is None:
                raise NotSupported(
                    f"mujoco has no coordinate of {name!r}, which is an equality constraint here"
                )
            sign = 1.0 if joint.between[1] == child else -1.0
            terms += f'<joint joint={quoteattr(name)} coef="{sign * factor!r}"/>'
        self.tendon_lines.append(f"<fixed name={quoteattr(relation.name)}>{terms}</fixed>")
        self._add(relation, [self._of_length(relation.name, 0.0)])

    def _wire(self, wire: Wire) -> None:
        """A tendon through sites, whose length is bounded or kept."""
        if wire.rubs or wire.wound or wire.restitution or wire.strength is not None:
            raise NotSupported(
                f"mujoco does not support friction, drums, restitution or a strength of a tendon, as of {wire.name!r}"
            )
        through = [(end, np.array(point)) for end, point in wire.through]
        start = sum(math.dist(one, two) for (_, one), (_, two) in pairwise(through))
        length = start if wire.length is None else wire.length
        if not wire.slack:
            self._tendon(wire.name, through, "")
            self._add(wire, [self._of_length(wire.name, length - start)])
            return
        self.wires[wire.name] = len(self.tendon_lines)
        row = self.row.replace("solref", "solreflimit").replace("solimp", "solimplimit")
        self._tendon(wire.name, through, f'limited="true" range="0 {length!r}" {row}')

    def _add(self, constraint: Constraint, lines: list[str]) -> None:
        first = len(self.equality_lines)
        self.equality_lines += lines
        self.equalities[constraint.name] = tuple(range(first, first + len(lines)))

    def _ends(self, joint: Joint) -> tuple[str, str, str]:
        """The attributes of an equality's two bodies, and the one whose frame its anchor is in."""
        one, two = held_first(self.scene, joint)
        second = "" if two == WORLD else f" body2={quoteattr(two)}"
        return f"body1={quoteattr(one)}{second}", one, two

    def _connect(self, joint: Joint, at: Array) -> str:
        bodies, one, _ = self._ends(joint)
        place, turn = self._frame(one)
        return f"<connect {bodies} anchor={numbers(turned_back(turn, at - place))} {self.row}/>"

    def _weld(self, joint: Joint, at: Array) -> str:
        bodies, _, two = self._ends(joint)
        place, turn = self._frame(two)
        return f"<weld {bodies} anchor={numbers(turned_back(turn, at - place))} {self.row}/>"

    def _contacts(self) -> str:
        """Pairs that must not touch, and pairs whose friction is not the larger of two."""
        if not self.scene.contacts:
            return ""
        solid = {b.name: b for b in self.scene.bodies if isinstance(b, RigidBody) and b.shape is not None}
        apart = {frozenset(pair) for pair in self.scene.no_contact}
        apart |= {frozenset(c.between) for c in self.scene.constraints if isinstance(c, Joint)}
        pairs = [tuple(sorted(pair)) for pair in apart if len(pair) == 2 and all(n in solid for n in pair)]
        text = "".join(f"<exclude body1={quoteattr(a)} body2={quoteattr(b)}/>" for a, b in sorted(pairs))
        if self.one_friction:
            return text
        for (a, one), (b, two) in combinations(solid.items(), 2):
            if frozenset((a, b)) in apart or (fixed(one) and fixed(two)):
                continue
            mu = math.sqrt(one.material.friction * two.material.friction)
            text += (
                f"<pair geom1={quoteattr(a)} geom2={quoteattr(b)} "
                f"{_friction(mu, one.material, two.material, pair=True)} {self.row}/>"
            )
        return text


def held_first(scene: Scene, joint: Joint) -> tuple[str, str]:
    """Both ends of a joint as an equality has them: the one that stands, or the world, comes last."""
    one, two = joint.between
    if one == WORLD or (two != WORLD and fixed(scene.body(one))):
        return two, one
    return one, two


def _is_compound(body: Particle | RigidBody) -> bool:
    return isinstance(body, RigidBody) and isinstance(body.shape, Compound)


def _of_friction(row: str) -> str:
    return row.replace("solref", "solreffriction").replace("solimp", "solimpfriction")


def _armature(tie: Constraint) -> str:
    size = getattr(tie, "armature", 0.0)
    return f' armature="{size!r}"' if size else ""


def _friction(sliding: float, *materials: Material, pair: bool = False) -> str:
    """Kinds of friction as MuJoCo has them: of two surfaces the larger, of sliding what is given."""
    spin, roll = (max(getattr(m, f"{kind}_friction") for m in materials) for kind in ("torsional", "rolling"))
    dimensions = 6 if roll else 4 if spin else 3 if sliding else 1
    sizes = (sliding, sliding, spin, roll, roll) if pair else (sliding, spin, roll)
    return f'condim="{dimensions}" friction={numbers(sizes)}'


def _surface(shape: Shape) -> tuple[str, tuple[float, ...], Any]:
    """MuJoCo's name, size and turn of a shape."""
    if isinstance(shape, Sphere):
        return "sphere", (shape.radius,), UPRIGHT
    if isinstance(shape, Box):
        return "box", tuple(0.5 * edge for edge in shape.size), UPRIGHT
    if isinstance(shape, Capsule | Cylinder):
        return shape.kind, (shape.radius, 0.5 * shape.length), UPRIGHT
    assert isinstance(shape, Plane)
    x, y, z = shape.normal
    q = np.array([1.0 + z, -y, x, 0.0]) if z > -1.0 + 1e-12 else np.array([0.0, 1.0, 0.0, 0.0])
    return "plane", (0.0, 0.0, 1.0), q / np.linalg.norm(q)
