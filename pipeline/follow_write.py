"""What a followed sound leaves in its folder: control file, trajectory, tables, figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import calls_file, records
from pipeline.followed import Followed, in_space
from pipeline.job import Job
from pipeline.population import subject_age
from pipeline.score import Score
from pipeline.torso_runs import TorsoRuns
from sim.control.writer import write_controls
from sim.motion import dressed
from sim.simulate import LEVELS
from sim.trajectory import save_motion
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

Floats = NDArray[np.float64]
CONTROL, TRAJECTORY, TABLE = "control.xml", "trajectory.h5", "followed.csv"
TABLE_RATE = 50.0
"""Rows a second of followed.csv."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Told:
    """What any kind of sound leads to.

    Parameters
    ----------
    score, origin, end : what the torso is told; s in the file at which it begins; its length, s
    quantity : "pressure" or "flow"
    time, desired, low, high : (n,), s in the file, and in SI units what it was asked for
    asked : start and end, s in the file, of where that counts
    spans, breaths : calls or events, and breaths in, s in the file
    rows : further columns of calls.csv by the number of the call
    content : figures for the record
    traces : errors of the searches of one call, by name
    """

    score: Score
    origin: float
    end: float
    quantity: str
    time: Floats
    desired: Floats
    low: Floats
    high: Floats
    asked: Sequence[tuple[float, float]]
    spans: Sequence[tuple[float, float]]
    breaths: Sequence[tuple[float, float]]
    rows: dict[int, dict[str, Any]]
    content: dict[str, Any]
    traces: dict[str, Floats] = field(default_factory=dict)


def write_followed(job: Job, folder: Path, told: Told, done: Followed, runs: TorsoRuns) -> None:
    """Write everything but the record.

    Parameters
    ----------
    folder : of the recording's results
    done : `told` played once from rest
    """
    settings = job.section("follow")
    controls = told.score.controls(
        step=runs.step,
        name=job.name,
        duration=told.end,
        cycle=told.end,
        frames=settings.frames_per_s,
        posture=runs.posture,
        source=f"made from the sound of {job.name}, Pleura {job.version}",
        note=f"time 0 is {told.origin:.3f} s in the sound's file; simulate with --subject"
        f" {job.subject['subject']}",
    )
    write_controls(folder / CONTROL, controls)
    moved = dressed(in_space(runs, controls, told.end), subject_age(job.subject))
    save_motion(
        folder / TRAJECTORY,
        moved,
        {
            "version": job.version, "seed": job.seed, "style": job.name,
            "subject": job.subject["subject"], "posture": runs.posture,
        },
    )  # fmt: skip
    records.save(done, folder / "follow.npz")
    records.write_rows(folder / TABLE, _rows(done))
    if told.rows:
        calls_file.add_columns(folder / calls_file.TABLE, told.rows)
    _draw(folder, told, done)


def _rows(done: Followed) -> list[dict[str, str]]:
    every = slice(
        None, None, max(1, round(1.0 / (TABLE_RATE * float(np.median(np.diff(done.time))))))
    )
    litre, unit = CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O
    columns = {
        "time_s": (done.time, 3),
        ("desired_cmh2o" if done.quantity == "pressure" else "desired_l_s"): (
            done.desired / (unit if done.quantity == "pressure" else litre), 3,
        ),
        "lung_pressure_cmh2o": (done.pressure / unit, 3),
        "pleural_pressure_cmh2o": (done.pleural / unit, 3),
        "abdominal_pressure_cmh2o": (done.abdominal / unit, 3),
        "flow_l_s": (done.flow / litre, 4),
        "volume_over_rest_l": ((done.lung - done.rest) / litre, 4),
        **{name: (done.levels[:, k], 4) for k, name in enumerate(LEVELS)},
    }  # fmt: skip
    texts = {
        name: [f"{value:.{digits}f}" for value in values[every]]
        for name, (values, digits) in columns.items()
    }
    return [dict(zip(texts, row, strict=True)) for row in zip(*texts.values(), strict=True)]


def _draw(folder: Path, told: Told, done: Followed) -> None:
    from pipeline.draw.follow import followed_svg, search_svg

    litre = CUBIC_METRE_PER_LITRE
    flow = told.quantity == "flow"
    unit = litre if flow else PASCAL_PER_CMH2O
    drawing = followed_svg(
        time=done.time,
        desired=done.desired / unit,
        simulated=done.simulated / unit,
        low=done.low / unit,
        high=done.high / unit,
        what="flow out" if flow else "lung pressure",
        unit="L/s" if flow else "cmH2O",
        volume=(done.lung - done.rest) / litre,
        levels=done.levels,
        groups=LEVELS,
        larynx=done.larynx,
        spans=told.spans,
        breaths=told.breaths,
        limits=(done.start, done.end),
    )
    records.write_text(folder / "followed.svg", drawing)
    if told.traces:
        records.write_text(folder / "search.svg", search_svg(traces=told.traces))
