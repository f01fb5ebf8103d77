"""Figures in docs/methods/torso.md and control.md: bends, the ball, what half the step changes.

`python scripts/torso_figures.py` writes `docs/figures/torso_figures.csv`; it takes about a quarter
of an hour on one core. `--part bends|ball|step` makes one part and leaves the other rows.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from sim.behaviour import run_controls
from sim.control.library import STYLES, find_controls
from sim.impact import IMPACT_STEP, drop_ball
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.spine import DIRECTIONS, spine_bend
from sim.model.torso import Subject
from sim.resting import RestingTorso, rest_torso
from sim.simulate import BREATH_STEP, replay, simulate
from sim.units import PASCAL_PER_CMH2O

OUT = Path(__file__).resolve().parents[1] / "docs" / "figures" / "torso_figures.csv"
MAN = Subject(sex="male", stature=1.756, mass=75.0)
FIELDS = ("part", "case", "figure", "value", "unit")
ASKED = np.radians(20.0)
BEND_TIME, BEND_RISE = 1.5, 0.6
"""s, length of a bend's run and of its rise."""
MASS, HEIGHT = 5.0, 0.5
"""kg and m, of the ball."""
STATED = ("tidal_volume_l", "peak_flow_l_s", "peak_gastric_pressure_cmh2o")
"""What half the step should leave as it is."""
Row = dict[str, str | float]


def bends(resting: RestingTorso) -> Iterator[Row]:
    """How far the skull turns, degrees, for 20 degrees asked."""
    n = round(BEND_TIME / BREATH_STEP)
    rise = ASKED * np.minimum(np.arange(n) * BREATH_STEP / BEND_RISE, 1.0)
    skull = resting.torso.skeleton.model.body("skull").id
    for direction in DIRECTIONS:
        run = simulate(
            resting, np.zeros((n, len(MUSCLE_GROUPS))), posture="upright", rate=10.0,
            bend=spine_bend(**{direction: rise}),
        )  # fmt: skip
        turned = replay(resting, run, np.zeros(0, dtype=np.int64)).rotation[:, skull]
        way = Rotation.from_matrix(turned[-1]) * Rotation.from_matrix(turned[0]).inv()
        degrees = float(np.degrees(way.magnitude()))
        yield {"case": direction, "figure": "turned", "value": degrees, "unit": "deg"}


def ball(resting: RestingTorso) -> Iterator[Row]:
    """Dent, volume error, pressure and what is left of the dent, at the step and at half of it."""
    for name, step in (("step", IMPACT_STEP), ("half the step", 0.5 * IMPACT_STEP)):
        done = drop_ball(resting, mass=MASS, height=HEIGHT, step=step)
        for figure, value, unit in (
            ("dent", 1e3 * done.dent.max(), "mm"),
            ("dent at the end", 1e3 * done.dent[-1], "mm"),
            ("volume error", 1e2 * np.abs(done.volume_error).max(), "%"),
            ("pressure", done.pressure.max() / PASCAL_PER_CMH2O, "cmH2O"),
        ):
            yield {"case": name, "figure": figure, "value": float(value), "unit": unit}


def steps(resting: RestingTorso) -> Iterator[Row]:
    """Change of what is stated when the step of a behaviour is halved, percent."""
    for style in STYLES:
        controls = find_controls(style)
        duration = controls.run_duration
        if duration is None:
            continue
        found = [
            run_controls(resting, controls, posture="upright", duration=duration, step=h).figures()
            for h in (controls.run_step, 0.5 * controls.run_step)
        ]
        for figure in STATED:
            change = 1e2 * abs(found[0][figure] / found[1][figure] - 1.0)
            yield {"case": style, "figure": figure, "value": change, "unit": "%"}


PARTS: dict[str, Callable[[RestingTorso], Iterator[Row]]] = {
    "bends": bends,
    "ball": ball,
    "step": steps,
}


def kept(chosen: list[str]) -> list[Row]:
    """Rows of the table that are not made anew."""
    if not OUT.is_file():
        return []
    with OUT.open(newline="", encoding="utf-8") as lines:
        return [dict(row) for row in csv.DictReader(lines) if row["part"] not in chosen]


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", choices=PARTS, action="append")
    chosen = parser.parse_args().part or list(PARTS)
    resting, rows = rest_torso(MAN), kept(chosen)
    for part in chosen:
        for row in PARTS[part](resting):
            rows.append({"part": part, **row, "value": f"{row['value']:.4g}"})
            print(*rows[-1].values(), flush=True)
    rows.sort(key=lambda row: list(PARTS).index(str(row["part"])))
    with OUT.open("w", newline="", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
