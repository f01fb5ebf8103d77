"""A torso from its right side, frame by frame: what the small drawings show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.draw.filmstrip import View
from pipeline.draw.section import Cut, Floats, Ints, sagittal_cuts, sagittal_section
from sim.behaviour import Behaviour
from sim.model.anatomy import Anatomy
from sim.model.skeleton import segment_of
from sim.motion import Motion
from sim.resting import RestingTorso
from sim.simulate import Trajectory, skin_frames

CUT = ("chest_cavity", "abdomen", "diaphragm")
"""Surfaces that are cut through the dome."""
RIGHT = 1
"""Side of the ribs that are drawn."""
DISC = 0.2
"""Share of the height between two end plates that the disc takes: for the drawing only."""


def chosen_frames(trajectory: Trajectory, frames: Sequence[int]) -> Trajectory:
    """Some frames of a run; they keep no tensions."""
    pick, n = np.asarray(frames, dtype=np.int64), len(trajectory.time)
    parts = {
        name: getattr(trajectory, name)[pick]
        for name in trajectory.__slots__
        if name not in ("tension", "lung_model") and len(getattr(trajectory, name)) == n
    }
    return replace(trajectory, **parts, tension=np.zeros((0, 0)))


class _Riders:
    """Points that ride on bodies, from the built pose to a frame."""

    def __init__(self, rest: Motion) -> None:
        self.bodies = rest.bodies
        self.start, self.turn = rest.position[0], self._turns(rest, 0)

    @staticmethod
    def _turns(motion: Motion, frame: int) -> Rotation:
        return Rotation.from_quat(motion.quaternion[frame], scalar_first=True)

    def place(self, motion: Motion, frame: int, body: str, points: Floats) -> Floats:
        """(n, 2), built points (n, 3) where the body has taken them."""
        b = self.bodies.index(body)
        local = self.turn[b].inv().apply(np.atleast_2d(points) - self.start[b])
        now = self._turns(motion, frame)[b].apply(local) + motion.position[frame, b]
        return np.asarray(now[:, [0, 2]])


def _bodies_of_spine(anatomy: Anatomy) -> list[tuple[str, Floats, Floats]]:
    """Segment, outline (4, 3) and spinous process (2, 3) of every vertebra, as built."""
    out = []
    order = sorted(anatomy.joint, key=lambda level: float(anatomy.joint[level][2]))
    for k, level in enumerate(order):
        low = anatomy.joint[level]
        if segment_of(level) == "pelvis":
            continue
        top = anatomy.joint[order[k + 1]] if k + 1 < len(order) else anatomy.skull_base
        depth = anatomy.front[level] - anatomy.spine[level]
        up = (1.0 - DISC) * (top - low)
        box = np.array([low + depth, low + up + depth, low + up - depth, low - depth])
        process = np.array([anatomy.spine[level] - depth, anatomy.process[level]])
        out.append((segment_of(level), box, process))
    return out


def outside(vertices: Floats, faces: Ints, sacrum: Floats) -> list[Cut]:
    """Front and back of the skin's midline, without the floor and the lid that close the model.

    The longest cut runs down the front, along the floor, up the back and over the lid.

    Parameters
    ----------
    vertices, faces : of the skin
    sacrum : (2,), back of the pelvis' rim
    """
    cut = max(sagittal_cuts(vertices, faces, 0.0), key=lambda one: len(one.share))
    line = cut.points(vertices)
    if line[0, 0] < line[-1, 0]:
        cut, line = cut.part(slice(None, None, -1)), line[::-1]
    lowest = int(np.argmin(line[:, 1]))
    behind = np.flatnonzero((np.arange(len(line)) > lowest) & (line[:, 1] < sacrum[1]))
    start = int(behind[np.argmin(line[behind, 0])])
    end = start + int(np.argmax(line[start:, 1])) - 1
    return [cut.part(slice(lowest + 1)), cut.part(slice(start, end + 1))]


def dome_plane(rest: Motion) -> float:
    """Y of the highest point of the right dome at rest, m."""
    points = rest.soft["diaphragm"].vertices[0]
    right = points[points[:, 1] < 0.0]
    return float(right[np.argmax(right[:, 2]), 1])


def views(resting: RestingTorso, done: Behaviour, frames: Sequence[int]) -> list[View]:
    """The torso in some frames of a run.

    Parameters
    ----------
    frames : indices into the run's frames
    """
    anatomy, m = resting.torso.anatomy, done.motion
    riders = _Riders(done.rest)
    spine, plane = _bodies_of_spine(anatomy), dome_plane(done.rest)
    skins = skin_frames(resting, chosen_frames(done.trajectory, frames))
    bone = np.vstack([anatomy.sternum_front, anatomy.sternum_back[::-1]])
    out = []
    for skin, frame in zip(skins, frames, strict=True):
        cuts = {
            name: sagittal_section(soft.vertices[frame], soft.faces, plane)
            for name, soft in m.soft.items()
            if name in CUT
        }

        def at(body: str, points: Floats, frame: int = frame) -> Floats:
            return riders.place(m, frame, body, points)

        rim = at("pelvis", anatomy.pelvis_rim)
        lines = [at(f"rib_R{i + 1}", anatomy.rib[RIGHT, i]) for i in range(12)]
        facets = [at("sternum", anatomy.facet[RIGHT, i])[0] for i in range(7)]
        out.append(
            View(
                skin=[cut.points(skin) for cut in outside(skin, resting.skin.faces, rim[0])],
                chest=cuts["chest_cavity"],
                abdomen=cuts["abdomen"],
                diaphragm=cuts["diaphragm"],
                ribs=lines,
                cartilages=[np.array([lines[i][-1], facets[i]]) for i in range(7)],
                sternum=at("sternum", bone),
                vertebrae=[at(segment, box) for segment, box, _ in spine],
                processes=[at(segment, line) for segment, _, line in spine],
                pelvis=rim,
            )
        )
    return out
