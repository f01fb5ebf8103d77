"""Let the torso of the papers' muscles make the printed efforts, and see what comes of it.

`python scripts/papers_breath.py` writes `docs/figures/papers_breath.csv`; it takes about twenty
minutes on one core. Nothing here is fitted: `hill_table_scale` was chosen from these rows.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sim.breaths import sawtooth
from sim.errors import UnstableSimulation
from sim.model.torso import Subject
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats
from sim.resting import RestingTorso, rest_torso
from sim.simulate import Trajectory, group_activation, replay, simulate
from sim.tables import Parameters, parameters

OUT = Path(__file__).resolve().parents[1] / "docs" / "figures" / "papers_breath.csv"
MAN = Subject(sex="male", stature=1.756, mass=75.0)
SCALES = (1.0, 5.0, 8.0, 12.0)
STEPS = (0.002, 0.001, 0.0005, 0.00025)
LITRE, CMH2O, MS = 1e-3, 98.0665, 1e3
GRID = [(e, d, p) for e in (0.14, 0.3, 0.6, 0.8) for d in (0.05, 0.1, 0.2, 0.4, 0.8)
        for p in (4.0, 8.0)]  # fmt: skip
"""Levels of external intercostals and diaphragm, and period, s."""
FIELDS = ("parameters", "scale_n", "effort", "step_ms", "tidal_volume_l", "lung_l",
          "chest_swing_l", "bound_swing_l", "abdominal_pressure_cmh2o",
          "abdomen_volume_error", "note")  # fmt: skip
Row = dict[str, str | float]


def breaths(time: Floats, levels: tuple[float, ...], period: float = 4.0) -> Floats:
    """(n, 4), levels of a breath; all of them act while breathing in (section 7.2)."""
    half = 0.5 * period
    rise = sawtooth(time, inspiration=half, expiration=half, pause=0.0)[0]
    return np.asarray(rise[:, None] * np.array(levels))


def laughs(time: Floats, diaphragm: float, abdomen: float, intercostals: float) -> Floats:
    """(n, 4), levels of Table 6.1: 5 Hz, the diaphragm constant."""
    wave = 0.5 - 0.5 * np.cos(10.0 * np.pi * time)
    still = np.ones_like(time)
    return np.stack([0.0 * wave, diaphragm * still, intercostals * wave, abdomen * wave], 1)


def coughs(time: Floats) -> Floats:
    """(n, 4), levels of Table 7.1: everything expiratory for 250 ms."""
    on = np.interp(time, [1.0, 1.03, 1.25, 1.28], [0.0, 1.0, 1.0, 0.0])
    return np.stack([0.0 * on, np.full_like(on, 0.05), on, on], 1)


def swings(torso: RestingTorso, run: Trajectory) -> Row:
    """Swing of the chest's volume, L: of the cavity itself and of the one that the lung follows."""
    everything = np.arange(torso.torso.n_bound + torso.torso.n_particles)
    points, faces = replay(torso, run, everything).points, torso.torso.plant.chest_faces
    late = run.time > run.time[-1] - 4.0
    own = np.array([enclosed_volume(x, faces) for x in points[late]])
    return {
        "chest_swing_l": round(float(np.ptp(own)) / LITRE, 3),
        "bound_swing_l": round(float(np.ptp(run.chest[late])) / LITRE, 3),
    }


def effort(torso: RestingTorso, levels: Floats, step: float) -> Row:
    """Figures of a run; tidal volume and swings of the chest are those of its last four seconds."""
    drive = group_activation(levels, torso.torso.parameters)
    try:
        run = simulate(torso, drive, posture="upright", step=step)
    except UnstableSimulation as error:
        return {"tidal_volume_l": "", "note": str(error).split(":")[0]}
    last = run.lung[run.time > run.time[-1] - 4.0] / LITRE
    reference = torso.torso.plant.constants.abdomen_volume
    low, high = run.abdominal.min() / CMH2O, run.abdominal.max() / CMH2O
    return {
        "tidal_volume_l": round(float(np.ptp(last)), 3),
        "lung_l": f"{run.lung.min() / LITRE:.2f} to {run.lung.max() / LITRE:.2f}",
        **swings(torso, run),
        "abdominal_pressure_cmh2o": f"{low:.0f} to {high:.0f}",
        "abdomen_volume_error": round(float(np.abs(run.abdomen / reference - 1.0).max()), 4),
    }


def printed_efforts(torso: RestingTorso, steps: tuple[float, ...]) -> Iterator[Row]:
    """Tables 6.1 and 7.1, and each muscle of the breath alone."""
    for step in steps:
        time = np.arange(round(8.0 / step), dtype=np.float64) * step
        for name, levels in {
            "nothing": breaths(time, (0.0, 0.0, 0.0, 0.0)),
            "breath (Table 7.1)": breaths(time, (0.3, 0.1, 0.0, 0.0)),
            "its diaphragm alone": breaths(time, (0.0, 0.1, 0.0, 0.0)),
            "its external intercostals alone": breaths(time, (0.3, 0.0, 0.0, 0.0)),
            "paradoxical breath (Table 7.1)": breaths(time, (0.3, 0.1, 0.0, 0.1)),
            "giggle (Table 6.1)": laughs(time, 0.05, 0.125, 0.2),
            "normal laugh (Table 6.1)": laughs(time, 0.05, 0.5, 0.5),
            "deep laugh (Table 6.1)": laughs(time, 0.05, 1.0, 0.5),
            "cough (Table 7.1)": coughs(time),
        }.items():
            yield {"effort": name, "step_ms": MS * step, **effort(torso, levels, step)}


def diverged(torso: RestingTorso, step: float) -> int:
    """How many efforts of the grid do not end."""
    count = 0
    for external, diaphragm, period in GRID:
        time = np.arange(round(period / step), dtype=np.float64) * step
        levels = breaths(time, (external, diaphragm, 0.0, 0.0), period)
        count += effort(torso, levels, step)["tidal_volume_l"] == ""
    return count


def rows() -> Iterator[Row]:
    """Every row of the table."""
    papers = parameters("papers")
    chosen, step = papers["hill_table_scale"], papers["longest_step"]
    branch = papers.replace(eccentric_force=parameters()["eccentric_force"])
    cases: list[tuple[str, Parameters, tuple[float, ...]]] = [
        *(("papers", papers.replace(hill_table_scale=s), STEPS if s == chosen else (step,))
          for s in SCALES),
        ("papers with the lengthening branch", branch, STEPS),
        ("calibrated", parameters(), (0.002,)),
    ]  # fmt: skip
    for name, numbers, steps in cases:
        torso = rest_torso(MAN, parameters=numbers)
        first: Row = {"parameters": name, "scale_n": numbers["hill_table_scale"]}
        for row in printed_efforts(torso, steps):
            yield first | row
        if name == "papers" and numbers["hill_table_scale"] > 1.0:
            count = f"{diverged(torso, step)} of {len(GRID)} diverge"
            yield first | {"effort": "grid of breaths", "step_ms": MS * step, "note": count}


def main() -> None:
    """Write the table."""
    with OUT.open("w", newline="", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, FIELDS, lineterminator="\n")
        writer.writeheader()
        for row in rows():
            writer.writerow(row)
            lines.flush()


if __name__ == "__main__":
    main()
