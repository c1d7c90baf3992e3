"""Convex hulls of a few points: their faces, and the exact moments of what they enclose.

Plain arithmetic in a fixed order, so that equal points give equal bits on every machine.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from .check import Rotation, Vector

MOST_CORNERS = 64
MOST_ROUND_A_FACE = 16
FLAT = 1e-9  # of the size: points nearer to a plane than this lie in it

Face = tuple[int, ...]
Tensor = tuple[Vector, Vector, Vector]


def minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def drawn(faces: Sequence[Sequence[Vector]]) -> tuple[float, ...]:
    """Faces as one row of numbers: of each how many corners, then their places."""
    return tuple(number for face in faces for number in (float(len(face)), *(x for p in face for x in p)))


def hull(points: Sequence[Vector]) -> tuple[tuple[Vector, ...], tuple[Face, ...]]:
    """Corners and faces of the convex hull, each face anticlockwise seen from outside.

    Points inside, on a face or on an edge are left out. Raises ValueError in a sentence's part where the points
    enclose nothing, or the hull has more corners than the engine takes.
    """
    distinct = list(dict.fromkeys(points))
    if len(distinct) > MOST_CORNERS:
        raise ValueError(
            f"has {len(distinct)} points, and at most {MOST_CORNERS} are taken; leave inner ones out"
        )
    size = max((math.dist(a, b) for a, b in itertools.combinations(distinct, 2)), default=0.0)
    planes = _planes(distinct, FLAT * size, 1e-7 * size * size)
    if len(planes) < 4:
        raise ValueError("its points lie in one plane and enclose nothing; give it thickness")
    loops = [_loop([distinct[i] for i in flat], list(flat), normal) for flat, normal in planes.items()]
    used = sorted({i for loop in loops for i in loop})
    for loop in loops:
        if len(loop) > MOST_ROUND_A_FACE:
            raise ValueError(
                f"one of its faces has {len(loop)} corners, and at most {MOST_ROUND_A_FACE} are taken"
            )
    sides = [side for loop in loops for side in zip(loop, (*loop[1:], loop[0]), strict=True)]
    if len(set(sides)) != len(sides) or {(b, a) for a, b in sides} != set(sides):
        raise ValueError(
            "some of its points nearly lie in one plane, but not quite; round them or leave them out"
        )
    place = {i: k for k, i in enumerate(used)}
    return tuple(distinct[i] for i in used), tuple(tuple(place[i] for i in loop) for loop in loops)


def _planes(points: Sequence[Vector], flat: float, thin: float) -> dict[tuple[int, ...], Vector]:
    """The planes that have all points on one side: which points lie in each, and its outward normal."""
    found: dict[tuple[int, ...], Vector] = {}
    for i, j, k in _supporting(points, 2.0 * flat, 0.5 * thin):
        if any(i in flat_set and j in flat_set and k in flat_set for flat_set in found):
            continue
        normal = cross(minus(points[j], points[i]), minus(points[k], points[i]))
        length = math.hypot(*normal)
        if length <= thin:
            continue
        nx, ny, nz = (normal[0] / length, normal[1] / length, normal[2] / length)
        ox, oy, oz = points[i]
        low = high = 0.0
        members = []
        for index, (x, y, z) in enumerate(points):
            height = nx * (x - ox) + ny * (y - oy) + nz * (z - oz)
            low, high = min(low, height), max(high, height)
            if low < -flat and high > flat:
                break
            if abs(height) <= flat:
                members.append(index)
        else:
            if high > flat:
                nx, ny, nz = -nx, -ny, -nz
            elif low >= -flat:
                return {}  # all in one plane
            found[tuple(members)] = (nx, ny, nz)
    return found


def _supporting(points: Sequence[Vector], flat: float, thin: float) -> Iterator[tuple[int, int, int]]:
    """Triples, in order, whose plane may have all points on one side: few of the many, to be looked at exactly."""
    given = np.array(points)
    for i in range(len(given) - 2):
        away = given - given[i]
        j, k = np.triu_indices(len(given) - i - 1, 1)
        j, k = j + i + 1, k + i + 1
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is looked at exactly, too
            normals = np.cross(away[j], away[k])
            length = np.linalg.norm(normals, axis=1)
            heights = normals @ away.T
            aside = (heights.min(axis=1) < -flat * length) & (heights.max(axis=1) > flat * length)
        for one in np.flatnonzero(~aside & ~(length <= thin)):
            yield i, int(j[one]), int(k[one])


def _loop(points: Sequence[Vector], indices: Sequence[int], normal: Vector) -> Face:
    """The corners of a flat set of points, anticlockwise round the normal; points between corners are left out."""
    least = min(range(3), key=lambda i: abs(normal[i]))
    axis = tuple(float(i == least) for i in range(3))
    u = cross(axis, normal)  # type: ignore[arg-type]
    v = cross(normal, u)
    flat = sorted((dot(p, u), dot(p, v), i) for p, i in zip(points, indices, strict=True))
    span = max(flat[-1][0] - flat[0][0], max(p[1] for p in flat) - min(p[1] for p in flat))

    def half(row: Sequence[tuple[float, float, int]]) -> list[tuple[float, float, int]]:
        chain: list[tuple[float, float, int]] = []
        for p in row:
            while len(chain) > 1:
                (ax, ay, _), (bx, by, _) = chain[-2:]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > FLAT * span * span:
                    break
                chain.pop()
            chain.append(p)
        return chain[:-1]

    ring = [i for _, _, i in (*half(flat), *half(flat[::-1]))]
    start = ring.index(min(ring))
    return tuple(ring[start:] + ring[:start])


def moments(corners: Sequence[Vector], faces: Sequence[Face]) -> tuple[float, Vector, Tensor]:
    """Volume [m³], centre [m] and ∫ x xᵀ dV [m⁵] about the centre, exactly: tetrahedra over one corner."""
    origin = corners[0]
    volume, first, second = 0.0, [0.0, 0.0, 0.0], [[0.0] * 3 for _ in range(3)]
    for face in faces:
        a = minus(corners[face[0]], origin)
        for j, k in itertools.pairwise(face[1:]):
            b, c = minus(corners[j], origin), minus(corners[k], origin)
            part = dot(a, cross(b, c)) / 6.0
            volume += part
            total = (a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2])
            for m in range(3):
                first[m] += 0.25 * part * total[m]
                for n in range(3):
                    squares = a[m] * a[n] + b[m] * b[n] + c[m] * c[n]
                    second[m][n] += part / 20.0 * (total[m] * total[n] + squares)
    x, y, z = (value / volume for value in first)
    about = tuple(
        tuple(second[m][n] - volume * (x, y, z)[m] * (x, y, z)[n] for n in range(3)) for m in range(3)
    )
    return volume, (origin[0] + x, origin[1] + y, origin[2] + z), about  # type: ignore[return-value]


def inertia_of(second: Tensor) -> Tensor:
    """The inertia tensor of unit density from ∫ x xᵀ dV."""
    trace = second[0][0] + second[1][1] + second[2][2]
    return tuple(tuple((trace if m == n else 0.0) - second[m][n] for n in range(3)) for m in range(3))  # type: ignore[return-value]


def principal_axes(tensor: Tensor) -> Tensor:
    """Unit eigenvectors as columns of a rotation, by Jacobi's rotations: a diagonal tensor keeps its axes."""
    a = [list(row) for row in tensor]
    turn = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    scale = max(abs(a[i][i]) for i in range(3))
    for _ in range(30):
        p, q = max(((0, 1), (0, 2), (1, 2)), key=lambda pq: abs(a[pq[0]][pq[1]]))
        if abs(a[p][q]) <= 1e-15 * scale:
            break
        tangent_of = (a[q][q] - a[p][p]) / (2.0 * a[p][q])
        t = math.copysign(1.0, tangent_of) / (abs(tangent_of) + math.sqrt(tangent_of * tangent_of + 1.0))
        c = 1.0 / math.sqrt(t * t + 1.0)
        s = t * c
        for rows in (a, turn):  # columns p and q
            for row in rows:
                row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
        a[p], a[q] = (
            [c * a[p][k] - s * a[q][k] for k in range(3)],
            [s * a[p][k] + c * a[q][k] for k in range(3)],
        )
    return tuple(tuple(row) for row in turn)  # type: ignore[return-value]


def quaternion(turn: Tensor) -> Rotation:
    """The unit quaternion (w, x, y, z) of a rotation matrix."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i)
    most = max(range(4), key=lambda k: squares[k])
    root = math.sqrt(squares[most])
    s = 0.5 / root
    rows = (
        (0.5 * root, s * (h - f), s * (c - g), s * (d - b)),
        (s * (h - f), 0.5 * root, s * (b + d), s * (c + g)),
        (s * (c - g), s * (b + d), 0.5 * root, s * (f + h)),
        (s * (d - b), s * (c + g), s * (f + h), 0.5 * root),
    )
    return rows[most]
