"""Rotation of the ribs over a breath, level by level (dilorenzo2009, Fig. 5.4)."""

from __future__ import annotations

import numpy as np

from sim.behaviour import Behaviour
from sim.physics.types import Floats
from sim.summary import find_breaths, rib_rotations

LEVELS = tuple(range(1, 11))
"""Ribs of the figure, on the right."""


def rotations(done: Behaviour) -> tuple[Floats, Floats]:
    """Rotation about the transverse axis in the last breath, front end up, since rest.

    Returns
    -------
    (n,), s from the onset; (n, 10), rad
    """
    b = find_breaths(done.motion, done.cycle)[-1]
    frames = range(b.first, b.last + 1)
    found = [rib_rotations(done.motion, done.rest, frame) for frame in frames]
    turn = np.array([[ribs[f"rib_R{k}"]["pump"] for k in LEVELS] for ribs in found])
    time = done.motion.time[b.first : b.last + 1]
    return time - time[0], turn


def delays(time: Floats, turn: Floats, period: float) -> Floats:
    """(n_ribs,), s by which each rib's fundamental follows that of the first, signs taken off.

    A rib that turns the other way is compared as if it turned the same way: what is told is when
    it moves, not where to.

    Parameters
    ----------
    time : (n,), s; one period
    turn : (n, n_ribs), rad
    """
    wave = np.exp(-2j * np.pi * time / period)
    first = (turn - turn.mean(axis=0)).T @ wave
    angle = np.angle(first / first[0])
    folded = np.mod(angle + 0.5 * np.pi, np.pi) - 0.5 * np.pi
    return np.asarray(-folded * period / (2.0 * np.pi))
