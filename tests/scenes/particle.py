"""Random scenes of particles for the tests: chains, trees, loops, and one with every force there is."""

from __future__ import annotations

import numpy as np

from spook_tracker.engine import CentralGravity, Distance, Load, Particle, Scene, Spring

TIME_STEP = 0.01  # s
GRAVITY = (0.3, -0.2, -9.81)  # m/s²


def particles(rng: np.random.Generator, count: int, speed: float = 0.3) -> tuple[Particle, ...]:
    """Particles a metre apart on a crooked line, masses over two orders of magnitude."""
    return tuple(
        Particle(
            name=f"p{i}",
            mass=float(10.0 ** rng.uniform(-1.0, 1.0)),
            position=(i + rng.uniform(-0.2, 0.2), rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4)),
            velocity=tuple(speed * rng.standard_normal(3)),
        )
        for i in range(count)
    )


def tie(rng: np.random.Generator, first: str | tuple[float, float, float], second: str) -> Distance:
    """A row of random compliance (rigid to soft), damping (sometimes none given) and stretch."""
    return Distance(
        name=f"{first}-{second}",
        between=(first, second),
        compliance=float(rng.choice([0.0, 1e-12, 1e-8, 1e-4, 1e-2])),
        damping=None if rng.random() < 0.3 else float(rng.uniform(0.2, 5.0) * TIME_STEP),
    )


def chain(rng: np.random.Generator, count: int = 6) -> Scene:
    """Hung up at one end; the ends of the rows are named in either order."""
    rows = [tie(rng, (-1.0, 0.1, 0.0), "p0")]
    for i in range(count - 1):
        pair = (f"p{i}", f"p{i + 1}") if rng.random() < 0.5 else (f"p{i + 1}", f"p{i}")
        rows.append(tie(rng, *pair))
    return Scene(bodies=particles(rng, count), constraints=rows, gravity=GRAVITY)


def tree(rng: np.random.Generator, count: int = 8) -> Scene:
    """Every particle hangs from an earlier one, the first from the world."""
    rows = [tie(rng, (0.0, 2.0, 0.0), "p0")]
    rows += [tie(rng, f"p{rng.integers(0, i)}", f"p{i}") for i in range(1, count)]
    rng.shuffle(rows)
    return Scene(bodies=particles(rng, count), constraints=rows, gravity=GRAVITY)


def loop(rng: np.random.Generator, count: int = 6) -> Scene:
    """A ring with a bar across, tied to the world twice."""
    rows = [tie(rng, f"p{i}", f"p{(i + 1) % count}") for i in range(count)]
    rows += [
        tie(rng, "p0", f"p{count // 2}"),
        tie(rng, (0.0, 0.0, 3.0), "p2"),
        tie(rng, (2.0, 3.0, 0.0), "p2"),
    ]
    return Scene(bodies=particles(rng, count), constraints=rows, gravity=GRAVITY)


def pieces(rng: np.random.Generator, count: int = 8) -> Scene:
    """Two chains that float freely and a particle on its own."""
    rows = [tie(rng, "p1", "p0"), tie(rng, "p2", "p1"), tie(rng, "p4", "p5"), tie(rng, "p5", "p6")]
    return Scene(bodies=particles(rng, count), constraints=rows, gravity=GRAVITY)


def everything(rng: np.random.Generator, count: int = 6) -> Scene:
    """Rows and every kind of force at once."""
    rows = [tie(rng, (-1.0, 0.0, 0.0), "p0"), tie(rng, "p0", "p1"), tie(rng, "p2", "p3")]
    forces = (
        Spring(name="damper", between=("p1", "p2"), stiffness=40.0, rest_length=0.8, viscosity=0.7),
        Spring(name="soft", between=((0.0, 1.0, 0.0), "p4"), stiffness=3.0),
        Spring(name="to the world", between=("p5", (6.0, 1.0, 1.0)), stiffness=9.0, rest_length=2.0),
        CentralGravity(name="star", strength=2.0, centre=(2.0, 5.0, 0.0)),
        CentralGravity(name="planet", strength=0.5, centre=(0.0, -4.0, 1.0)),
        Load(name="push", body="p1", force=(0.0, 1.5, -0.5)),
        Load(name="second push", body="p1", force=(1.0, 0.0, 0.0)),
    )
    return Scene(bodies=particles(rng, count), constraints=rows, forces=forces, gravity=GRAVITY)


KINDS = {build.__name__: build for build in (chain, tree, loop, pieces, everything)}
