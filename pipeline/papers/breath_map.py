"""The space of breaths (dilorenzo2009, Fig. 5.3): tidal volume over contraction and period."""

from __future__ import annotations

import csv
import io
import json
import math
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from pipeline import page, places
from pipeline.papers.behaviours import MAN
from pipeline.records import write_json, write_text
from pipeline.settings import PapersSettings
from sim.control.controls import Controls
from sim.control.curves import Sawtooth
from sim.control.library import find_controls
from sim.errors import ParameterError, UnstableSimulation
from sim.resting import RestingTorso, rest_torso
from sim.simulate import simulate
from sim.summary import STEADY_DRIFT, STEADY_TIDAL
from sim.units import CUBIC_METRE_PER_LITRE as LITRE

COLUMNS = ("contraction", "period_s", "tidal_volume_l", "change_l", "breaths")
FIRST = "external_intercostals"
"""Its level is the contraction of the map; the diaphragm keeps the calm breath's proportion."""
LEAST_BREATHS = 2
"""The last breath of a run has one before it that it can be compared with."""
FRAMES = 50.0
"""Frames a second: 25 in the shortest breath."""

Cell = tuple[float, float]
Run = dict[str, str]


def breath_controls(contraction: float, period: float) -> Controls:
    """The calm breath with another strength and another period, its shape kept.

    Parameters
    ----------
    contraction : level of the external intercostals, 0 to 1
    period : s
    """
    calm = find_controls("calm")
    curves = {s.name: c for s in calm.springs for c in s.curves if isinstance(c, Sawtooth)}
    if FIRST not in curves:
        raise ParameterError(f"{calm.place}: has no sawtooth for {FIRST}. Write one.")
    gain = contraction / curves[FIRST].high
    springs = tuple(
        replace(
            s, curves=(replace(curves[s.name], period=period, high=gain * curves[s.name].high),)
        )
        for s in calm.springs
    )
    return replace(calm, springs=springs, cycle=period)


def grid(settings: PapersSettings) -> list[Cell]:
    """Contraction and period of every run."""
    s = settings
    contractions = np.linspace(s.map_least_level, s.map_most_level, s.map_contractions)
    periods = np.linspace(s.map_shortest_s, s.map_longest_s, s.map_periods)
    return [(round(float(c), 6), round(float(p), 6)) for c in contractions for p in periods]


def one_run(resting: RestingTorso, cell: Cell, settings: PapersSettings) -> Run:
    """Tidal volume of the last breath, L, and its change from the breath before."""
    contraction, period = cell
    n = max(LEAST_BREATHS, math.ceil(settings.map_settle_s / period))
    controls = breath_controls(contraction, period)
    if period < settings.map_fine_below_s:
        # at the usual step the strongest, quickest pant is 3 % larger
        controls = controls.at_step(0.5 * controls.run_step)
    drive, row = controls.drive(n * period), {"contraction": f"{contraction:g}"}
    row |= {"period_s": f"{period:g}", "breaths": str(n)}
    try:
        t = simulate(resting, drive.activation, posture="upright", step=controls.run_step,
                     rate=FRAMES)  # fmt: skip
    except UnstableSimulation:
        return row | {"tidal_volume_l": "", "change_l": ""}
    late = t.time - (n - 1) * period
    tidal = [
        float(np.ptp(t.lung[(late > shift - 1e-9) & (late <= shift + period + 1e-9)])) / LITRE
        for shift in (-period, 0.0)
    ]
    return row | {"tidal_volume_l": f"{tidal[1]:.5f}", "change_l": f"{tidal[1] - tidal[0]:.5f}"}


