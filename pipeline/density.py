"""The posterior density of four levels and the model's discrepancy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline.cost import without_offset
from pipeline.emulator import Emulator, predict
from pipeline.likelihood import Evidence, effective_values, gather, log_likelihood
from pipeline.sampling import Chains, sample

if TYPE_CHECKING:
    from pipeline.markers import MarkerRecording
    from pipeline.settings import PosteriorSettings

Floats = NDArray[np.float64]

SMALLEST_DISCREPANCY = 1e-6
LARGEST_DISCREPANCY = 0.1
"""m, bounds of the sampled scale."""
START_SPREAD = 0.02
"""of the walkers' first levels"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Setting:
    """What the density needs: emulator, data and scales (m)."""

    emulator: Emulator
    evidence: Evidence
    target: Floats
    markers: NDArray[np.int64]
    n_effective: float
    noise: float
    emulated: float
    scale: float
    upper: float
    best: Floats
    residual: float


def marker_noise(recording: MarkerRecording, n_cycles: int, floor: float) -> float:
    """Estimate the noise (m) of a value of the mean breath from the recording's fast flicker.

    Third differences see noise and hardly any breath. Files that were low-passed look noiseless,
    so the instrument's own error is the least that is believed.
    """
    third = np.diff(recording.positions, n=3, axis=0)
    finite = third[np.isfinite(third)]
    fast = float(np.sqrt(np.mean(finite**2) / 20.0)) if len(finite) else 0.0
    return float(max(floor, fast / max(n_cycles, 1) ** 0.5))


def set_up(
    emulator: Emulator,
    target: Floats,
    markers: NDArray[np.int64],
    best: Floats,
    noise: float,
    scale: float,
    upper: float,
) -> Setting:
    """Bring emulator and data together.

    Parameters
    ----------
    target : (n_frames, n_markers, 3), m, the measured mean breath
    markers : (n,), indices of the markers that count
    best : (4,), levels where the residual is judged; noise, scale : m, as in `Setting`
    """
    evidence = gather(emulator, target, markers)
    difference = without_offset(target - predict(emulator, best[None])[0])[:, markers]
    channels = difference.reshape(len(difference), -1)
    channels = channels[:, np.isfinite(channels).all(axis=0)]
    return Setting(
        emulator=emulator,
        evidence=evidence,
        target=target,
        markers=markers,
        n_effective=effective_values(channels),
        noise=noise,
        emulated=0.0,
        scale=scale,
        upper=upper,
        best=best,
        residual=float(np.sqrt(evidence.squares(emulator, best[None])[0] / evidence.n_values)),
    )


def _log_density(setting: Setting, points: Floats, *, fixed: bool) -> Floats:
    """Log posterior (n,) at (n, 5) points: four levels, logarithm of the discrepancy in m."""
    levels, log_scale = points[:, :4], points[:, 4]
    inside = ((levels >= 0) & (levels <= setting.upper)).all(axis=1)
    inside &= (log_scale > np.log(SMALLEST_DISCREPANCY)) & (log_scale < np.log(LARGEST_DISCREPANCY))
    result = np.full(len(points), -np.inf)
    if not inside.any():
        return result
    scale = np.exp(log_scale[inside])
    # half-normal in the scale, and the Jacobian of its logarithm
    prior = -0.5 * (scale / setting.scale) ** 2 + log_scale[inside]
    discrepancy = np.zeros_like(scale) if fixed else scale
    sigma = np.sqrt(setting.noise**2 + setting.emulated**2 + discrepancy**2)
    likelihood = log_likelihood(
        setting.emulator, setting.evidence, levels[inside], sigma, setting.n_effective
    )
    result[inside] = likelihood + prior
    return result


def _starts(setting: Setting, settings: PosteriorSettings, seed: int) -> list[Floats]:
    rng = np.random.default_rng([seed, 1])
    starts = []
    for _ in range(settings.n_ensembles):
        size = (settings.n_walkers, 4)
        levels = np.abs(setting.best + START_SPREAD * rng.normal(size=size))
        levels = np.minimum(levels, setting.upper - START_SPREAD * rng.random(size))
        guess = np.log(max(min(setting.residual, setting.scale), 10 * SMALLEST_DISCREPANCY))
        log_scale = guess + 0.3 * rng.normal(size=(settings.n_walkers, 1))
        starts.append(np.hstack([levels, log_scale]))
    return starts


def sample_levels(
    setting: Setting, settings: PosteriorSettings, seed: int, *, fixed: bool
) -> Chains:
    """Sample levels and discrepancy; `fixed` allows no discrepancy."""
    return sample(
        lambda points: _log_density(setting, points, fixed=fixed),
        _starts(setting, settings, seed),
        seed,
        max_steps=settings.max_steps,
        min_taus=settings.min_taus,
        n_draws=settings.n_draws,
    )
