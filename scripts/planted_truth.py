"""Plant muscle levels in the real torso, add marker noise, fit, and say how near the fit comes.

Usage: python scripts/planted_truth.py [--draws 20] [--workers 2]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import configuration, places
from pipeline.emulator import Emulator, predict
from pipeline.model import GROUPS, Simulator, TorsoModel
from pipeline.registration import Registration
from pipeline.scoring import Breath
from pipeline.settings import FitSettings
from pipeline.trials import Trials, first_runs, search
from sim.model.torso import Subject

Floats = NDArray[np.float64]

SUBJECT = Subject(sex="male", stature=1.756, mass=75.0)
UNIT = (1.0, 1.0, 1.0)
INSPIRATION, EXPIRATION, PAUSE = 1.7, 2.3, 0.4
LOW = np.array([0.05, 0.01, 0.0, 0.0])
HIGH = np.array([0.40, 0.12, 0.10, 0.05])
"""Levels from a shallow breath to one of about 1.5 L, with some active expiration."""
NOISE = 0.0005
"""m, standard deviation of every coordinate of every marker in every frame of one breath."""
SEED = 20260101
FLANK_DEG = 55.0
N_DESIGN = 80
N_POLISH = 4
SMALLEST, STEP = 0.005, 0.004
"""Laplace: levels are kept this far from 0, and moved by this much."""
CHEST = (
    "CLAV", "STRN", "XIPH", "C7", "T3", "T8", "T10",
    "LUCH", "RUCH", "LMCH", "RMCH", "LLCH", "RLCH",
)  # fmt: skip


@dataclass(kw_only=True, slots=True)
class Remembered:
    """A simulator that runs each set of levels once: all draws share one design."""

    simulator: Simulator
    known: dict[bytes, tuple[Floats, Floats, bool]]
    time: Floats

    def run(self, levels: Floats) -> Any:
        """Run (n, 4) levels, or remember them."""
        levels = np.ascontiguousarray(levels, dtype=float)
        new = np.array([row for row in levels if row.tobytes() not in self.known])
        if len(new):
            runs = self.simulator.run(new)
            self.time = np.asarray(runs.time)
            found = zip(runs.positions, runs.lung_volume, runs.failed, strict=True)
            self.known |= {row.tobytes(): run for row, run in zip(new, found, strict=True)}
        kept = [self.known[row.tobytes()] for row in levels]
        positions, volume, failed = (np.array(part) for part in zip(*kept, strict=True))
        return SimpleNamespace(
            time=self.time, positions=positions, lung_volume=volume, failed=failed
        )


def marker_set(model: TorsoModel) -> tuple[tuple[str, ...], Floats]:
    """22 names and places (22, 3), m: the usual landmarks and both flanks at navel height."""
    named = model.landmarks(UNIT, "upright")
    skin = model.surface(UNIT, "upright").vertices
    level = skin[np.abs(skin[:, 2] - named["NAVEL"][2]) < 0.03]
    for name, side in (("LABL", 1.0), ("RABL", -1.0)):
        angle = np.radians(FLANK_DEG)
        named[name] = level[np.argmax(level[:, :2] @ [np.cos(angle), side * np.sin(angle)])]
    return tuple(named), np.array(list(named.values()))


def prepare(workers: int) -> tuple[tuple[str, ...], Remembered, Registration]:
    """Names of the markers, the torso with them, and a registration that changes nothing."""
    model = TorsoModel(subject=SUBJECT, workers=workers)
    names, points = marker_set(model)
    simulator = model.simulator(
        UNIT,
        "upright",
        points,
        inspiration_time=INSPIRATION,
        expiration_time=EXPIRATION,
        pause_time=PAUSE,
        rate=25.0,
    )
    still = Registration(
        fit_scale=UNIT,
        rotation=np.eye(3),
        translation=np.zeros(3),
        points=points,
        residual=np.zeros(len(points)),
        landmarks=names,
        notes=(),
    )
    return names, Remembered(simulator=simulator, known={}, time=np.empty(0)), still


def draw_levels(n: int) -> Floats:
    """Levels to be planted, (n, 4)."""
    return np.random.default_rng(SEED).uniform(LOW, HIGH, size=(n, len(LOW)))


def fit_draw(
    truth: Floats, number: int, torso: Remembered, still: Registration, settings: FitSettings
) -> Trials:
    """Simulate, add noise, search: the trials, whose best run is the fit."""
    runs = torso.run(truth[None])
    noise = np.random.default_rng([SEED, number]).normal(scale=NOISE, size=runs.positions[0].shape)
    breath = Breath(
        time=np.asarray(runs.time),
        positions=runs.positions[0] + noise,
        period=INSPIRATION + EXPIRATION,
    )
    counted = np.arange(len(still.points))
    trials = Trials(torso, still, breath, counted, (), settings)
    first_runs(trials, N_DESIGN, SEED)
    search(trials, N_POLISH, SEED + number)
    return trials


def laplace(emulator: Emulator, levels: Floats, chosen: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Deviations (4,) and correlations (4, 4) of the levels for `NOISE` on the chosen markers."""
    middle = np.maximum(levels, SMALLEST)
    steps = STEP * np.eye(len(levels))
    change = predict(emulator, middle + steps) - predict(emulator, middle - steps)
    slope = (change[:, :, chosen] / (2 * STEP)).reshape(len(levels), -1)
    covariance = NOISE**2 * np.linalg.inv(slope @ slope.T)
    deviation = np.sqrt(np.diag(covariance))
    return deviation, np.asarray(covariance / np.outer(deviation, deviation))


def recover(
    n_draws: int, settings: FitSettings, prepared: tuple[tuple[str, ...], Remembered, Registration]
) -> dict[str, Any]:
    """Plant, fit and compare.

    Returns
    -------
    planted, fitted (n_draws, 4); median_error and largest_error by group; deviation by group and
    correlation by pair of groups (Laplace, mean over the draws), with all markers and with those
    of the chest alone
    """
    names, torso, still = prepared
    planted = draw_levels(n_draws)
    trials = [
        fit_draw(truth, number, torso, still, settings) for number, truth in enumerate(planted)
    ]
    fitted = np.array([one.levels[one.best] for one in trials])
    error = np.abs(fitted - planted)
    emulator = trials[-1].emulator()
    found: dict[str, Any] = {
        "planted": planted,
        "fitted": fitted,
        "median_error": dict(zip(GROUPS, np.median(error, axis=0).tolist(), strict=True)),
        "largest_error": dict(zip(GROUPS, error.max(axis=0).tolist(), strict=True)),
        "n_runs": len(torso.known),
    }
    chest = np.array([k for k, name in enumerate(names) if name in CHEST])
    for prefix, chosen in (("", np.arange(len(names))), ("chest_", chest)):
        each = [laplace(emulator, truth, chosen) for truth in planted]
        deviation, mean = (np.mean(part, axis=0) for part in zip(*each, strict=True))
        found[f"{prefix}deviation"] = dict(zip(GROUPS, deviation.tolist(), strict=True))
        found[f"{prefix}correlation"] = {
            f"{GROUPS[a]}, {GROUPS[b]}": float(mean[a, b])
            for a in range(len(GROUPS))
            for b in range(a)
        }
    return found


def main() -> None:
    """Print the figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    values = configuration.read_yaml(places.default_config())["fit"]
    settings = configuration.section("fit", values, "config.yaml")
    found = recover(options.draws, settings, prepare(options.workers))
    shown = {key: v.tolist() if isinstance(v, np.ndarray) else v for key, v in found.items()}
    print(json.dumps(shown, indent=2))


if __name__ == "__main__":
    main()
