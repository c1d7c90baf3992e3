"""The picture of a scene: a parallel projection of its solids, far ones first.

The camera looks along the axis on which the scene extends least, a little from above and from the side; a scene
without gravity that lies flat is seen from above. In the lower corners: a bar of a round length, and the axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from spook_tracker.tracker.document.quaternions import Vector, turned
from spook_tracker.tracker.document.run_document import DrawnLink, DrawnSolid, SceneDrawing
from spook_tracker.tracker.document.wording import number

WIDTH, LEAST_HEIGHT, MOST_HEIGHT, EDGE = 640.0, 150.0, 400.0, 44.0
SIDE, ABOVE = math.radians(24.0), math.radians(16.0)
CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
FACES = [((0, 1, 3, 2), 0, -1), ((4, 6, 7, 5), 0, 1), ((0, 4, 5, 1), 1, -1), ((2, 3, 7, 6), 1, 1),
         ((0, 2, 6, 4), 2, -1), ((1, 5, 7, 3), 2, 1)]  # fmt: skip
Place = Callable[[Vector], tuple[float, float]]  # a place in the world to one in the picture
MOST_JOINTS = 12  # marks would hide a longer row of bodies
LIGHT = (0.35, -0.55, 0.76)
BAR, AXIS, LETTER = 0.2, 22.0, 9.0  # share of the width; pixels of an axis, and of its letter beyond its end
SHORT = 0.5  # of an axis: its letter stands aside, clear of the others
BASE = 12.0  # pixels from the edge


@dataclass
class Shape:
    """One piece of the picture."""

    depth: float  # larger is farther
    classes: str
    path: str = ""
    centre: tuple[str, str] | None = None
    radius: str = ""


@dataclass
class Mark:
    """A line with a word beside it."""

    path: str
    x: str
    y: str
    words: str


@dataclass
class Scenery:
    """The whole picture."""

    width: float
    height: float
    description: str
    shapes: list[Shape] = field(default_factory=list)
    gravity: tuple[str, str, str, str] | None = None  # of the arrow in the corner
    bar: Mark | None = None
    driven: bool = False  # whether a body in it is
    axes: list[Mark] = field(default_factory=list)


@dataclass(frozen=True)
class Camera:
    """Rows are right, up and away."""

    right: Vector
    up: Vector
    away: Vector

    def see(self, p: Vector) -> Vector:
        """Right, up and away of a place."""
        return (_dot(self.right, p), _dot(self.up, p), _dot(self.away, p))


def scenery(drawn: SceneDrawing) -> Scenery | None:
    """The picture of a scene; None if there is nothing to see."""
    solids = [s for s in drawn.solids if s.kind != "plane"]
    if not solids:
        return None
    points = [p for s in solids for p in _corners(s)] + [p for link in drawn.links for p in link.ends]
    points += list(drawn.attractors)
    low = [min(p[i] for p in points) for i in range(3)]
    high = [max(p[i] for p in points) for i in range(3)]
    size = max(h - b for h, b in zip(high, low, strict=True)) or 1.0
    dot = 0.022 * size  # a particle has no size; this is how large it is drawn
    camera = _camera([h - b for h, b in zip(high, low, strict=True)], drawn.gravity)
    middle: Vector = tuple((h + b) / 2.0 for h, b in zip(high, low, strict=True))  # type: ignore[assignment]
    quads = [_quad(s, middle, 0.62 * size) for s in drawn.solids if s.kind == "plane"]
    heads = _heads(solids, size)
    seen = [
        camera.see(p) for p in [*points, *(head for _, head in heads), *(p for quad in quads for p in quad)]
    ]
    pad = max([dot, *(s.size[0] for s in solids if s.kind in ("sphere", "capsule"))])
    pad += 0.13 * size if high == low else 0.2 * size if len(solids) == 1 else 0.0
    left, right = min(p[0] for p in seen) - pad, max(p[0] for p in seen) + pad
    bottom, top = min(p[1] for p in seen) - pad, max(p[1] for p in seen) + pad
    scale = min((WIDTH - 2 * EDGE) / (right - left), (MOST_HEIGHT - 2 * EDGE) / (top - bottom))
    height = max(LEAST_HEIGHT, (top - bottom) * scale + 2 * EDGE)

    def place(p: Vector) -> tuple[float, float]:
        x, y, _ = camera.see(p)
        return (
            WIDTH / 2.0 + (x - (left + right) / 2.0) * scale,
            height / 2.0 - (y - (top + bottom) / 2.0) * scale,
        )

    out = Scenery(WIDTH, round(height), _describe(drawn), driven=any(solid.driven for solid in drawn.solids))
    for quad in quads:
        out.shapes += _floor(quad, place)
    pieces: list[Shape] = []
    for solid in solids:
        pieces += _pieces(solid, camera, place, scale, dot)
    pieces += [Shape(-math.inf, "velocity", path=_arrow(place(tail), place(head))) for tail, head in heads]
    pieces += _pins(drawn, camera, place)
    pieces += [
        _link(link, camera, place)
        for link in drawn.links
        if link.kind != "joint" or len(drawn.links) <= MOST_JOINTS
    ]
    pieces += [
        Shape(camera.see(c)[2], "sun", centre=_at(place(c)), radius=f"{max(7.0, 1.8 * dot * scale):.1f}")
        for c in drawn.attractors
    ]
    out.shapes += sorted(pieces, key=lambda piece: -piece.depth)
    out.gravity = _gravity(drawn.gravity, camera)
    out.bar = _bar(scale, height)
    out.axes = _axes(camera, height)
    return out


def _camera(extent: Sequence[float], gravity: Vector) -> Camera:
    flat = extent[2] < 0.2 * max(extent[:2]) and not any(gravity)
    turn = math.pi / 2.0 if extent[0] < 0.5 * extent[1] else 0.0  # look along x where y is the longer
    thin = sorted(extent)[1] < 0.15 * max(extent)
    side, above = (math.radians(6.0) if thin else SIDE) + turn, math.radians(52.0) if flat else ABOVE
    away = (-math.sin(side) * math.cos(above), math.cos(side) * math.cos(above), -math.sin(above))
    right = (math.cos(side), math.sin(side), 0.0)
    return Camera(right, _cross(right, away), away)


def _pieces(solid: DrawnSolid, camera: Camera, place: Place, scale: float, dot: float) -> list[Shape]:
    kind = "driven" if solid.driven else "fixed" if solid.fixed else "solid"
    depth = camera.see(solid.position)[2]
    if solid.kind in ("particle", "sphere"):
        radius = scale * (solid.size[0] if solid.kind == "sphere" else dot)
        x, y = place(solid.position)
        ball = Shape(depth, f"{kind} f2", centre=_at((x, y)), radius=f"{max(radius, 2.5):.1f}")
        if radius < 5.0:
            return [ball]
        shine = Shape(
            depth - 1e-9,
            f"{kind} f4",
            centre=_at((x - 0.3 * radius, y - 0.34 * radius)),
            radius=f"{0.34 * radius:.1f}",
        )
        return [ball, shine]
    if solid.kind == "capsule":
        ends = _corners(solid)
        (x1, y1), (x2, y2) = (place(p) for p in ends)
        wide = max(2.0, 2.0 * solid.size[0] * scale)
        return [
            Shape(
                depth,
                f"{kind} rod w{min(9, round(wide / 8.0))}",
                path=f"M{_n(x1)} {_n(y1)}L{_n(x2)} {_n(y2)}",
            )
        ]
    found = []
    for corners, normal in _faces(solid):
        if _dot(normal, camera.away) >= -1e-9:
            continue  # turned away
        bright = round(2.0 + 2.0 * _dot(normal, LIGHT))
        face = "L".join(f"{_n(x)} {_n(y)}" for x, y in (place(p) for p in corners))
        found.append(Shape(depth, f"{kind} f{max(0, min(4, bright))}", path=f"M{face}Z"))
    return found


def _faces(solid: DrawnSolid) -> list[tuple[list[Vector], Vector]]:
    """Corners and outward normal of every face of a box or of facets."""
    if solid.kind == "box":
        corners = _corners(solid)
        return [
            (
                [corners[i] for i in places],
                turned(solid.orientation, tuple(float(sign) if i == axis else 0.0 for i in range(3))),  # type: ignore[arg-type]
            )
            for places, axis, sign in FACES
        ]
    found, start = [], 0
    while start < len(solid.size):
        end = start + 1 + 3 * int(solid.size[start])
        flat = [
            _plus(solid.position, turned(solid.orientation, (x, y, z)))
            for x, y, z in zip(*[iter(solid.size[start + 1 : end])] * 3, strict=True)
        ]
        found.append((flat, _unit(_cross(_minus(flat[1], flat[0]), _minus(flat[2], flat[0])))))
        start = end
    return found


def _corners(solid: DrawnSolid) -> list[Vector]:
    """Places that show how far a solid reaches."""
    if solid.kind == "facets":
        return [corner for corners, _ in _faces(solid) for corner in corners]
    if solid.kind == "box":
        return [
            _plus(
                solid.position,
                turned(solid.orientation, (x * solid.size[0], y * solid.size[1], z * solid.size[2])),
            )
            for x, y, z in CORNERS
        ]
    if solid.kind == "capsule":
        half = turned(solid.orientation, (0.0, 0.0, solid.size[1] / 2.0))
        return [_plus(solid.position, half), _plus(solid.position, (-half[0], -half[1], -half[2]))]
    return [solid.position]


def _quad(plane: DrawnSolid, middle: Vector, reach: float) -> list[Vector]:
    """A piece of a plane under the middle of the scene."""
    normal = turned(plane.orientation, plane.size)  # type: ignore[arg-type]
    away = _dot(normal, _minus(middle, plane.position))
    foot = (middle[0] - away * normal[0], middle[1] - away * normal[1], middle[2] - away * normal[2])
    one = _unit(_cross(normal, (0.0, 1.0, 0.0) if abs(normal[1]) < 0.9 else (1.0, 0.0, 0.0)))
    other = _cross(normal, one)
    return [
        (
            foot[0] + reach * (a * one[0] + b * other[0]),
            foot[1] + reach * (a * one[1] + b * other[1]),
            foot[2] + reach * (a * one[2] + b * other[2]),
        )
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]


def _floor(quad: Sequence[Vector], place: Place) -> Iterable[Shape]:
    a, b, c, d = (place(p) for p in quad)
    outline = "L".join(f"{_n(x)} {_n(y)}" for x, y in (a, b, c, d))
    yield Shape(math.inf, "floor", path=f"M{outline}Z")
    lines = []
    for i in range(1, 8):
        share = i / 8.0
        for (p, q), (r, s) in (((a, b), (d, c)), ((a, d), (b, c))):
            x1, y1 = p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])
            x2, y2 = r[0] + share * (s[0] - r[0]), r[1] + share * (s[1] - r[1])
            lines.append(f"M{_n(x1)} {_n(y1)}L{_n(x2)} {_n(y2)}")
    yield Shape(math.inf, "grid", path="".join(lines))


def _link(link: DrawnLink, camera: Camera, place: Place) -> Shape:
    one, other = link.ends
    depth = (camera.see(one)[2] + camera.see(other)[2]) / 2.0 - 1e-6
    if link.kind == "joint":
        middle = _plus(one, _minus(other, one), 0.5)
        x, y = place(middle)
        return Shape(
            -math.inf,
            "joint",
            path=f"M{_n(x)} {_n(y - 4)}L{_n(x + 4)} {_n(y)}L{_n(x)} {_n(y + 4)}L{_n(x - 4)} {_n(y)}Z",
        )
    (x1, y1), (x2, y2) = place(one), place(other)
    return Shape(depth + 1e-3, link.kind, path=f"M{_n(x1)} {_n(y1)}L{_n(x2)} {_n(y2)}")


def _heads(solids: Sequence[DrawnSolid], size: float) -> list[tuple[Vector, Vector]]:
    """Velocities at the start as arrows, the fastest a fifth of the scene long."""
    fastest = max((math.hypot(*s.velocity) for s in solids), default=0.0)
    if fastest == 0.0 or len(solids) > 60:
        return []
    moving = [s for s in solids if any(s.velocity) and not s.fixed]
    return [(s.position, _plus(s.position, s.velocity, 0.2 * size / fastest)) for s in moving]


def _pins(drawn: SceneDrawing, camera: Camera, place: Place) -> list[Shape]:
    """A mark where a distance or a spring is fixed to the world."""
    held = {solid.position for solid in drawn.solids}
    free = {end for link in drawn.links if link.kind != "joint" for end in link.ends if end not in held}
    if len(free) > 8:  # anchors on the surfaces of bodies, not pins
        return []
    found = []
    for end in sorted(free):
        x, y = place(end)
        path = f"M{_n(x)} {_n(y)}L{_n(x - 7)} {_n(y - 12)}L{_n(x + 7)} {_n(y - 12)}Z"
        found.append(Shape(camera.see(end)[2] - 1e-6, "fixed pin f2", path=path))
    return found


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    (x1, y1), (x2, y2) = start, end
    length = math.hypot(x2 - x1, y2 - y1)
    if length < 4.0:
        return ""
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    wings = [(x2 - 8 * ux + s * 4 * uy, y2 - 8 * uy - s * 4 * ux) for s in (1, -1)]
    (ax, ay), (bx, by) = wings
    return f"M{_n(x1)} {_n(y1)}L{_n(x2)} {_n(y2)}M{_n(ax)} {_n(ay)}L{_n(x2)} {_n(y2)}L{_n(bx)} {_n(by)}"


def _gravity(gravity: Vector, camera: Camera) -> tuple[str, str, str, str] | None:
    """The arrow in the upper left corner: its path, and where its letter stands."""
    if not any(gravity):
        return None
    x, y, _ = camera.see(_unit(gravity))
    start = (24.0 - min(0.0, 34.0 * x), 18.0 + max(0.0, 34.0 * y))
    end = (start[0] + 34.0 * x, start[1] - 34.0 * y)
    return (
        _arrow(start, end),
        _n((start[0] + end[0]) / 2.0 + 10.0),
        _n((start[1] + end[1]) / 2.0 + 4.0),
        "g",
    )


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `most`, m."""
    power = math.floor(math.log10(most))
    digit = next(n for n in (5, 2, 1) if n <= most / 10.0**power * (1.0 + 1e-12))
    return float(f"{digit}e{power}")


