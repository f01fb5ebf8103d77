"""BVH: the rigid bodies as a tree of joints; centimetres, degrees, Y up as in `pipeline.glb`."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.glb import turned, turned_quaternions
from sim.motion import Motion

Floats = NDArray[np.float64]

CM = 100.0
PLACES = "Xposition Yposition Zposition"
TURNS = "Zrotation Xrotation Yrotation"
ORDER: Final = "ZXY"
STAYS = 1e-5
"""m; a joint that moves less in its parent's frame has no channels of place."""


def _tree(motion: Motion) -> list[list[int]]:
    """Children of each body; what nothing carries hangs on the pelvis, the root."""
    children: list[list[int]] = [[] for _ in motion.bodies]
    for b, parent in enumerate(motion.parents[1:], start=1):
        children[motion.bodies.index(parent) if parent else 0].append(b)
    return children


def _local(motion: Motion) -> tuple[Floats, Floats]:
    """Places (n_frames, n_bodies, 3), cm, and turns, degrees, in the parents' frames."""
    position = turned(motion.position)
    shape = position.shape
    world = Rotation.from_quat(turned_quaternions(motion.quaternion).reshape(-1, 4)).as_matrix()
    world = world.reshape(*shape[:2], 3, 3)
    up = [motion.bodies.index(p) if p else 0 for p in motion.parents]
    place = np.einsum("fbji,fbj->fbi", world[:, up], position - position[:, up])
    turn = np.einsum("fbji,fbjk->fbik", world[:, up], world)
    place[:, 0], turn[:, 0] = position[:, 0], world[:, 0]
    angles = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_euler(ORDER)
    return CM * place, np.degrees(angles).reshape(shape)


def _end(motion: Motion, body: int) -> Floats:
    """Farthest point of what a body carries, cm in its frame."""
    carried = [s.vertices for s in motion.shapes.values() if s.body == motion.bodies[body]]
    if not carried:
        return np.zeros(3)
    points = np.concatenate(carried)
    return CM * turned(points[np.argmax(np.linalg.norm(points, axis=1))])


def _vector(values: Floats) -> str:
    return " ".join(f"{v:.5f}" for v in values)


def bvh_text(motion: Motion) -> str:
    """A trajectory's rigid bodies as BVH; a joint's place replaces its offset."""
    children = _tree(motion)
    place, angle = _local(motion)
    moves = np.ptp(place, axis=0).max(axis=1) > CM * STAYS
    moves[0] = True
    lines, order = ["HIERARCHY"], []

    def write(body: int, depth: int) -> None:
        indent, kind = "  " * depth, "ROOT" if body == 0 else "JOINT"
        channels = f"6 {PLACES} {TURNS}" if moves[body] else f"3 {TURNS}"
        lines.extend([
            f"{indent}{kind} {motion.bodies[body]}",
            f"{indent}{{",
            f"{indent}  OFFSET {_vector(place[:, body].mean(axis=0))}",
            f"{indent}  CHANNELS {channels}",
        ])  # fmt: skip
        order.append(body)
        for child in children[body]:
            write(child, depth + 1)
        if not children[body]:
            end = _vector(_end(motion, body))
            lines.extend([f"{indent}  End Site", f"{indent}  {{", f"{indent}    OFFSET {end}"])
            lines.append(f"{indent}  }}")
        lines.append(f"{indent}}}")

    write(0, 0)
    n = len(motion.time)
    step = float(np.ptp(motion.time)) / (n - 1) if n > 1 else 1.0
    lines += ["MOTION", f"Frames: {n}", f"Frame Time: {step:.7f}"]
    for frame in range(n):
        parts = [
            np.concatenate([place[frame, b], angle[frame, b]]) if moves[b] else angle[frame, b]
            for b in order
        ]
        lines.append(_vector(np.concatenate(parts)))
    return "\n".join(lines) + "\n"
