"""Figures of the one-muscle experiments: overshoot, bounces, settling, force against speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.muscle_experiments import activation_run
from sim.muscle_rig import Motion
from sim.physics.types import Floats
from sim.tables import Parameters

SETTLED = 0.02
"""Share of the rest length within which a muscle has settled."""
SMALL_SWING = 0.01
"""m; a smaller turn is no bounce."""
REST_LENGTHS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.25, 1.5)
"""m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Contraction:
    """Figures of a full activation.

    Parameters
    ----------
    end : length at which it settles, m
    shortest : least place on the way, m, negative above the frozen particle
    overshoot : beyond the end over the whole way
    bounces : turns with a swing of more than a centimetre
    settling : time from activation to within 2 % of the rest length for good, s
    peak_speed, peak_time : largest shortening speed, m/s, and when since activation, s
    arrival_speed, arrival_time : where the end is first passed
    half_time : when half the peak speed is reached, s since activation
    """

    end: float
    shortest: float
    overshoot: float
    bounces: int
    settling: float
    peak_speed: float
    peak_time: float
    arrival_speed: float
    arrival_time: float
    half_time: float


def _between(motion: Motion, low: float, high: float) -> slice:
    return slice(*(int(np.searchsorted(motion.time, t - 1e-9)) for t in (low, high)))


def contraction(motion: Motion, numbers: Parameters) -> Contraction:
    """Measure the activated part of a run."""
    part = _between(motion, numbers["activated_at"], numbers["deactivated_at"])
    time = motion.time[part] - motion.time[part.start]
    place, speed = motion.place[part], motion.speed[part]
    end, start = float(place[-1]), float(place[0])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(place)))) + 1
    swings = np.abs(np.diff(place[turns]))
    outside = np.abs(place - end) > SETTLED * numbers["rest_length"]
    arrival = int(np.argmax(place <= end))
    return Contraction(
        end=end,
        shortest=float(place.min()),
        overshoot=(end - float(place.min())) / (start - end),
        bounces=int((swings > SMALL_SWING).sum()),
        settling=float(time[np.flatnonzero(outside)[-1]]),
        peak_speed=-float(speed.min()),
        peak_time=float(time[speed.argmin()]),
        arrival_speed=-float(speed[arrival]),
        arrival_time=float(time[arrival]),
        half_time=float(time[np.argmax(speed <= 0.5 * speed.min())]),
    )


def rest_length_sweep(numbers: Parameters) -> list[tuple[float, Contraction, Contraction]]:
    """Full activation with other rest lengths, which the thesis does not print.

    Returns
    -------
    rest length, m, and the contraction of spring and Hill muscle for each of `REST_LENGTHS`
    """
    out = []
    for rest in REST_LENGTHS:
        n = numbers.replace(rest_length=rest)
        spring, hill = (contraction(activation_run(law, n), n) for law in ("spring", "hill"))
        out.append((rest, spring, hill))
    return out


def speed_and_force(motion: Motion, numbers: Parameters) -> tuple[Floats, Floats]:
    """Shortening speed, m/s, and tension, N, from the release to the greatest speed."""
    part = slice(_between(motion, numbers["released_at"], np.inf).start, int(motion.speed.argmin()))
    return -motion.speed[part], motion.tension[part]