def length_words(metres: float) -> str:
    """A round length with the unit in which it is short."""
    if 1e-3 <= metres < 0.1:
        return f"{number(metres * 1e3)} mm"
    if 1e3 <= metres < 1e6:
        return f"{number(metres / 1e3)} km"
    return f"{number(metres)} m"


def _bar(scale: float, height: float) -> Mark:
    """A length to measure by: the projection is parallel, so it holds everywhere across the picture."""
    metres = round_length(BAR * WIDTH / scale)
    long, y = metres * scale, height - BASE
    path = f"M{_n(BASE)} {_n(y - 7)}v7h{_n(long)}v-7"
    return Mark(path, _n(BASE + long / 2.0), _n(y - 5), length_words(metres))


def _axes(camera: Camera, height: float) -> list[Mark]:
    """The axes of the world, from one point in the lower right corner."""
    ends, letters = [], []
    for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        x, y, _ = camera.see(axis)
        long = math.hypot(x, y)
        far = AXIS + LETTER / long if long > 0.1 else 0.0
        aside = max(abs(far * x), LETTER) if long < SHORT and abs(x) > 0.01 else abs(far * x)
        ends.append((AXIS * x, -AXIS * y))
        letters.append((math.copysign(aside, x), -far * y))
    left = WIDTH - BASE - LETTER / 2.0 - max(x for x, _ in [*letters, (0.0, 0.0)])
    top = height - BASE - max(y for _, y in [*letters, (0.0, 0.0)])
    return [
        Mark(f"M{_n(left)} {_n(top)}l{_n(dx)} {_n(dy)}", _n(left + x), _n(top + y + 4.5), name)
        for name, (dx, dy), (x, y) in zip("xyz", ends, letters, strict=True)
    ]


