"""A cheap stand-in for the torso: principal components of the motion and Gaussian processes.

Inputs are square roots of the levels: real breaths use small ones, and there the runs are dense.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import Bounds, minimize

from sim.errors import InputError

Floats = NDArray[np.float64]

MAX_COMPONENTS = 10
KEPT_RMS = 5e-6
"""m; components are kept until what the others carry is below this."""
LOG_LENGTH_PRIOR = (0.0, 1.0)
LOG_LENGTH_RANGE = (-2.0, 2.5)
LOG_NUGGET_START = -9.0
LOG_NUGGET_RANGE = (-16.0, 0.0)
MAX_ITERATIONS = 40
MIN_RUNS = 20


@dataclass(frozen=True, kw_only=True, slots=True)
class Emulator:
    """Marker displacement as a function of the four levels.

    Parameters
    ----------
    levels : (n_runs, 4), the runs it was made from
    mean : (n_values,), m; basis : (n_components, n_values), orthonormal rows
    lengths : (n_components, 4), of the Gaussian processes
    trend : (n_components, n_trend), quadratic trend; weights : (n_components, n_runs)
    shape : (n_frames, n_markers) of one run
    """

    levels: Floats
    mean: Floats
    basis: Floats
    lengths: Floats
    trend: Floats
    weights: Floats
    shape: tuple[int, int]


def _inputs(levels: Floats) -> Floats:
    return np.sqrt(np.clip(levels, 0.0, None))


def _quadratic(x: Floats) -> Floats:
    first, second = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, first] * x[:, second]])


def _kernel(a: Floats, b: Floats, lengths: Floats) -> Floats:
    scaled = (a / lengths)[:, None, :] - (b / lengths)[None, :, :]
    return np.asarray(np.exp(-0.5 * np.sum(scaled**2, axis=-1)))


@dataclass(frozen=True, kw_only=True, slots=True)
class _Algebra:
    """Inverse covariance with the trend taken out, the trend's estimator, log determinants."""

    inverse: Floats
    estimator: Floats
    log_det: float


def _algebra(x: Floats, lengths: Floats, nugget: float) -> _Algebra:
    trend = _quadratic(x)
    covariance = _kernel(x, x, lengths)
    covariance[np.diag_indices(len(x))] += nugget
    factor = cho_factor(covariance, lower=True)
    inverse = cho_solve(factor, np.eye(len(x)))
    spread = np.asarray(np.linalg.inv(trend.T @ inverse @ trend), dtype=np.float64)
    estimator = spread @ trend.T @ inverse
    log_det = 2 * np.sum(np.log(np.diag(factor[0]))) - np.linalg.slogdet(spread)[1]
    return _Algebra(
        inverse=inverse - inverse @ trend @ estimator,
        estimator=estimator,
        log_det=float(log_det),
    )


def _fit_process(x: Floats, y: Floats) -> tuple[Floats, float]:
    """Lengths (4,) and relative nugget that make the runs most likely."""
    freedom = len(x) - _quadratic(x).shape[1]

    gaps = (x[:, None, :] - x[None, :, :]) ** 2

    def negative_log(parameters: Floats) -> tuple[float, Floats]:
        lengths, nugget = np.exp(parameters[:-1]), float(np.exp(parameters[-1]))
        algebra = _algebra(x, lengths, nugget)
        weights = algebra.inverse @ y
        squares = max(float(y @ weights), 1e-30)
        centre, width = LOG_LENGTH_PRIOR
        away = (parameters[:-1] - centre) / width
        value = 0.5 * (freedom * np.log(squares / freedom) + algebra.log_det + away @ away)
        # the derivative of the restricted likelihood by the covariance
        slope = 0.5 * (algebra.inverse - freedom / squares * np.outer(weights, weights))
        by_kernel = slope * _kernel(x, x, lengths)
        by_lengths = np.tensordot(by_kernel, gaps, axes=2) / lengths**2 + away / width
        return float(value), np.append(by_lengths, nugget * np.trace(slope))

    start = np.append(np.zeros(x.shape[1]), LOG_NUGGET_START)
    low, high = np.array([LOG_LENGTH_RANGE] * x.shape[1] + [LOG_NUGGET_RANGE]).T
    found = minimize(
        negative_log,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=Bounds(low, high),
        options={"maxiter": MAX_ITERATIONS},
    ).x
    return np.exp(found[:-1]), float(np.exp(found[-1]))


