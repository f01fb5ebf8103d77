"""Posterior of the four levels: for the subject's mean, for the next breath, for each breath."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.breaths import recorded_cycles, signature_breath
from pipeline.cost import mean_cycle
from pipeline.density import Setting, marker_noise, sample_levels, set_up
from pipeline.designs import Designs, add_designs
from pipeline.emulator import MIN_RUNS
from pipeline.intervals import activation_rows, bounded_interval, correlations, identifiability
from pipeline.level_fit import bound_simulator, counted_markers
from pipeline.registration import Registration, as_recorded
from pipeline.sampling import Chains
from pipeline.scoring import Row
from pipeline.settings import FitSettings
from pipeline.spread import CycleSpread, cycle_spread

if TYPE_CHECKING:
    from pipeline.fit import FitResult
    from pipeline.markers import MarkerRecording
    from pipeline.model import BreathModel
    from pipeline.settings import PosteriorSettings
    from pipeline.signature import BreathSignature

Floats = NDArray[np.float64]

OK = "ok"
NO_INTERVAL = "no interval"


@dataclass(frozen=True, kw_only=True, slots=True)
class Posterior:
    """Levels with their uncertainty.

    Parameters
    ----------
    status : "ok", or "no interval" with `why`
    draws : (n_ensembles, n_draws, 4), the subject's mean levels, cycle sampling included
    discrepancy : (n_ensembles, n_draws), m, scale of the model's misfit
    draws_without : (n_ensembles, n_draws, 4), the same with no discrepancy allowed
    next_breath : (n_ensembles, n_draws, 4), levels of a breath not yet seen
    tau, r_hat : (5,), levels and logarithm of the discrepancy
    convergence, converged : how the sampling went
    emulator_error : m, r.m.s. error of a value in plausible runs that it has not seen;
        emulator_share : its square over the residual variance; residual : m, r.m.s. of a value
    noise : m, of a value of the mean breath; n_effective : independent values of n_values
    correlation : (4, 4) between groups; identifiability : in plain language
    activations : rows of activations.csv
    """

    name: str
    groups: tuple[str, ...]
    status: str
    why: str
    draws: Floats
    discrepancy: Floats
    draws_without: Floats
    next_breath: Floats
    tau: Floats
    r_hat: Floats
    converged: bool
    convergence: str
    emulator_error: float
    emulator_share: float
    residual: float
    n_runs: int
    noise: float
    n_effective: float
    n_values: int
    correlation: Floats
    identifiability: tuple[str, ...]
    activations: tuple[Row, ...]
    seed: int
    settings: dict[str, Any]


@dataclass(frozen=True, kw_only=True, slots=True)
class _Parts:
    """What was sampled, and how breaths differ."""

    chains: Chains
    without: Chains
    spread: CycleSpread
    upper: float


def _simulate(
    fit: FitResult, back: tuple[int, ...], model: BreathModel, settings: FitSettings
) -> Callable[[Floats], Floats]:
    """Return a function from (n, 4) levels to displacement, NaN where a run failed."""
    registration = Registration(
        fit_scale=fit.fit_scale,
        rotation=fit.rotation,
        translation=fit.translation,
        points=fit.points,
        residual=fit.residual,
        landmarks=fit.landmarks,
        notes=(),
    )
    timing = (fit.inspiration_time, fit.expiration_time, fit.pause_time)
    rate = settings.frame_rate_hz
    simulator = bound_simulator(model, registration, fit.posture, timing, rate, fit.bend)

    def run(levels: Floats) -> Floats:
        runs = simulator.run(levels)
        positions = as_recorded(runs, registration, back)
        return np.asarray(positions - positions.mean(axis=1, keepdims=True))

    return run


def _no_figures(fit: FitResult, settings: PosteriorSettings, seed: int) -> dict[str, Any]:
    """Fields of a posterior before anything is known."""
    unknown = dict.fromkeys(("emulator_error", "emulator_share", "residual", "noise"), np.nan)
    return unknown | {
        "name": fit.name,
        "groups": fit.groups,
        "n_runs": len(fit.run_levels),
        "n_effective": np.nan,
        "n_values": 0,
        "seed": seed,
        "settings": dataclasses.asdict(settings),
    }


def _without_intervals(fit: FitResult, why: str, figures: dict[str, Any]) -> Posterior:
    n_cycles = len(fit.cycle_id)
    upper = fit.settings["upper_level"]
    rows = activation_rows("subject_mean", fit.name, fit.levels, n_cycles=n_cycles, upper=upper)
    for number, levels in zip(fit.cycle_id, fit.cycle_levels, strict=True):
        rows += activation_rows("cycle", str(number), levels, n_cycles=1, upper=upper)
    nothing = np.empty((0, 0, len(fit.groups)))
    return Posterior(
        status=NO_INTERVAL,
        why=why,
        draws=nothing,
        discrepancy=np.empty((0, 0)),
        draws_without=nothing,
        next_breath=nothing,
        tau=np.empty(0),
        r_hat=np.empty(0),
        converged=False,
        convergence=f"not sampled: {why}",
        correlation=np.empty((0, 0)),
        identifiability=(),
        activations=tuple(rows),
        **figures,
    )


def _scatter(draws: Floats, covariance: Floats, upper: float, rng: np.random.Generator) -> Floats:
    """Draws (..., 4) with normal scatter added, kept between the bounds."""
    shift = rng.multivariate_normal(np.zeros(4), covariance, size=draws.shape[:-1], method="eigh")
    return np.clip(draws + shift, 0.0, upper)


def _interval_rows(
    fit: FitResult, parts: _Parts, mean: Floats, following: Floats, probability: float
) -> list[Row]:
    """Rows for the subject's mean, the next breath if breaths tell, and every breath."""
    n_cycles, upper = len(fit.cycle_id), parts.upper
    rows: list[Row] = []
    for scope, draws in (("subject_mean", mean), ("next_breath", following)):
        if scope == "next_breath" and not parts.spread.known:
            continue
        flat = draws.reshape(-1, draws.shape[-1])
        rows += activation_rows(
            scope,
            fit.name,
            np.median(flat, axis=0),
            n_cycles=n_cycles,
            upper=upper,
            probability=probability,
            interval=[bounded_interval(column, probability, upper) for column in flat.T],
        )
    reach = NormalDist().inv_cdf(0.5 + probability / 2) * parts.spread.deviation
    for number, levels, half in zip(fit.cycle_id, fit.cycle_levels, reach, strict=True):
        low, high = np.clip(levels - half, 0, upper), np.clip(levels + half, 0, upper)
        rows += activation_rows(
            "cycle",
            str(number),
            levels,
            n_cycles=1,
            upper=upper,
            probability=probability,
            interval=list(zip(low.tolist(), high.tolist(), strict=True)),
        )
    return rows