def as_text(rows: Iterable[Run]) -> str:
    """Rows of the map as CSV."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


class Checkpoint:
    """Runs that are done, beside the map; it survives a kill and is gone once the map is whole.

    What another version of the code or other settings left is not taken up.
    """

    def __init__(self, folder: Path, settings: PapersSettings) -> None:
        self.rows, self.about = folder / "map.partial.csv", folder / "map.partial.json"
        self.key = asdict(settings) | {"source": places.fingerprint(places.PACKAGE.parent)}

    def read(self) -> list[Run]:
        """Runs of an interrupted map."""
        try:
            same = json.loads(self.about.read_text("utf-8")) == self.key
        except (OSError, ValueError):
            return []
        return page.read_rows(self.rows) if same else []

    def write(self, rows: list[Run]) -> None:
        """Keep the runs so far."""
        if not self.about.exists() or not self.read():
            self.rows.unlink(missing_ok=True)
            write_json(self.about, self.key)
        write_text(self.rows, as_text(rows))

    def forget(self) -> None:
        """Remove both files."""
        self.rows.unlink(missing_ok=True)
        self.about.unlink(missing_ok=True)


def run_map(folder: Path, settings: PapersSettings, workers: int) -> Path:
    """Run the grid and write map.csv and map.json; an interrupted map is taken up again.

    Parameters
    ----------
    workers : threads; they change the speed, never a number
    """
    began, resting = time.monotonic(), rest_torso(MAN)
    checkpoint, cells = Checkpoint(folder, settings), grid(settings)
    rows = checkpoint.read()
    resumed = len(rows)
    with ThreadPoolExecutor(max_workers=workers) as pool:
        for start in range(resumed, len(cells), settings.map_batch):
            batch = cells[start : start + settings.map_batch]
            rows += pool.map(lambda cell: one_run(resting, cell, settings), batch)
            checkpoint.write(rows)
    write_text(folder / "map.csv", as_text(rows))
    path = folder / "map.json"
    write_json(path, {
        "figures": map_figures(rows), "runs": len(rows), "resumed": resumed, "workers": workers,
        "seconds": round(time.monotonic() - began, 1), "settings": asdict(settings),
        "version": places.version(), "source": places.fingerprint(places.PACKAGE.parent),
    })  # fmt: skip
    checkpoint.forget()
    return path


def volumes(rows: list[Run]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contractions (n,), periods (m,), s, and tidal volumes (n, m), L; failed runs not a number."""
    contractions = sorted({float(row["contraction"]) for row in rows})
    periods = sorted({float(row["period_s"]) for row in rows})
    tidal = np.full((len(contractions), len(periods)), np.nan)
    for row in rows:
        if row["tidal_volume_l"]:
            at = (
                contractions.index(float(row["contraction"])),
                periods.index(float(row["period_s"])),
            )
            tidal[at] = float(row["tidal_volume_l"])
    return np.array(contractions), np.array(periods), tidal


def map_figures(rows: list[Run]) -> dict[str, object]:
    """What the paper says of its map, measured on ours."""
    contractions, periods, tidal = volumes(rows)
    steady = [
        abs(float(r["change_l"]))
        < max(STEADY_DRIFT / LITRE, STEADY_TIDAL * float(r["tidal_volume_l"]))
        for r in rows
        if r["change_l"]
    ]
    panting, slow = tidal[:, 0], tidal[:, -1]
    rise = np.diff(tidal, axis=0)
    return {
        "runs": len(rows),
        "failed": int(np.isnan(tidal).sum()),
        "least_l": float(np.nanmin(tidal)),
        "most_l": float(np.nanmax(tidal)),
        "crosses_half_litre": bool(np.nanmin(tidal) < 0.5 < np.nanmax(tidal)),
        "panting_share": float(np.nanmedian(panting / slow)),
        "panting_share_most": float(np.nanmax(panting / slow)),
        "grows_share": float(np.mean(rise[np.isfinite(rise)] > 0.0)),
        "steady_share": float(np.mean(steady)) if steady else 0.0,
        "contraction_span": [float(contractions[0]), float(contractions[-1])],
        "period_span_s": [float(periods[0]), float(periods[-1])],
    }
