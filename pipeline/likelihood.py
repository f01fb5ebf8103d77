"""How likely measured marker displacements are at some levels, according to an emulator.

A mean breath is a smooth curve on neighbouring markers: its values are not independent. The
squared misfit is therefore scaled to an effective number of independent values, estimated from
the residual itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.cost import without_offset
from pipeline.emulator import Emulator, scores

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class Evidence:
    """The data in the space of an emulator's components.

    Parameters
    ----------
    projected : (n_components,), m; turn : (n_components, n_components), from component scores to
        the same space; left : m2, squared misfit that no level can remove
    n_values : how many numbers were compared
    """

    projected: Floats
    turn: Floats
    left: float
    n_values: int

    def squares(self, emulator: Emulator, levels: Floats) -> Floats:
        """Sum of squared differences (n,), m2, over all values."""
        difference = self.projected - scores(emulator, levels) @ self.turn.T
        return np.asarray(np.sum(difference**2, axis=1) + self.left)


def seen_values(target: Floats, markers: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which values of a breath count: (n_frames, n_markers, 3) flattened."""
    counted = np.zeros(target.shape, dtype=bool)
    counted[:, markers] = True
    return np.asarray((counted & np.isfinite(target)).ravel())


def gather(emulator: Emulator, target: Floats, markers: NDArray[np.int64]) -> Evidence:
    """Project a measured breath on an emulator's components.

    Parameters
    ----------
    target : (n_frames, n_markers, 3), m; each marker's mean is removed here
    markers : (n,), indices of the markers that count
    """
    seen = seen_values(target, markers)
    difference = without_offset(target).ravel()[seen] - emulator.mean[seen]
    orthonormal, turn = np.linalg.qr(emulator.basis[:, seen].T)
    projected = orthonormal.T @ difference
    left = max(float(difference @ difference) - float(projected @ projected), 0.0)
    return Evidence(projected=projected, turn=turn, left=left, n_values=int(seen.sum()))


def effective_values(residual: Floats) -> float:
    """How many independent values a residual holds.

    Frames: their number over the integrated autocorrelation time (the breath is periodic, so the
    autocorrelation is circular). Channels: the participation ratio of their covariance, freed of
    what few frames take from it.

    Parameters
    ----------
    residual : (n_frames, n_channels), m, without NaN

    Returns
    -------
    between 1 and the number of values
    """
    centred = residual - residual.mean(axis=0)
    total = float(np.sum(centred**2))
    if total <= 0:
        return float(residual.size)
    n_frames, n_channels = residual.shape
    power = np.abs(np.fft.rfft(centred, axis=0)) ** 2
    correlation = np.fft.irfft(power, n=n_frames, axis=0).sum(axis=1)
    correlation /= correlation[0]
    half = correlation[1 : n_frames // 2]
    positive = half[: int(np.argmax(half <= 0))] if (half <= 0).any() else half
    frames = n_frames / max(1.0, 1.0 + 2.0 * float(positive.sum()))
    eigenvalues = np.linalg.eigvalsh(centred.T @ centred)
    apparent = total**2 / float(np.sum(eigenvalues**2))
    channels = 1.0 / max(1.0 / apparent - 1.0 / frames, 1.0 / n_channels)
    return float(max(1.0, frames * channels))


def log_likelihood(
    emulator: Emulator, evidence: Evidence, levels: Floats, sigma: Floats, n_effective: float
) -> Floats:
    """Logarithm of the likelihood, (n,).

    Parameters
    ----------
    levels : (n, 4)
    sigma : (n,), m, standard deviation of one value: noise, emulator and model discrepancy
    n_effective : independent values among `evidence.n_values`
    """
    mean_square = evidence.squares(emulator, levels) / evidence.n_values
    return np.asarray(-0.5 * n_effective * (mean_square / sigma**2 + 2 * np.log(sigma)))
