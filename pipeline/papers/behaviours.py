"""Every behaviour of the papers in one form: figures, curves and pictures."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import places
from pipeline.draw.filmstrip import Panel, View, filmstrip_svg
from pipeline.draw.section import Floats
from pipeline.papers import moments, ribs, surface
from pipeline.papers.events import event_details
from pipeline.papers.view import views
from pipeline.records import write_json, write_text
from sim.behaviour import Behaviour, run_controls
from sim.control.library import find_controls
from sim.errors import ParameterError, UnstableSimulation
from sim.model.anatomy import Subject
from sim.model.torso import lung_capacity
from sim.resting import RestingTorso, rest_torso
from sim.tables import CALIBRATED, parameters
from sim.units import CUBIC_METRE_PER_LITRE as LITRE
from sim.units import PASCAL_PER_CMH2O as CMH2O

MAN = Subject(sex="male", stature=1.756, mass=75.0)
"""Whom the torso is calibrated for; the papers print no size."""
BREATHS = ("calm", "deep", "panting", "forced_exhale", "paradoxical_normal", "paradoxical")
EVENTS = ("giggle", "laugh", "belly_laugh", "cough", "sneeze")
PAIR = ("paradoxical", "paradoxical_normal")
FORMS = {
    "papers": ("papers", CALIBRATED),
    "calibrated": ("calibrated", CALIBRATED),
    "papers_set": ("papers", "papers"),
}
"""Forms of a run: the form of its control file and the parameter set of its torso."""


def run_style(resting: RestingTorso, style: str, form: str) -> Behaviour:
    """Run a behaviour for its own duration, upright; `form` is that of the control file."""
    controls = find_controls(style, form)
    if controls.run_duration is None:
        raise ParameterError(f"{controls.place}: says no duration_s. Add it.")
    return run_controls(resting, controls, posture="upright", duration=controls.run_duration)


def curve_csv(done: Behaviour) -> str:
    """Volumes, pressures and flow over time, as text."""
    t, stream = done.trajectory, io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["time_s", "lung_l", "alveolar_cmh2o", "abdominal_cmh2o", "flow_l_s"])
    columns = np.stack(
        [t.time, t.lung / LITRE, t.alveolar / CMH2O, t.abdominal / CMH2O, t.flow / LITRE], axis=1
    )
    writer.writerows([f"{value:.5g}" for value in row] for row in columns)
    return stream.getvalue()


def matrix_csv(first: str, time: Floats, names: list[str], values: Floats) -> str:
    """A column of time and one for each name, as text."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([first, *names])
    for t, row in zip(time, values, strict=True):
        writer.writerow([f"{t:.4g}", *(f"{value:.5g}" for value in row)])
    return stream.getvalue()


def panels(resting: RestingTorso, done: Behaviour, style: str) -> tuple[list[Panel], View]:
    """Pictures of a behaviour's moments, and the torso at rest."""
    chosen = moments.STRIPS[style](done)
    t = done.trajectory
    drawn = views(resting, done, [0, *(frame for _, frame in chosen)])
    made = [
        Panel(view=view, title=name, line=f"{t.time[f]:.2f} s, {t.lung[f] / LITRE:.2f} L")
        for view, (name, f) in zip(drawn[1:], chosen, strict=True)
    ]
    return made, drawn[0]


def _calm(resting: RestingTorso, done: Behaviour, folder: Path) -> dict[str, Any]:
    """Figs. 5.4 and 5.5, from the calm breath."""
    when, turn = ribs.rotations(done)
    late = ribs.delays(when, turn, done.cycle)
    names = [f"rib_{k}_deg" for k in ribs.LEVELS]
    write_text(folder / "ribs.csv", matrix_csv("time_s", when, names, np.degrees(turn)))
    found = surface.skin_change(resting, done)
    write_json(folder / "skin.json", found.lines)
    extent = np.degrees(np.ptp(turn, axis=0))
    return {
        **found.figures,
        "rib_delay_s": late.tolist(),
        "rib_extent_deg": extent.tolist(),
        "rib_delay_span_ms": 1e3 * float(np.ptp(late)),
        "rib_extent_ratio": float(extent.max() / extent.min()),
        "rib_delay_grows": bool((np.diff(late) > 0.0).all()),
    }


def _pictures(
    resting: RestingTorso, runs: Mapping[str, Behaviour], folder: Path
) -> Iterator[tuple[str, str]]:
    """Name and text of every strip; the paradoxical pair shares one."""
    for style, done in runs.items():
        if style in moments.STRIPS and style not in PAIR:
            alone, rest = panels(resting, done, style)
            yield style, filmstrip_svg(alone, still=rest)
    if set(PAIR) <= set(runs):
        both: list[Panel] = []
        for style, word in zip(PAIR, ("paradoxical", "normal"), strict=True):
            own, rest = panels(resting, runs[style], style)
            both += [replace(panel, title=f"{word}, {panel.title}") for panel in own]
        yield PAIR[0], filmstrip_svg(both, still=rest)


def simulate_form(form: str, folder: Path) -> Path:
    """Run every behaviour in a form and write what the page needs.

    Parameters
    ----------
    form : one of `FORMS`
    folder : for FORM.json and FORM/
    """
    began = time.monotonic()
    printed, numbers = FORMS[form]
    resting = rest_torso(MAN, parameters=parameters(numbers))
    capacity = lung_capacity(MAN)
    figures: dict[str, Any] = {}
    runs: dict[str, Behaviour] = {}
    missing: dict[str, str] = {}
    own = folder / form
    for style in (*BREATHS, *EVENTS):
        try:
            done = run_style(resting, style, printed)
        except UnstableSimulation as error:
            missing[style] = str(error)
            continue
        runs[style] = done
        write_text(own / f"{style}.csv", curve_csv(done))
        found = done.figures() | event_details(done, capacity)
        found |= {"realtime_factor": done.realtime_factor, "step_s": done.step}
        figures |= {f"{style}.{name}": value for name, value in found.items()}
    if "calm" in runs:
        found = _calm(resting, runs["calm"], own)
        figures |= {f"calm.{name}": value for name, value in found.items()}
    for name, text in _pictures(resting, runs, own):
        write_text(own / f"{name}.svg", text)
    path = folder / f"{form}.json"
    content = {"form": form, "figures": figures, "missing": missing, "capacity_l": {
        name: value / LITRE for name, value in capacity.items()}}  # fmt: skip
    write_json(path, content | {
        "version": places.version(),
        "source": places.fingerprint(places.PACKAGE.parent),
        "seconds": round(time.monotonic() - began, 1),
    })  # fmt: skip
    return path