def _describe(drawn: SceneDrawing) -> str:
    """What the picture shows, in words."""
    counts: dict[str, int] = {}
    for solid in drawn.solids:
        kind = "many-sided solid" if solid.kind == "facets" else solid.kind
        how = "driven " if solid.driven else "fixed " if solid.fixed and kind != "plane" else ""
        name = how + kind
        counts[name] = counts.get(name, 0) + 1
    for link in drawn.links:
        counts[link.kind] = counts.get(link.kind, 0) + 1
    plural = {
        "box": "boxes",
        "fixed box": "fixed boxes",
        "driven box": "driven boxes",
        "distance": "distance constraints",
    }
    single = {"distance": "distance constraint"}
    words = [
        f"{n} {single.get(name, name) if n == 1 else plural.get(name, name + 's')}"
        for name, n in counts.items()
    ]
    return f"The scene at its start: {', '.join(words)}."


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _plus(a: Vector, b: Vector, share: float = 1.0) -> Vector:
    return (a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2])


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _unit(a: Vector) -> Vector:
    length = math.hypot(*a)
    return (a[0] / length, a[1] / length, a[2] / length)


def _at(p: tuple[float, float]) -> tuple[str, str]:
    return (_n(p[0]), _n(p[1]))


def _n(value: float) -> str:
    text = f"{value:.1f}"
    return text[:-2] if text.endswith(".0") else text
