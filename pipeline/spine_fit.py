"""How the spine bends with the breath: estimated beside the levels, if the settings ask for it.

People do not sit still: many bend or twist a little with every breath. What is rigid of that is
taken out by the markers on the back; what the back does between them is not, and no symmetric
torso on a straight spine can follow it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

from pipeline.model import NO_BEND, Bend, Floats, Simulator
from pipeline.registration import as_recorded
from pipeline.trials import Trials

PROBE = np.radians(3.0)
"""rad; by how much the spine is bent to see what the markers do."""
MOST = np.radians(15.0)
"""rad; no larger bend is believed."""


def fit_bend(trials: Trials, bent: Callable[[Bend], Simulator]) -> Bend:
    """Bend of the spine that explains most of what the best levels leave.

    Markers answer to small bends in proportion, so three runs say what any bend does; a fourth
    checks what was found. A bend that does not lower the cost is none.

    Parameters
    ----------
    trials : searched with a straight spine
    bent : simulator of the same torso and timing with a bend, rad

    Returns
    -------
    Bend
        flexion, lateral bend and twist at the height of the inspiration, rad
    """
    levels, straight = trials.levels[trials.best], trials.positions(trials.best)
    cost = trials.marker_cost()

    def run(bend: Floats) -> Floats:
        runs = bent(_as_bend(bend)).run(levels[None])
        return np.asarray(as_recorded(runs, trials.registration, trials.back)[0])

    response = np.stack([(run(PROBE * way) - straight) / PROBE for way in np.eye(3)])
    if not np.isfinite(response).all():
        return NO_BEND

    def expected(bend: Floats) -> float:
        moved = straight + np.tensordot(bend, response, axes=1)
        return 1e3 * float(cost(moved[None])[0])

    found = minimize(expected, np.zeros(3), method="Powell", bounds=[(-MOST, MOST)] * 3)
    better = float(cost(run(found.x)[None])[0]) < trials.cost[trials.best]
    return _as_bend(found.x) if better else NO_BEND


def _as_bend(angles: Floats) -> Bend:
    flexion, lateral, twist = (float(angle) for angle in angles)
    return flexion, lateral, twist
