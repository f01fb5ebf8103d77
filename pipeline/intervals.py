"""Draws into intervals, table rows and plain words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.model import GROUPS
from pipeline.scoring import Row

Floats = NDArray[np.float64]

AT_BOUND = 0.01
"""An interval that comes this close to a bound, as a share of the range, is drawn to it."""
TIED = 0.8
"""Groups whose levels correlate at least this much cannot be told apart."""
UNINFORMED = 0.8
"""A posterior this wide, as a share of the prior's deviation, says nothing beyond the prior."""


def shortest_interval(draws: Floats, probability: float) -> tuple[float, float]:
    """Shortest interval that holds `probability` of the draws (n,).

    A central interval could never hold a level of zero, which passive breathing has.
    """
    ordered = np.sort(draws)
    inside = max(1, int(np.ceil(probability * len(ordered))))
    widths = ordered[inside - 1 :] - ordered[: len(ordered) - inside + 1]
    first = int(np.argmin(widths))
    return float(ordered[first]), float(ordered[first + inside - 1])


def bounded_interval(draws: Floats, probability: float, upper: float) -> tuple[float, float]:
    """`shortest_interval`, drawn to a bound of the levels that it all but touches."""
    low, high = shortest_interval(draws, probability)
    edge = AT_BOUND * upper
    return (0.0 if low < edge else low), (upper if high > upper - edge else high)


def correlations(draws: Floats) -> Floats:
    """Correlation (n_groups, n_groups) of draws (n, n_groups); 0 where nothing varies."""
    centred = draws - draws.mean(axis=0)
    deviation = np.maximum(np.sqrt(np.mean(centred**2, axis=0)), 1e-12)
    scaled = centred / deviation
    return np.asarray(scaled.T @ scaled / len(draws))


def identifiability(draws: Floats, groups: tuple[str, ...], upper: float) -> tuple[str, ...]:
    """Say in plain language what the markers can and cannot tell.

    Parameters
    ----------
    draws : (n, n_groups)
    upper : largest level; the prior is uniform from 0 to it
    """
    names = [group.replace("_", " ") for group in groups]
    prior = upper / np.sqrt(12)
    lines = [
        f"these markers say nothing about the {name}: its level stays as uncertain as before"
        for name, deviation in zip(names, draws.std(axis=0), strict=True)
        if deviation > UNINFORMED * prior
    ]
    matrix = correlations(draws)
    for i, j in zip(*np.triu_indices(len(names), 1), strict=True):
        if abs(matrix[i, j]) < TIED:
            continue
        way = (
            "less of one looks like more of the other" if matrix[i, j] < 0 else "they rise together"
        )
        lines.append(
            f"these markers cannot tell the {names[i]} from the {names[j]}: {way} "
            f"(correlation {matrix[i, j]:+.2f})"
        )
    return tuple(lines) or ("the markers tell all four groups apart",)


def activation_rows(
    scope: str,
    name: str,
    level: Floats,
    *,
    n_cycles: int,
    upper: float,
    probability: float | None = None,
    interval: list[tuple[float, float]] | None = None,
) -> list[Row]:
    """Rows of activations.csv, one a group; without an interval its cells stay empty.

    Parameters
    ----------
    scope : subject_mean, next_breath or cycle; name : recording or number of the breath
    level : (n_groups,)
    """
    edge = AT_BOUND * upper
    rows: list[Row] = []
    for k, group in enumerate(GROUPS):
        low, high = interval[k] if interval else ("", "")
        at_bound = level[k] < edge or level[k] > upper - edge
        rows.append(
            {
                "scope": scope,
                "id": name,
                "group": group,
                "level": float(level[k]),
                "low": low,
                "high": high,
                "probability": "" if probability is None else probability,
                "n_cycles": n_cycles,
                "at_bound": "yes" if at_bound else "no",
            }
        )
    return rows