def _with_intervals(
    fit: FitResult, parts: _Parts, settings: PosteriorSettings, figures: dict[str, Any]
) -> Posterior:
    rng = np.random.default_rng([figures["seed"], 2])
    covariance, upper = parts.spread.covariance, parts.upper
    levels = parts.chains.draws[..., :4]
    # the breaths seen are a sample: their mean is not yet the subject's
    sampling = covariance / max(len(fit.cycle_id), 1)
    mean = _scatter(levels, sampling, upper, rng)
    following = _scatter(mean, covariance, upper, rng)
    flat = mean.reshape(-1, 4)
    return Posterior(
        status=OK,
        why="",
        draws=mean,
        discrepancy=np.exp(parts.chains.draws[..., 4]),
        draws_without=_scatter(parts.without.draws[..., :4], sampling, upper, rng),
        next_breath=following,
        tau=parts.chains.tau,
        r_hat=parts.chains.r_hat,
        converged=parts.chains.converged and parts.without.converged,
        convergence=f"{parts.chains.words}; without discrepancy {parts.without.words}",
        correlation=correlations(flat),
        identifiability=identifiability(flat, fit.groups, upper),
        activations=tuple(_interval_rows(fit, parts, mean, following, settings.probability)),
        **figures,
    )


def sample_posterior(
    fit: FitResult,
    recording: MarkerRecording,
    signature: BreathSignature,
    model: BreathModel,
    settings: PosteriorSettings,
    seed: int,
) -> Posterior:
    """Give the levels of a fit intervals.

    Parameters
    ----------
    model : the same torso as the fit's
    seed : of designs and chains; the result is the same for any number of workers
    """
    fit_settings = FitSettings(**fit.settings)
    if len(fit.run_levels) < MIN_RUNS:
        why = (
            f"only {len(fit.run_levels)} runs of the torso succeeded, an emulator needs {MIN_RUNS}"
        )
        return _without_intervals(fit, why, _no_figures(fit, settings, seed))
    markers = counted_markers(recording, fit_settings.markers)
    target = signature_breath(signature).at(fit.time)
    noise = marker_noise(recording, len(fit.cycle_id), settings.noise_floor_m)
    upper = fit_settings.upper_level

    def prepare(designs: Designs) -> Setting:
        return set_up(
            designs.emulator,
            target,
            markers,
            fit.levels,
            noise,
            settings.discrepancy_scale_m,
            upper,
        )

    designs = add_designs(
        Designs.of_runs(fit.run_levels, fit.run_displacement),
        prepare,
        _simulate(fit, recording.back, model, fit_settings),
        settings,
        seed,
    )
    setting = prepare(designs)
    error = designs.plausible_error(setting)
    share = (error / setting.residual) ** 2
    setting = dataclasses.replace(setting, emulated=error)
    figures = _no_figures(fit, settings, seed) | {
        "emulator_error": error,
        "emulator_share": share,
        "residual": setting.residual,
        "n_runs": len(designs.levels),
        "noise": noise,
        "n_effective": setting.n_effective,
        "n_values": setting.evidence.n_values,
    }
    if share > settings.max_emulator_share:
        why = (
            f"the emulator's error is {100 * share:.0f} % of the residual variance, more than "
            f"{100 * settings.max_emulator_share:.0f} %. Raise posterior.n_design."
        )
        return _without_intervals(fit, why, figures)
    chains = sample_levels(setting, settings, seed, fixed=False)
    without = sample_levels(setting, settings, seed + 1, fixed=True)
    warped = mean_cycle(recorded_cycles(recording, signature, fit.cycle_id), fit.time)
    spread = cycle_spread(fit.cycle_levels, [warped[int(k)] for k in fit.cycle_id], setting)
    parts = _Parts(chains=chains, without=without, spread=spread, upper=upper)
    return _with_intervals(fit, parts, settings, figures)
