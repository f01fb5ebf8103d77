"""How levels differ from breath to breath, freed of what each breath's own fit is unsure of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.density import Setting
from pipeline.emulator import scores
from pipeline.likelihood import gather

Floats = NDArray[np.float64]

STEP = 0.01
"""Half step of the derivative in a level."""
MIN_CYCLES = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class CycleSpread:
    """Covariance (4, 4) of the levels of single breaths, and deviation (n_cycles, 4) of each fit.

    known : whether there were enough breaths to tell
    """

    covariance: Floats
    deviation: Floats
    known: bool


def _slope(setting: Setting, levels: Floats) -> Floats:
    """Differentiate the components in the data's space by the levels: (n_components, 4), m."""
    steps = STEP * np.eye(len(levels))
    high = np.clip(levels + steps, 0, setting.upper)
    low = np.clip(levels - steps, 0, setting.upper)
    change = scores(setting.emulator, high) - scores(setting.emulator, low)
    width = np.diag(high - low)[:, None]
    return np.asarray(setting.evidence.turn @ (change / width).T)


def _fit_covariance(setting: Setting, target: Floats, levels: Floats) -> Floats:
    """Laplace's covariance (4, 4) of one breath's levels under the uniform prior."""
    evidence = gather(setting.emulator, target, setting.markers)
    squares = float(evidence.squares(setting.emulator, levels[None])[0])
    variance = max(squares / evidence.n_values, setting.noise**2)
    slope = _slope(setting, levels)
    precision = slope.T @ slope / (variance * evidence.n_values / setting.n_effective)
    return np.asarray(np.linalg.inv(precision + np.eye(4) * 12 / setting.upper**2))


def cycle_spread(levels: Floats, targets: list[Floats], setting: Setting) -> CycleSpread:
    """Spread of levels among breaths.

    Parameters
    ----------
    levels : (n_cycles, 4), fits of single breaths
    targets : (n_frames, n_markers, 3) each, m, the measured breaths on the model's frames
    """
    own = [_fit_covariance(setting, t, fitted) for t, fitted in zip(targets, levels, strict=True)]
    deviation = np.sqrt([np.diag(matrix) for matrix in own]).reshape(-1, levels.shape[1])
    if len(levels) < MIN_CYCLES:
        return CycleSpread(covariance=np.zeros((4, 4)), deviation=deviation, known=False)
    apparent = np.cov(levels.T) - np.mean(own, axis=0)
    values, vectors = np.linalg.eigh(apparent)
    covariance = (vectors * np.clip(values, 0, None)) @ vectors.T
    return CycleSpread(covariance=covariance, deviation=deviation, known=True)
