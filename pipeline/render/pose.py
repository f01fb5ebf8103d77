"""A trajectory at any moment, between its frames too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.look import levels
from sim.motion import Motion

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Moment:
    """Where everything is at a moment.

    Parameters
    ----------
    position, rotation : (n_bodies, 3), m, and (n_bodies, 3, 3), of the bodies
    soft : (n_vertices, 3), m, by surface
    ends, level : (n_elements, 2, 3), m, of muscle elements, and their tension from 0 to 1
    markers : (n_markers, 3), m, simulated
    """

    position: Floats
    rotation: Floats
    soft: dict[str, Floats]
    ends: Floats
    level: Floats
    markers: Floats


class Poses:
    """Moments of a motion; before its first frame and after its last one it stands still."""

    def __init__(self, motion: Motion) -> None:
        self._motion = motion
        quaternion = motion.quaternion.copy()
        for frame in range(1, len(quaternion)):
            # q and -q turn alike; neighbours on one side can be mixed
            away = (quaternion[frame] * quaternion[frame - 1]).sum(axis=-1) < 0
            quaternion[frame, away] *= -1
        self._quaternion = quaternion
        elements, n = motion.elements, len(motion.time)
        self._ends = np.zeros((n, 0, 2, 3)) if elements is None else elements.endpoints
        self._level = np.zeros((n, 0))
        if elements is not None:
            self._level = levels(elements.tension, float(elements.tension.max(initial=0.0)))

    def at(self, time: float) -> Moment:
        """Return the moment at a time (s) of the motion: straight between frames.

        Turns between neighbouring frames are small, so that the mean of quaternions, brought to
        unit length, stands for the way on the sphere.
        """
        clock = self._motion.time
        after = int(np.clip(np.searchsorted(clock, time, side="right"), 1, max(len(clock) - 1, 1)))
        before = after - 1
        after = min(after, len(clock) - 1)
        gap = float(clock[after] - clock[before]) or 1.0
        share = float(np.clip((time - clock[before]) / gap, 0.0, 1.0))

        def mixed(values: Floats) -> Floats:
            return np.asarray((1.0 - share) * values[before] + share * values[after])

        return Moment(
            position=mixed(self._motion.position),
            rotation=Rotation.from_quat(mixed(self._quaternion), scalar_first=True).as_matrix(),
            soft={name: mixed(soft.vertices) for name, soft in self._motion.soft.items()},
            ends=mixed(self._ends),
            level=mixed(self._level),
            markers=mixed(self._motion.markers),
        )
