"""How loudness becomes pressure: the line or the power law, and what is not known about it."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from sim.units import PASCAL_PER_CMH2O

Floats = NDArray[np.float64]

TABLE = Path(__file__).parent / "tables" / "sound_pressure.csv"
LINEAR, POWER = "linear", "power"
N_SCALES, N_SHAPES, N_LEVELS, N_BINS = 81, 61, 80, 10


def _middles(n: int) -> Floats:
    """Middles of n equal steps of probability."""
    return (np.arange(n) + 0.5) / n


def constants() -> dict[str, float]:
    """Numbers of tables/sound_pressure.csv."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {row["name"]: float(row["value"]) for row in csv.DictReader(file)}


@dataclass(frozen=True, kw_only=True, slots=True)
class PressureMap:
    """Pressure over its mean peak, q, from loudness over its mean peak, e, and a person's scale.

    Parameters
    ----------
    form : LINEAR, q = offset + slope e (dilorenzo2009 §6.3), or POWER, q = slope e^exponent
    offset, slope, exponent : of the form
    levels : (n_bins,), loudness at which the scatter is known
    scatter : (n_bins, N_SHAPES), quantiles of q about the form there
    scale : Pa, median of the mean peak pressure of a new speaker
    scale_log_sd, scale_freedom : of its logarithm, a t distribution; infinity is a normal one
    quiet : low, middle, high quantile of q where there is no sound
    n_subjects : calibrated people; 0 is an assumption and no calibration
    """

    form: str
    offset: float
    slope: float
    exponent: float
    levels: Floats
    scatter: Floats
    scale: float
    scale_log_sd: float
    scale_freedom: float
    quiet: tuple[float, float, float]
    n_subjects: int

    def shape(self, loudness: Floats) -> Floats:
        """Pressure in mean peaks, never under nothing where there is sound."""
        return np.maximum(0.0, self.offset + self.slope * loudness**self.exponent)

    def band(self, loudness: Floats, probability: float) -> tuple[Floats, Floats]:
        """Low and high pressure, Pa, that hold a new speaker's with `probability`.

        The speaker's scale (a t distribution of the logarithm) times the shape (scattered about
        the form) is sampled at the middles of equal steps of probability, no random numbers; over
        a grid of loudness, then read off by straight lines.
        """
        spread = stats.t.ppf(_middles(N_SCALES), self.scale_freedom)
        scales = self.scale * np.exp(self.scale_log_sd * spread)
        grid = np.linspace(0.0, max(float(loudness.max()), 1e-6), N_LEVELS)
        about = np.stack([np.interp(grid, self.levels, one) for one in self.scatter.T], axis=1)
        q = self.shape(grid)[:, None] + about
        tails = [(1 - probability) / 2, (1 + probability) / 2]
        low, high = np.quantile((q[:, :, None] * scales).reshape(N_LEVELS, -1), tails, axis=1)
        return np.interp(loudness, grid, low), np.interp(loudness, grid, high)

    def quiet_band(self, probability: float) -> tuple[float, float]:
        """Low and high pressure, Pa, where there is no sound."""
        tail = (1 - probability) / 2
        wide = self.scale * np.exp(self.scale_log_sd * stats.t.ppf(1 - tail, self.scale_freedom))
        low, _, high = self.quiet
        return min(0.0, low * wide), max(0.0, high * wide)


def assumed_map(form: str, sex: str) -> PressureMap:
    """Return what is taken without a calibration recording: proportional, on an assumed scale."""
    of = constants()
    return PressureMap(
        form=form,
        offset=0.0,
        slope=1.0,
        exponent=1.0 if form == LINEAR else of[f"power_{sex}"],
        levels=np.zeros(1),
        scatter=of["assumed_residual"] * stats.norm.ppf(_middles(N_SHAPES))[None, :],
        scale=PASCAL_PER_CMH2O * of["assumed_mean_peak"],
        scale_log_sd=of["assumed_log_sd"],
        scale_freedom=float("inf"),
        quiet=(of["quiet_low"], 0.0, of["quiet_high"]),
        n_subjects=0,
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class CalibratedSubject:
    """Loudness and measured pressure of one person, both over their mean peak.

    Parameters
    ----------
    name : of the subject
    loudness, filtered, measured : (n,), at RATE; `filtered` went through the sound's own low-pass
    active : (n,), where there is sound
    mean_peak : Pa
    """

    name: str
    loudness: Floats
    filtered: Floats
    measured: Floats
    active: NDArray[np.bool_]
    mean_peak: float


def fit_map(subjects: Sequence[CalibratedSubject], form: str) -> PressureMap:
    """Fit the form to calibrated people, each with equal weight.

    The form is fitted to low-passed pressure, as published; its scatter is taken about the
    pressure as measured, which is what a torso must follow.
    """
    of = constants()
    n = len(subjects)
    loudness = [one.loudness[one.active] for one in subjects]
    filtered = [one.filtered[one.active] for one in subjects]
    measured = [one.measured[one.active] for one in subjects]
    weight = np.concatenate([np.full(len(e), 1.0 / len(e)) for e in loudness])
    e, q, raw = np.concatenate(loudness), np.concatenate(filtered), np.concatenate(measured)
    offset, slope, exponent = _form(form, e, q, weight)
    rest = raw - np.maximum(0.0, offset + slope * e**exponent)
    levels, scatter = _scatter(e, rest)
    # a few people stand for all
    factor = float(np.sqrt(1.0 + 1.0 / n))
    if n == 1:
        # how another person's curve lies about this one was not seen
        scatter = scatter + of["single_subject_shape"] * stats.norm.ppf(_middles(N_SHAPES))
    logs = np.log([one.mean_peak for one in subjects])
    freedom = of["prior_freedom"] + n - 1
    square = of["prior_freedom"] * of["prior_log_sd"] ** 2 + float(
        ((logs - logs.mean()) ** 2).sum()
    )
    quiet = [one.measured[~one.active] for one in subjects if (~one.active).any()]
    tails = np.array([of["quiet_low"], 0.0, of["quiet_high"]])
    if quiet:
        tails = np.quantile(np.concatenate(quiet), [0.05, 0.5, 0.95])
    return PressureMap(
        form=form,
        offset=offset,
        slope=slope,
        exponent=exponent,
        levels=levels,
        scatter=scatter,
        scale=float(np.exp(logs.mean())),
        scale_log_sd=factor * float(np.sqrt(square / freedom)),
        scale_freedom=freedom,
        quiet=(float(tails[0]), float(tails[1]), float(tails[2])),
        n_subjects=n,
    )


def _form(form: str, e: Floats, q: Floats, weight: Floats) -> tuple[float, float, float]:
    if form == LINEAR:
        slope, offset = np.polyfit(e, q, 1, w=np.sqrt(weight))
        return float(offset), float(slope), 1.0

    def power(level: Floats, slope: float, exponent: float) -> Floats:
        return slope * np.maximum(level, 1e-9) ** exponent

    (slope, exponent), _ = optimize.curve_fit(
        power, e, q, p0=(1.0, 0.6), sigma=1 / np.sqrt(weight), bounds=([0.0, 0.05], [10.0, 3.0])
    )
    return 0.0, float(slope), float(exponent)


def _scatter(e: Floats, rest: Floats) -> tuple[Floats, Floats]:
    """Quantiles of the residuals in bins of loudness that hold equally many samples."""
    order = np.argsort(e, kind="stable")
    bins = np.array_split(order, N_BINS)
    levels = np.array([float(np.median(e[one])) for one in bins])
    steps = _middles(N_SHAPES)
    return levels, np.stack([np.quantile(rest[one], steps) for one in bins])
