"""How the solids of a scene drawing are turned: quaternions, the real part first."""

from __future__ import annotations

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)


def multiplied(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation b, then a."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def turned(orientation: Quaternion, vector: Vector) -> Vector:
    """A vector turned by a unit quaternion."""
    w, x, y, z = orientation
    _, a, b, c = multiplied(multiplied(orientation, (0.0, *vector)), (w, -x, -y, -z))
    return (a, b, c)