def _components(values: Floats) -> tuple[Floats, Floats]:
    mean = values.mean(axis=0)
    _, singular, vectors = np.linalg.svd(values - mean, full_matrices=False)
    left = np.sqrt(np.append(np.cumsum(singular[::-1] ** 2)[::-1], 0.0)[1:] / values.size)
    needed = int(np.argmax(left < KEPT_RMS)) + 1
    return mean, vectors[: min(needed, MAX_COMPONENTS)]


def build_emulator(levels: Floats, displacement: Floats) -> Emulator:
    """Make an emulator of runs that did not fail.

    Parameters
    ----------
    levels : (n_runs, 4)
    displacement : (n_runs, n_frames, n_markers, 3), m, each marker's mean removed
    """
    if len(levels) < MIN_RUNS:
        raise InputError(
            f"emulator: {len(levels)} runs that did not fail. At least {MIN_RUNS} are needed: "
            "raise fit.n_initial or lower fit.upper_level."
        )
    values = displacement.reshape(len(levels), -1)
    mean, basis = _components(values)
    targets = (values - mean) @ basis.T
    x = _inputs(levels)
    parts: list[tuple[Floats, Floats, Floats]] = []
    for y in targets.T:
        lengths, nugget = _fit_process(x, y)
        algebra = _algebra(x, lengths, nugget)
        parts.append((lengths, algebra.estimator @ y, algebra.inverse @ y))
    return Emulator(
        levels=levels,
        mean=mean,
        basis=basis,
        lengths=np.stack([part[0] for part in parts]),
        trend=np.stack([part[1] for part in parts]),
        weights=np.stack([part[2] for part in parts]),
        shape=(displacement.shape[1], displacement.shape[2]),
    )


def scores(emulator: Emulator, levels: Floats) -> Floats:
    """Component scores (n, n_components), m, at (n, 4) levels."""
    x = _inputs(levels)
    # all components at once: a chain asks for a few points many thousand times
    here = x / emulator.lengths[:, None]
    there = _inputs(emulator.levels) / emulator.lengths[:, None]
    squared = (here**2).sum(-1)[:, :, None] + (there**2).sum(-1)[:, None]
    squared -= 2 * here @ np.swapaxes(there, 1, 2)
    cross = np.exp(-0.5 * np.maximum(squared, 0.0))
    learned = (cross @ emulator.weights[:, :, None])[:, :, 0].T
    return np.asarray(_quadratic(x) @ emulator.trend.T + learned)


def predict(emulator: Emulator, levels: Floats) -> Floats:
    """Displacement (n, n_frames, n_markers, 3), m, at (n, 4) levels."""
    values = emulator.mean + scores(emulator, levels) @ emulator.basis
    return np.asarray(values).reshape(len(levels), *emulator.shape, 3)


def held_out_error(
    levels: Floats, displacement: Floats, checked: NDArray[np.int64], n_folds: int
) -> float:
    """R.m.s. error (m) of a value in runs that an emulator made anew has not seen.

    The closed form for leaving one run out would keep components and lengths that know the run,
    and is too kind by a quarter or more.

    Parameters
    ----------
    levels, displacement : as for `build_emulator`
    checked : indices of the runs to be left out, in `n_folds` interleaved parts
    """
    squares = 0.0
    for fold in range(n_folds):
        left_out = checked[fold::n_folds]
        kept = np.setdiff1d(np.arange(len(levels)), left_out)
        emulator = build_emulator(levels[kept], displacement[kept])
        error = predict(emulator, levels[left_out]) - displacement[left_out]
        squares += float(np.sum(error**2))
    return float(np.sqrt(squares / (len(checked) * displacement[0].size)))
