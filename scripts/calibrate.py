"""Redo the calibration ladder, steps (a) to (f), with the present torso.

`python scripts/calibrate.py` writes `docs/figures/calibration_*.svg` and
`docs/figures/calibration.csv`: every figure beside its target and the source of the target. It
takes a few minutes on one core.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib as mpl
import numpy as np
from calibration_efforts import step_e, step_f
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from rib_swing import rib_swing

from sim.bench import Bench
from sim.model.torso import Subject, lung_capacity
from sim.physics.types import Floats
from sim.resting import RestingTorso, rest_torso
from sim.statics import (
    LITRE,
    airway_pressure,
    as_arrays,
    belly_inflation,
    closed_effort,
    compliance,
    diaphragm_rise,
    open_effort,
    relaxation,
)
from sim.units import PASCAL_PER_CMH2O as CMH2O

MAN = Subject(sex="male", stature=1.756, mass=75.0)
OUT = Path(__file__).resolve().parents[1] / "docs" / "figures"
BELLY = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5]) * LITRE
FREE_BELLY = np.append(BELLY, np.array([3.0, 3.5, 4.0]) * LITRE)
"""A free diaphragm makes way for a part of the gas: more of it for the same pressure."""
PLEURAL = np.array([-25, -20, -15, -10, -7.5, -4, -2.5, -1, 0, 2.5, 5, 9]) * CMH2O
VOLUMES = np.array([1.7, 2.4, 3.289, 4.5, 5.7]) * LITRE
SONG, ESTENNE = "Song 2006", "Estenne 1985"
Row = tuple[str, str, float, str, str, str]


def frc(resting: RestingTorso) -> float:
    """Predicted FRC, L."""
    return lung_capacity(resting.torso.subject)["frc"] / LITRE


def step_a(resting: RestingTorso, axes: Axes) -> list[Row]:
    """One rib swinging."""
    swing = rib_swing(resting)
    axes.plot(swing.time, np.degrees(swing.angle), label="simulated")
    axes.plot(swing.time, np.degrees(swing.closed_form()), "--", label="closed form")
    axes.set(xlabel="time (s)", ylabel="rib 5 about its neck (deg)", xlim=(0, 0.5))
    axes.legend()
    return [
        ("a", "rib 5, stiffness about the neck", np.radians(swing.stiffness), "N m/deg",
         "0.05 to 0.2 (start, then tune)", "Lemosse 1998"),
        ("a", "rib 5, damping ratio", swing.damping_ratio, "1", "", ""),
        ("a", "rib 5, greatest distance from the closed form", swing.distance, "of the start",
         "0", ""),
    ]  # fmt: skip


def step_b(resting: RestingTorso, axes: Axes) -> list[Row]:
    """The belly alone, supine."""
    rows: list[Row] = []
    for gas, label in ((BELLY, "bones and diaphragm held"), (FREE_BELLY, "all free, relaxed")):
        points, start = belly_inflation(resting, gas, wall_alone=gas is BELLY)
        v = as_arrays(points, start)
        axes.plot(v["abdominal"], v["wall"], "o-", label=label)
        gain = float(np.interp(16.3, v["abdominal"], v["wall"], right=np.nan))
        rows.append(("b", f"wall sweeps at +16.3 cmH2O, {label}", gain, "L", "1.27", SONG))
    axes.plot(16.3, 1.27, "k*", markersize=12, label=SONG)
    axes.set(xlabel="abdominal pressure above rest (cmH2O)", ylabel="volume swept by the wall (L)")
    axes.legend()
    return rows


def step_c(resting: RestingTorso, axes: Axes) -> list[Row]:
    """Relaxed chest wall and lung, upright, and the compliances of both postures."""
    targets = {
        ("upright", "rib_cage"): "0.141 +- 0.043", ("upright", "wall"): "0.025 +- 0.012",
        ("supine", "rib_cage"): "0.088 +- 0.038", ("supine", "wall"): "0.070 +- 0.025",
    }  # fmt: skip
    names = {"rib_cage": "rib cage", "wall": "diaphragm-abdomen"}
    rows: list[Row] = []
    for posture in ("upright", "supine"):
        points = relaxation(resting, PLEURAL, posture)
        start = min(points, key=lambda p: abs(p.rib_cage) + abs(p.wall))
        v = as_arrays(points, start)
        airway = airway_pressure(resting, v)
        for part, name in names.items():
            c = compliance(airway, v["pleural"], v[part])
            target = targets[posture, part]
            rows.append(("c", f"{name} compliance, {posture}", c, "L/cmH2O", target, ESTENNE))
        if posture == "supine":
            fall = Bench(resting, posture).go(0.5).lung / LITRE - frc(resting)
            rows.append(("c", "FRC, supine less upright", fall, "L", "-0.5 to -1.1",
                         "Agostoni & Hyatt 1986"))  # fmt: skip
        else:
            rows += _rahn(resting, axes, v)
    return rows


def _rahn(resting: RestingTorso, axes: Axes, v: dict[str, Floats]) -> list[Row]:
    capacity = {n: c / LITRE for n, c in lung_capacity(resting.torso.subject).items()}
    airway = airway_pressure(resting, v)
    recoil = airway - v["pleural"]
    axes.plot(v["pleural"], v["lung"], "o-", label="chest wall")
    axes.plot(recoil, v["lung"], "o-", label="lung")
    axes.plot(airway, v["lung"], "o-", label="together")
    for name in ("rv", "frc", "tlc"):
        axes.axhline(capacity[name], color="0.8", zorder=0)
        axes.text(axes.get_xlim()[0], capacity[name], f" {name.upper()}", va="bottom")
    axes.plot([-27, 9], [capacity["rv"], capacity["tlc"]], "k*", markersize=10, label="Rahn 1946")
    axes.set(xlabel="pressure (cmH2O)", ylabel="lung volume (L)")
    axes.legend()
    frc = float(np.interp(0.0, airway, v["lung"]))
    share = 100.0 * (frc - capacity["rv"]) / (capacity["tlc"] - capacity["rv"])
    high = float(np.interp(9.0, v["pleural"], v["lung"]))
    low = float(np.interp(-25.0, v["pleural"], v["lung"]))
    rahn = "Rahn 1946"
    return [
        ("c", "FRC of the relaxed torso", share, "% of VC", "33 to 42", rahn),
        ("c", "lung volume at a chest wall pressure of +9 cmH2O", high, "L",
         f"{capacity['tlc']:.2f} (TLC)", rahn),
        ("c", "lung volume at -25 cmH2O", low, "L", f"{capacity['rv']:.2f} at -27 (RV)", rahn),
    ]  # fmt: skip


def step_d(resting: RestingTorso, axes: Axes) -> list[Row]:
    """The diaphragm alone."""
    rows: list[Row] = []
    for braced, label in ((True, "ribs held"), (False, "ribs free")):
        pairs = [closed_effort(resting, float(v), {"diaphragm": 1.0}, braced=braced)
                 for v in VOLUMES]  # fmt: skip
        at = np.array([b.lung for b, _ in pairs]) / LITRE
        rise = [diaphragm_rise(pair) for pair in pairs]
        axes.plot(at, rise, "o-", label=f"maximal, airway closed, {label}")
        rows += [("d", f"transdiaphragmatic pressure at {v:.1f} L, {label}", p, "cmH2O",
                  "163 at RV falling to 68 at 95 % TLC", "Wanke 1990")
                 for v, p in zip(at, rise, strict=True)]  # fmt: skip
    capacity = lung_capacity(resting.torso.subject)
    ends = [capacity["rv"] / LITRE, 0.95 * capacity["tlc"] / LITRE]
    axes.plot(ends, [163, 68], "k*", markersize=12, label="Wanke 1990 (sniff)")
    axes.set(xlabel="lung volume (L)", ylabel="transdiaphragmatic pressure (cmH2O)", ylim=(0, None))
    axes.legend()
    before, during = open_effort(resting, {"diaphragm": 0.1})
    move = 1e3 * (during.places - before.places)
    torso = resting.torso
    last, lower = torso.rows[0][2][-1], torso.rows[0][8][6]
    navel = torso.wall[len(torso.wall) // 2, torso.wall.shape[1] // 2]
    front, tendon = torso.rows[0][6][-1], torso.diaphragm[0, -1]
    for what, point, axis, target in (
        ("rib 9 at the side, outwards", lower, 1, "out"),
        ("rib 9 at the side, up", lower, 2, "up"),
        ("sternum at rib 3, forwards", last, 0, "hardly"),
        ("sternum at rib 7, forwards", front, 0, "hardly"),
        ("belly at the middle, forwards", navel, 0, "out"),
        ("central tendon, up", tendon, 2, "down"),
    ):
        rows.append(("d", f"diaphragm 0.1, airway open: {what}", float(move[point, axis]), "mm",
                     target, "DESIGN section 4"))  # fmt: skip
    gain = (during.lung - before.lung) / LITRE
    rows.append(("d", "diaphragm 0.1, airway open: lung volume", gain, "L", "", ""))
    return rows


STEPS = {
    "a": step_a,
    "b": step_b,
    "c": step_c,
    "d": step_d,
    "e": lambda resting, axes: step_e(resting, axes, VOLUMES),
    "f": step_f,
}


def main() -> None:
    """Run the steps asked for, all unless named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", default="abcdef", help="letters of the steps to run")
    parser.add_argument("--out", type=Path, default=OUT, help="folder to write to")
    options = parser.parse_args()
    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "calibration"
    resting = rest_torso(MAN)
    options.out.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    for letter in options.steps:
        figure, axes = plt.subplots(figsize=(5.0, 3.6), layout="constrained")
        rows += STEPS[letter](resting, axes)
        figure.savefig(options.out / f"calibration_{letter}.svg", metadata={"Date": None})
        plt.close(figure)
    with (options.out / "calibration.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["step", "quantity", "value", "unit", "target", "source"])
        table.writerows((*row[:2], f"{row[2]:.3g}", *row[3:]) for row in rows)
    for row in rows:
        print(f"({row[0]}) {row[1]}: {row[2]:.3g} {row[3]}; target {row[4]} [{row[5]}]")


if __name__ == "__main__":
    main()
