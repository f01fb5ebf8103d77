"""From a person's fitted breath to a slower, more diaphragmatic one, in steps that a torso reaches.

Each step asks for a rate, a tidal volume and the belly's share of it. External intercostals and
diaphragm are found that give them; expiratory muscles fade to rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.settings import RetrainingSettings
from sim.motion import Motion
from sim.units import CUBIC_METRE_PER_LITRE

Floats = NDArray[np.float64]

MINUTE = 60.0
INSPIRATORY = 2
"""Groups that are searched for, the first of `pipeline.model.GROUPS`."""
PROBE = 0.1
"""Share by which a level is changed to see what it does."""
LEAST_PROBE = 0.005


@dataclass(frozen=True, kw_only=True, slots=True)
class Pattern:
    """A breath that is asked for.

    Parameters
    ----------
    inspiration, expiration, pause : s; the pause is part of the expiration
    tidal : m^3, that rib cage and belly sweep together
    belly_share : of it, by the belly wall
    expiratory : (2,), levels of internal intercostals and abdomen
    """

    inspiration: float
    expiration: float
    pause: float
    tidal: float
    belly_share: float
    expiratory: Floats

    @property
    def period(self) -> float:
        """Length of a breath, s."""
        return self.inspiration + self.expiration

    @property
    def rate(self) -> float:
        """Breaths a minute."""
        return MINUTE / self.period

    @property
    def volumes(self) -> Floats:
        """Volumes that rib cage and belly sweep, (2,), m^3."""
        return self.tidal * np.array([1.0 - self.belly_share, self.belly_share])


@dataclass(frozen=True, kw_only=True, slots=True)
class Breathed:
    """A breath as the torso did it.

    Parameters
    ----------
    volumes : (2,), m^3, that rib cage and belly sweep in the inspiration
    motion : its frames; figures : more of it, as `pipeline.breath_motion` names them
    """

    volumes: Floats
    motion: Motion
    figures: dict[str, Any]

    @property
    def tidal(self) -> float:
        """Both together, m^3."""
        return float(self.volumes.sum())

    @property
    def belly_share(self) -> float:
        """Share of the belly wall."""
        return float(self.volumes[1] / self.volumes.sum())


@dataclass(frozen=True, kw_only=True, slots=True)
class Step:
    """A step of the retraining.

    Parameters
    ----------
    asked : the breath; levels : (4,), that do it; breathed : what came of them
    error : largest difference of a swept volume from the one asked for, over the tidal volume
    n_runs : of the torso
    """

    asked: Pattern
    levels: Floats
    breathed: Breathed
    error: float
    n_runs: int


Player = Callable[[Pattern, Floats], Breathed]
"""Runs a breath with the timing of a pattern and (4,) levels."""


def alveolar_tidal(tidal: float, rate: float, slower: float, dead_space: float) -> float:
    """Tidal volume that ventilates the alveoli as much at a slower rate, m^3.

    (V − D) f = (V' − D) f'; a breath that is all dead space keeps its volume.

    Parameters
    ----------
    tidal, dead_space : m^3; rate, slower : breaths in the same time
    """
    return dead_space + (tidal - dead_space) * rate / slower if tidal > dead_space else tidal


def patterns(own: Pattern, settings: RetrainingSettings, mass: float) -> list[Pattern]:
    """Breaths from the person's own to the target, in even steps; the first is their own.

    A person who breathes slower, or more with the belly, than the target keeps that.

    Parameters
    ----------
    own : the fitted breath
    mass : kg, for the dead space
    """
    dead = settings.dead_space_ml_per_kg * mass * 1e-3 * CUBIC_METRE_PER_LITRE
    rate = min(own.rate, settings.rate_per_min)
    belly = max(own.belly_share, settings.belly_share)
    out = [own]
    for share in np.linspace(0.0, 1.0, settings.n_steps + 1)[1:].tolist():
        period = MINUTE / (own.rate + share * (rate - own.rate))
        inward = own.inspiration / own.period
        inward += share * (settings.inspiration_share - inward)
        expiration = (1.0 - inward) * period
        out.append(
            Pattern(
                inspiration=inward * period,
                expiration=expiration,
                pause=own.pause / own.expiration * expiration,
                tidal=alveolar_tidal(own.tidal, own.rate, MINUTE / period, dead),
                belly_share=own.belly_share + share * (belly - own.belly_share),
                expiratory=(1.0 - share) * own.expiratory,
            )
        )
    return out


def _levels(pair: Floats, asked: Pattern) -> Floats:
    return np.concatenate([pair, asked.expiratory])


def slopes(play: Player, asked: Pattern, pair: Floats, base: Breathed) -> Floats:
    """Change of the swept volumes with each inspiratory level, (2, 2), m^3.

    Parameters
    ----------
    pair : (2,), levels of external intercostals and diaphragm; base : what they give
    """
    columns = []
    for k in range(INSPIRATORY):
        moved = pair.copy()
        moved[k] += max(PROBE * pair[k], LEAST_PROBE)
        done = play(asked, _levels(moved, asked))
        columns.append((done.volumes - base.volumes) / (moved[k] - pair[k]))
    return np.stack(columns, axis=1)


def _move(slope: Floats, miss: Floats, pair: Floats) -> Floats:
    """Levels in [0, 1] that make up for a miss by the slopes.

    Where one would leave the bounds it stays there, and the other does what it can for both.
    """
    wanted = pair + np.linalg.lstsq(slope, miss, rcond=None)[0]
    held = np.clip(wanted, 0.0, 1.0)
    out = wanted != held
    if out.any() and not out.all():
        left = miss - slope[:, out] @ (held - pair)[out]
        free = pair[~out] + np.linalg.lstsq(slope[:, ~out], left, rcond=None)[0]
        held[~out] = np.clip(free, 0.0, 1.0)
    return held


def reach(
    play: Player, asked: Pattern, pair: Floats, slope: Floats, settings: RetrainingSettings
) -> tuple[Step, Floats]:
    """Search the levels of one step by Broyden's method; return it and the corrected slopes.

    Parameters
    ----------
    pair : (2,), levels to begin with; slope : (2, 2), m^3, what is known of their effect
    """
    slope, best = slope.copy(), None
    done = play(asked, _levels(pair, asked))
    for run in range(1, settings.n_runs + 1):
        miss = asked.volumes - done.volumes
        error = float(np.abs(miss).max() / asked.tidal)
        if best is None or error < best.error:
            best = Step(
                asked=asked, levels=_levels(pair, asked), breathed=done, error=error, n_runs=run
            )
        best = replace(best, n_runs=run)
        moved = _move(slope, miss, pair)
        way = moved - pair
        if error <= settings.tolerance or run == settings.n_runs or not way.any():
            break
        after = play(asked, _levels(moved, asked))
        wrong = after.volumes - done.volumes - slope @ way
        slope = slope + np.outer(wrong, way) / float(way @ way)
        pair, done = moved, after
    assert best is not None
    return best, slope


def retrain(
    play: Player,
    asked: Sequence[Pattern],
    levels: Floats,
    base: Breathed,
    settings: RetrainingSettings,
) -> list[Step]:
    """Find every step, each from the one before it.

    Parameters
    ----------
    asked : as `patterns` makes them; the first is the person's own breath
    levels : (4,), of the fit; they are not searched for anew; base : what they gave
    """
    pair, own = levels[:INSPIRATORY].astype(float), asked[0]
    steps = [Step(asked=own, levels=levels, breathed=base, error=0.0, n_runs=1)]
    slope = slopes(play, own, pair, base)
    for one in asked[1:]:
        guess = _move(slope, one.volumes - steps[-1].breathed.volumes, pair)
        step, slope = reach(play, one, guess, slope, settings)
        steps.append(step)
        pair = step.levels[:INSPIRATORY]
    return steps
