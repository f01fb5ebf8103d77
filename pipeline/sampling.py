"""emcee: independent ensembles until their autocorrelation is known, and words for how it went."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import emcee
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LogDensity = Callable[[Floats], Floats]

BURN_TAUS = 5
"""Autocorrelation times thrown away at the beginning of a chain."""
MARGIN = 1.05
"""Longer than asked for by this factor, as the burn-in is rounded."""
CHUNK = 250
GOOD_R_HAT = 1.02


@dataclass(frozen=True, kw_only=True, slots=True)
class Chains:
    """Draws of several ensembles.

    Parameters
    ----------
    draws : (n_ensembles, n_draws, n_parameters), thinned
    tau : (n_parameters,), steps, the largest of the ensembles; r_hat : (n_parameters,)
    n_steps : of each ensemble after the burn-in; acceptance : share of accepted moves
    converged : whether `words` say so
    """

    draws: Floats
    tau: Floats
    r_hat: Floats
    n_steps: int
    acceptance: float
    converged: bool
    words: str


class _Ensemble:
    """One ensemble and where its random numbers stand."""

    def __init__(self, log_density: LogDensity, start: Floats, seed: int) -> None:
        moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DESnookerMove(), 0.2)]
        self.sampler = emcee.EnsembleSampler(*start.shape, log_density, moves=moves, vectorize=True)
        # emcee knows no Generator
        self.state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())

    def advance(self, n_steps: int) -> Floats:
        """Walk on; autocorrelation times (n_parameters,) so far, steps."""
        self.state = self.sampler.run_mcmc(self.state, n_steps)
        chain = self.sampler.get_chain()
        return np.asarray(emcee.autocorr.integrated_time(chain, tol=0, has_walkers=True))


def _r_hat(ensembles: list[Floats]) -> Floats:
    """Spread between the ensembles' means beside that within: 1 when they agree."""
    if len(ensembles) == 1:
        return np.full(ensembles[0].shape[-1], np.nan)
    flat = [chain.reshape(-1, chain.shape[-1]) for chain in ensembles]
    within = np.mean([part.var(axis=0) for part in flat], axis=0)
    between = np.var([part.mean(axis=0) for part in flat], axis=0, ddof=1)
    return np.asarray(np.sqrt(1 + between / np.maximum(within, 1e-300)))


def _thin(chain: Floats, n_draws: int) -> Floats:
    flat = chain.reshape(-1, chain.shape[-1])
    return np.asarray(flat[np.linspace(0, len(flat) - 1, n_draws).astype(int)])


def sample(
    log_density: LogDensity,
    starts: list[Floats],
    seed: int,
    *,
    max_steps: int,
    min_taus: int,
    n_draws: int,
) -> Chains:
    """Sample a density with differential evolution and snooker moves.

    Parameters
    ----------
    log_density : (n, n_parameters) -> (n,)
    starts : one (n_walkers, n_parameters) for each ensemble
    max_steps, min_taus : a chain ends at `min_taus` autocorrelation times, or at `max_steps`
    n_draws : kept of each ensemble
    """
    seeds = np.random.SeedSequence(seed).generate_state(len(starts))
    ensembles = [
        _Ensemble(log_density, start, int(own)) for start, own in zip(starts, seeds, strict=True)
    ]
    done, tau = 0, np.full(starts[0].shape[1], np.inf)
    while done < max_steps and done < MARGIN * (min_taus + BURN_TAUS) * np.max(tau):
        step = min(CHUNK, max_steps - done)
        tau = np.max([ensemble.advance(step) for ensemble in ensembles], axis=0)
        done += step
    burn = min(int(np.ceil(BURN_TAUS * np.max(tau))), done // 2)
    kept = [np.asarray(ensemble.sampler.get_chain())[burn:] for ensemble in ensembles]
    r_hat = _r_hat(kept)
    n_steps = done - burn
    taus = n_steps / float(np.max(tau))
    converged = taus >= min_taus and float(np.max(r_hat)) < GOOD_R_HAT
    figures = (
        f"{len(starts)} ensembles of {n_steps} steps, autocorrelation time "
        f"{np.max(tau):.0f} steps, {taus:.0f} of them long, R-hat {np.max(r_hat):.3f}"
    )
    return Chains(
        draws=np.stack([_thin(chain, n_draws) for chain in kept]),
        tau=tau,
        r_hat=r_hat,
        n_steps=n_steps,
        acceptance=float(np.mean([e.sampler.acceptance_fraction for e in ensembles])),
        converged=converged,
        words=("converged: " if converged else "NOT converged, read as provisional: ") + figures,
    )
