"""Single rigid bodies: mass, inertia and joint."""

from __future__ import annotations

import mujoco
import numpy as np

from sim.physics.types import Floats
from sim.tables import read_rows


def printed_masses() -> dict[str, float]:
    """Masses of dilorenzo2009 Table 8.2, kg, by the name of the part here."""
    return {row["part"]: float(row["mass_kg"]) for row in read_rows("bodies.csv")}


def _inertia(points: Floats, mass: float, thickness: float) -> list[float]:
    """Full inertia of a mass spread evenly over points about their mean; xx yy zz xy xz yz."""
    r = points - points.mean(axis=0)
    spread = mass * (r.T @ r) / len(r)
    tensor = np.trace(spread) * np.eye(3) - spread + 0.4 * mass * thickness**2 * np.eye(3)
    return [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]


def add_body(
    parent: mujoco.MjsBody, name: str, at: Floats, origin: Floats, points: Floats, mass: float,
    thickness: float,
) -> mujoco.MjsBody:  # fmt: skip
    """Add a body whose mass is spread evenly over `points`.

    Parameters
    ----------
    at, origin : places of its frame and of the parent's, m
    thickness : radius of what surrounds the points, m
    """
    body = parent.add_body(name=name, pos=list(at - origin))
    body.mass = mass
    body.ipos = list(points.mean(axis=0) - at)
    body.fullinertia = _inertia(points, mass, thickness)
    body.explicitinertial = True
    return body


def ball(body: mujoco.MjsBody, name: str) -> None:
    """Let the body turn any way about its frame's origin."""
    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_BALL)
