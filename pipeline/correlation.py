"""Correlation of two curves, with an interval that knows neighbouring samples are alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Correlation:
    """Pearson's r; `p_value` takes every sample as independent, as published, the interval not.

    Parameters
    ----------
    r, p_value : of all samples
    low, high : interval of the block bootstrap
    n : samples
    """

    r: float
    p_value: float
    low: float
    high: float
    n: int


def correlate(
    first: Floats,
    second: Floats,
    *,
    block: int,
    draws: int,
    probability: float,
    rng: np.random.Generator,
) -> Correlation:
    """Correlate two curves sampled at the same times.

    Parameters
    ----------
    first, second : (n,)
    block : samples drawn together (circular moving blocks, Politis & Romano 1992); several calls
    draws : of the bootstrap
    probability : of the interval
    rng : source of chance
    """
    n = len(first)
    if n < 3 or first.std() == 0.0 or second.std() == 0.0:
        nan = float("nan")
        return Correlation(r=nan, p_value=nan, low=nan, high=nan, n=n)
    r, p_value = stats.pearsonr(first, second)
    block = max(1, min(block, n))
    starts = rng.integers(0, n, (draws, -(-n // block)))
    drawn = []
    for row in starts:
        at = (row[:, None] + np.arange(block)).ravel()[:n] % n
        drawn.append(np.corrcoef(first[at], second[at])[0, 1])
    tail = (1 - probability) / 2
    low, high = np.nanquantile(drawn, [tail, 1 - tail])
    return Correlation(r=float(r), p_value=float(p_value), low=float(low), high=float(high), n=n)
