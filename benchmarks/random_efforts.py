"""Run many random efforts and say how many diverge: `python benchmarks/random_efforts.py [n]`."""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from sim.errors import UnstableSimulation
from sim.model.torso import Subject
from sim.random_effort import KINDS, random_effort
from sim.resting import rest_torso
from sim.simulate import BREATH_STEP, simulate

MAN = Subject(sex="male", stature=1.756, mass=75.0)


def main() -> None:
    """Print the sets that diverge, then the extremes of those that do not."""
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0] + ".")
    parser.add_argument("n", type=int, nargs="?", default=1000, help="how many")
    n = int(parser.parse_args().n)
    resting = rest_torso(MAN)

    def one(seed: int) -> tuple[float, float, float, float] | None:
        try:
            run = simulate(resting, random_effort(seed, step=BREATH_STEP), posture="upright")
        except UnstableSimulation as why:
            print(f"{seed} ({KINDS[seed % len(KINDS)]}): {why}", flush=True)
            return None
        error = float(np.abs(run.abdomen / run.abdomen[0] - 1.0).max())
        return error, float(run.lung.min()), float(run.lung.max()), float(run.abdominal.max())

    start = time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        found = [figures for figures in pool.map(one, range(n)) if figures is not None]
    wall = time.perf_counter() - start
    error, least, most, pressure = np.array(found).T
    print(f"{n - len(found)} of {n} diverged; {wall:.0f} s for {n} runs of 1 s on two threads")
    print(f"largest abdomen volume error {100 * error.max():.2f} %")
    print(f"lung volume {1e3 * least.min():.2f} to {1e3 * most.max():.2f} L")
    print(f"largest abdominal pressure {pressure.max() / 98.0665:.0f} cmH2O")


if __name__ == "__main__":
    main()
