"""Efforts nobody would make: activations drawn at random, which no run may diverge at."""

from __future__ import annotations

import numpy as np

from sim.model.muscles import MUSCLE_GROUPS
from sim.physics.types import Floats

RISE = 0.1
"""s, of the gradual and of the delay of the sudden kind."""
PANT = 5.0
"""Hz, of the rhythmic kind: as fast as bursts of laughter."""
KINDS = ("gradual", "sudden", "rhythmic")


def random_effort(seed: int, *, step: float, duration: float = 1.0) -> Floats:
    """Activation of every group: a level in [0, 1] each, in one of three courses in time.

    Every other set silences about half of the groups, so that some pull without their antagonists.

    Parameters
    ----------
    seed : of the levels; `seed` modulo 3 is the course, as in `KINDS`
    step, duration : s

    Returns
    -------
    (n_steps, n_groups)
    """
    rng = np.random.default_rng(seed)
    time = np.arange(round(duration / step)) * step
    levels = rng.uniform(0.0, 1.0, len(MUSCLE_GROUPS))
    if seed % 2:
        levels *= rng.uniform(0.0, 1.0, len(MUSCLE_GROUPS)) < 0.5
    courses = {
        "gradual": np.minimum(time / RISE, 1.0),
        "sudden": (time > RISE).astype(np.float64),
        "rhythmic": 0.5 - 0.5 * np.cos(2.0 * np.pi * PANT * time),
    }
    return np.asarray(courses[KINDS[seed % len(KINDS)]][:, None] * levels)
