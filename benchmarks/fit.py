"""How long a fit's runs take: one breath run, a batch on one and two workers, a whole fit's worth.

`python benchmarks/fit.py` prints a Markdown table; medians of several runs. A fit makes
`fit.n_initial + fit.n_evaluations` runs of `config/config.yaml` and eight of checks.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

import numpy as np
import yaml

from sim.breaths import BreathSimulator
from sim.model.torso import Subject
from sim.resting import RestingTorso, rest_torso

MAN = Subject(sex="male", stature=1.756, mass=75.0)
CONFIG = Path(__file__).resolve().parents[1] / "config" / "config.yaml"
CHECKS = 8
"""Runs that move each level up and down."""


def breather(resting: RestingTorso, workers: int) -> BreathSimulator:
    """Twenty-two markers, a breath of 4 s."""
    marks = np.array(list(resting.landmarks("upright").values()))[:22]
    return BreathSimulator(
        torso=resting, posture="upright", attachments=resting.bind(marks, "upright"),
        inspiration_time=1.6, expiration_time=2.4, pause_time=0.4, rate=25.0, workers=workers,
    )  # fmt: skip


def seconds_per_run(resting: RestingTorso, workers: int, batch: int) -> float:
    """Wall time of a batch over its runs, s."""
    levels = np.random.default_rng(1).uniform(0.0, 0.3, (batch, 4)) ** 2
    simulator = breather(resting, workers)
    start = time.perf_counter()
    runs = simulator.run(levels)
    wall = time.perf_counter() - start
    if runs.failed.any():
        raise SystemExit(f"{int(runs.failed.sum())} of {batch} runs failed: nothing to compare")
    return wall / batch


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5, help="batches a median is taken over")
    parser.add_argument("--batch", type=int, default=8, help="runs of a batch")
    options = parser.parse_args()
    fit = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))["fit"]
    n_runs = fit["n_initial"] + fit["n_evaluations"] + CHECKS
    start = time.perf_counter()
    resting = rest_torso(MAN)
    built = time.perf_counter() - start
    breather(resting, 1).run(np.zeros((1, 4)))
    print(f"build and rest: {built:.1f} s\n")
    print(f"| workers | s a run (two breaths of 4 s), median | s for the {n_runs} runs of a fit |")
    print("|---|---|---|")
    for workers in (1, 2):
        found = [seconds_per_run(resting, workers, options.batch) for _ in range(options.repeats)]
        one = statistics.median(found)
        print(f"| {workers} | {one:.2f} | {n_runs * one:.0f} |")


if __name__ == "__main__":
    main()
