"""The torso at rest as a skin sees it: what it is laid over and what it can be bound to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sim.model.anatomy import Anatomy, Subject
from sim.model.bone_shapes import Shape
from sim.physics.types import Floats, Ints

MIRROR = np.array([1.0, -1.0, 1.0])
SOFT = "abdomen:"
"""Before the number of a vertex of the abdomen in the name of a handle."""
SKULL_SHARE = 0.6
"""Of the height of the skull: above it lies the vault, below the face, which no layer covers."""
ARM_POINTS, ARM_RADIUS, ARM_SIDES = 24, 0.011, 6
"""The shaft of the humerus, which the bone set has not: rings on a line; radius in m."""
LEVELS = ("C7", "T3", "T8", "T12", "L4", "S1")
SPARE = 8
"""Of the skull's many vertices each so-manyth is enough to bind to."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RestPose:
    """Bodies and belly of the upright torso at rest.

    Parameters
    ----------
    subject : sex, stature, mass
    bodies : names
    position, quaternion : (n_bodies, 3), m, and (n_bodies, 4), w x y z
    abdomen : (n, 3), m, vertices of the abdomen; wall : those of them that are free muscular wall
    marks : name -> (3,), m, points of the bones (`bone_marks`)
    """

    subject: Subject
    bodies: tuple[str, ...]
    position: Floats
    quaternion: Floats
    abdomen: Floats
    wall: Ints
    marks: dict[str, Floats]

    @property
    def handles(self) -> tuple[str, ...]:
        """Names of all that a skin can be bound to: bodies, then vertices of the abdomen."""
        return (*self.bodies, *(f"{SOFT}{k}" for k in range(len(self.abdomen))))

    def in_space(self, shape: Shape) -> Floats:
        """Vertices (n, 3), m, of a bone."""
        body = self.bodies.index(shape.body)
        turn = Rotation.from_quat(self.quaternion[body], scalar_first=True)
        return np.asarray(turn.apply(shape.vertices) + self.position[body])


def bone_marks(anatomy: Anatomy) -> dict[str, Floats]:
    """Points of the bones, (3,) m each, that say where the skin's landmarks go."""
    front = anatomy.sternum_front[np.argsort(anatomy.sternum_front[:, 2])]
    rim = anatomy.pelvis_rim
    out = {"notch": front[-1], "xiphoid": front[1]}
    out |= {level.lower(): anatomy.process[level] for level in LEVELS}
    out |= {name: anatomy.girdle[name][0] for name in ("shoulder", "elbow")}
    return out | {
        "pubis": rim[np.argmin(rim[:, 2])] * [1.0, 0.0, 1.0],
        "navel": np.array([0.0, 0.0, anatomy.navel_height]),
    }


def part_of(shape: str) -> str:
    """The row of `skin_layers.csv` that a bone belongs to."""
    kind = shape.split("_")[0]
    if kind in ("rib", "cartilage", "clavicle", "scapula", "pelvis", "sternum", "skull"):
        return kind
    return "pelvis" if kind == "sacrum" else "vertebra"


@dataclass(frozen=True, kw_only=True, slots=True)
class Underneath:
    """What lies under the skin at rest.

    Parameters
    ----------
    points : (k, 3), m
    part : (k,), rows of `skin_layers.csv`
    skull : (n, 3), m, vertices of skull and jaw
    """

    points: Floats
    part: tuple[str, ...]
    skull: Floats


def underneath(rest: RestPose, shapes: Mapping[str, Shape]) -> Underneath:
    """Bones and muscular wall that a skin must cover; not the face."""
    points, part = [rest.abdomen[rest.wall]], ["belly"] * len(rest.wall)
    for name, shape in shapes.items():
        if name == "jaw":
            continue
        at = rest.in_space(shape)
        if name == "skull":
            at = at[at[:, 2] > at[:, 2].min() + SKULL_SHARE * np.ptp(at[:, 2])]
        points.append(at)
        part += [part_of(name)] * len(at)
    skull = [rest.in_space(shapes[name]) for name in ("skull", "jaw")]
    return Underneath(points=np.concatenate(points), part=tuple(part), skull=np.concatenate(skull))


def humerus(rest: RestPose) -> dict[str, Floats]:
    """Points (k, 3), m, of the shafts of both upper arms by the name of their body."""
    upper, lower = rest.marks["shoulder"], rest.marks["elbow"]
    line = np.linspace(upper, lower, ARM_POINTS)
    turn = np.linspace(0.0, 2.0 * np.pi, ARM_SIDES, endpoint=False)
    ring = ARM_RADIUS * np.stack([np.cos(turn), np.sin(turn), np.zeros(ARM_SIDES)], axis=1)
    left = (line[:, None] + ring[None]).reshape(-1, 3)
    return {"upper_arm_L": left, "upper_arm_R": left * MIRROR}


def bone_points(rest: RestPose, shapes: Mapping[str, Shape]) -> dict[str, Floats]:
    """Points (k, 3), m, of the bones by the name of the body that carries them."""
    found: dict[str, list[Floats]] = {}
    for name, shape in shapes.items():
        at = rest.in_space(shape)
        found.setdefault(shape.body, []).append(at[::SPARE] if name in ("skull", "jaw") else at)
    out = {body: np.concatenate(parts) for body, parts in found.items()}
    return out | {name: at for name, at in humerus(rest).items() if name in rest.bodies}
