"""A first guess at a call: a burst like its pressure, as much earlier as pressure lags behind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.call_effort import ABDOMEN, INTERCOSTALS, CallSpace
from pipeline.score import LARYNX, Score, burst, numbers
from pipeline.torso_runs import TorsoRuns

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Probe:
    """How pressure answers a burst of all expiratory muscles at rest.

    Parameters
    ----------
    lag : s from the top of activation to that of pressure
    gain : Pa of pressure for each unit of the internal intercostals' level
    """

    lag: float
    gain: float


def probe(runs: TorsoRuns) -> Probe:
    """Burst against a laughing larynx, from rest."""
    of = numbers()
    height, period = of["lag_probe"], of["probe_period"]
    share = 1.0 / of["intercostals_per_abdomen"]
    score = Score().line(LARYNX, (0.0, 0.5 * (of["larynx_low"] + of["larynx_high"])))
    score = score.add(INTERCOSTALS, burst(0.0, period, height))
    score = score.add(ABDOMEN, burst(0.0, period, share * height))
    run, _ = runs.run(runs.rest, score, 0.0, runs.grid(2.0 * period))
    top = int(np.argmax(run.alveolar))
    lag = float(run.time[top]) - 0.5 * period
    return Probe(lag=max(0.0, lag), gain=float(run.alveolar[top]) / height)


def first_guess(space: CallSpace, time: Floats, pressure: Floats, found: Probe) -> Floats:
    """Parameters of a burst as wide and as high as the pressure, that much earlier as it lags."""
    share = 1.0 / numbers()["intercostals_per_abdomen"]
    top, step = int(np.argmax(pressure)), float(time[1] - time[0])
    middle = 0.5 * (float(pressure.max()) + float(pressure.min()))
    # a squared sine is above half its height for half its period
    period = 2.0 * step * max(1, int((pressure > middle).sum()))
    start = float(time[top]) - found.lag - 0.5 * period
    height = float(np.ptp(pressure)) / found.gain
    brake = 0.05 * height
    raw = np.array([height, share * height, start, 1 / period, brake, start, 1 / period])
    return space.values(space.unit(raw))
