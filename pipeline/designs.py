"""Further runs of the torso where the levels are plausible, and what they say of the emulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.density import Setting, sample_levels
from pipeline.emulator import Emulator, build_emulator, held_out_error
from pipeline.settings import PosteriorSettings

Floats = NDArray[np.float64]

WIDENED = 3.0
"""Factor on the residual while designs are drawn: look wider than believed."""
N_CHECKED = 20
"""Likeliest runs whose held-out error stands for the emulator's."""
N_FOLDS = 3
DRAFT_STEPS = 250


@dataclass(frozen=True, kw_only=True, slots=True)
class Designs:
    """Runs (n, 4) that did not fail, their displacement, and the emulator of all of them."""

    levels: Floats
    displacement: Floats
    emulator: Emulator

    @classmethod
    def of_runs(cls, levels: Floats, displacement: Floats) -> Designs:
        """Make the emulator of some runs."""
        emulator = build_emulator(levels, displacement)
        return cls(levels=levels, displacement=displacement, emulator=emulator)

    def plausible_error(self, setting: Setting) -> float:
        """Held-out error (m) of a value in the likeliest runs."""
        squares = setting.evidence.squares(self.emulator, self.levels)
        likeliest = np.argsort(squares, kind="stable")[:N_CHECKED]
        return held_out_error(self.levels, self.displacement, likeliest, N_FOLDS)


def spread_choice(candidates: Floats, existing: Floats, n: int) -> Floats:
    """Choose n candidates, each the farthest from all runs so far, in square roots of levels."""
    points = np.sqrt(candidates)
    distance = np.min(np.linalg.norm(points[:, None] - np.sqrt(existing)[None], axis=-1), axis=1)
    chosen = []
    for _ in range(min(n, len(candidates))):
        k = int(np.argmax(distance))
        chosen.append(k)
        distance = np.minimum(distance, np.linalg.norm(points - points[k], axis=-1))
    return candidates[chosen]


def add_designs(
    designs: Designs,
    prepare: Callable[[Designs], Setting],
    simulate: Callable[[Floats], Floats],
    settings: PosteriorSettings,
    seed: int,
) -> Designs:
    """Run the rest of the design in rounds, each spread over what the last one made plausible.

    Parameters
    ----------
    prepare : the density's ingredients for the runs so far
    simulate : (n, 4) levels to displacement (n, n_frames, n_markers, 3), m, NaN for a failed run
    """
    missing = max(0, settings.n_design - len(designs.levels))
    sizes = [len(part) for part in np.array_split(np.arange(missing), max(settings.n_rounds, 1))]
    for number, size in enumerate(sizes):
        if size == 0:
            continue
        draft = _draft(prepare(designs), settings, seed + number)
        levels = spread_choice(draft, designs.levels, size)
        displacement = simulate(levels)
        good = np.isfinite(displacement).all(axis=(1, 2, 3))
        designs = Designs.of_runs(
            np.vstack([designs.levels, levels[good]]),
            np.concatenate([designs.displacement, displacement[good]]),
        )
    return designs


def _draft(setting: Setting, settings: PosteriorSettings, seed: int) -> Floats:
    """Levels (n, 4) from a short chain of a widened posterior."""
    wide = dataclasses.replace(
        setting,
        noise=WIDENED * max(setting.noise, setting.residual),
        n_effective=min(setting.n_effective, 100.0),
    )
    short = dataclasses.replace(settings, max_steps=DRAFT_STEPS, n_ensembles=1, min_taus=10**6)
    return np.asarray(sample_levels(wide, short, seed, fixed=True).draws[0, :, :4])
