"""`pleura simulate`: let a torso breathe by itself."""

from __future__ import annotations

import argparse
import csv
import math
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, NoReturn

from sim.behaviour import run_controls
from sim.control.controls import Controls
from sim.control.library import FORMS, STYLES, find_controls
from sim.errors import InputError, ParameterError, TorsoError
from sim.model.anatomy import Subject
from sim.motion import Motion, dressed
from sim.rest import GRAVITY
from sim.resting import RestingTorso, rest_torso
from sim.skin.body_mesh import AGES
from sim.tables import CALIBRATED, SETS, parameters
from sim.trajectory import save_motion
from sim.writing import write_summary

LONGEST = 300.0
"""s; every frame of a run is held in memory."""
MOST_FRAMES, MOST_STEPS = 10_000, 600_000
REFERENCE = ("male", 1.756, 75.0)
"""Whom the torso is calibrated for: sex, stature in m, mass in kg."""
SIZE = ("sex", "stature_m", "mass_kg")


class _Parser(argparse.ArgumentParser):
    """A parser whose complaints are one line, as everywhere else."""

    def error(self, message: str) -> NoReturn:
        raise ParameterError(f"simulate: {message}. See 'pleura simulate --help'.")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="pleura simulate", description="Let a torso breathe by itself.", allow_abbrev=False
    )
    add = parser.add_argument
    add("style", metavar="STYLE|FILE.xml", help=f"{', '.join(STYLES)}; or a control file")
    add("--form", choices=FORMS, default=FORMS[0], help="of a style: ours, or as printed")
    add("--duration", type=float, metavar="S", help="length of the run; else the file's own")
    add("--posture", choices=list(GRAVITY), help="else the file's, the subject's, or upright")
    add("--subject", metavar="NAME", help="a row of the table of subjects")
    add("--subjects", type=Path, metavar="TABLE", default=Path("config/subjects.tsv"))
    add("--sex", choices=("male", "female"))
    add("--stature-m", type=float, metavar="M")
    add("--mass-kg", type=float, metavar="KG")
    add("--age-years", type=float, metavar="YEARS", help="of the skin's looks; else the usual one")
    add("--parameters", choices=SETS, default=CALIBRATED)
    add("--json", type=Path, metavar="OUT", help="write the figures")
    add("--out", type=Path, metavar="OUT.h5", help="write the trajectory")
    add("--seed", type=int, default=0, help="written down; a run draws no random number")
    return parser


@dataclass(frozen=True, kw_only=True, slots=True)
class Task:
    """A checked request.

    Parameters
    ----------
    style : as typed, without folder and ending
    name : of the subject
    duration : s
    age : years, of the skin, if given
    parameters : named set
    json, out : files to write, if any
    """

    style: str
    form: str | None
    controls: Controls
    duration: float
    posture: str
    name: str
    subject: Subject
    age: float | None
    parameters: str
    json: Path | None
    out: Path | None
    seed: int


def _row(table: Path, name: str) -> dict[str, str]:
    try:
        text = table.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{table}: cannot be read ({error}). Name it with --subjects.") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    rows = list(csv.DictReader(lines, delimiter="\t", restval=""))
    found = [row for row in rows if row.get("subject") == name]
    if len(found) != 1:
        known = ", ".join(str(row.get("subject")) for row in rows) or "none"
        raise InputError(f"{table}: subject '{name}' has {len(found)} rows. There are: {known}.")
    return found[0]


def _subject(options: argparse.Namespace, row: dict[str, str]) -> Subject:
    """Size from the flags, else from the row, else that of the reference man."""
    given = {k: getattr(options, k) for k in SIZE if getattr(options, k) is not None}
    if not options.subject:
        if given and len(given) < len(SIZE):
            missing = ", ".join(f"--{k.replace('_', '-')}" for k in SIZE if k not in given)
            raise ParameterError(f"simulate: the size is not whole. Give {missing} too.")
        sex, stature, mass = (given[k] for k in SIZE) if given else REFERENCE
        return Subject(sex=sex, stature=stature, mass=mass)
    values = {k: given.get(k, (row.get(k) or "").strip()) for k in SIZE}
    for key, value in values.items():
        if value == "":
            flag = f"--{key.replace('_', '-')}"
            raise InputError(
                f"{options.subjects}: subject {options.subject}: {key} is empty. Give {flag}."
            )
    try:
        stature, mass = float(values["stature_m"]), float(values["mass_kg"])
        return Subject(sex=values["sex"], stature=stature, mass=mass)
    except ValueError as error:
        raise InputError(
            f"{options.subjects}: subject {options.subject}: {error}. Write numbers."
        ) from error
    except ParameterError as error:
        raise InputError(f"{options.subjects}: subject {options.subject}: {error}") from error


def _age(options: argparse.Namespace, row: dict[str, str]) -> float | None:
    """Years from the flag, else from the row, else none."""
    given: float | None = options.age_years
    if given is None and (row.get("age_years") or "").strip():
        try:
            given = float(row["age_years"])
        except ValueError as error:
            raise InputError(
                f"{options.subjects}: subject {options.subject}: age_years: {error}. Write years."
            ) from error
    if given is not None and not AGES[0] <= given <= AGES[1]:
        raise ParameterError(f"simulate: age is {given:g} years. Give {AGES[0]:g} to {AGES[1]:g}.")
    return given


def _duration(options: argparse.Namespace, controls: Controls) -> float:
    own = controls.run_duration
    duration = own if options.duration is None else float(options.duration)
    if duration is None:
        raise ParameterError(f"simulate: {controls.place} says no duration_s. Give --duration.")
    least = controls.run_cycle(duration)
    most = min(LONGEST, MOST_FRAMES / controls.run_frames, MOST_STEPS * controls.run_step)
    if not (math.isfinite(duration) and least <= duration <= most):
        raise ParameterError(
            f"simulate: --duration is {duration:g} s. A run of {controls.name} has at least one"
            f" cycle and fits in memory: give {math.ceil(10 * least) / 10:g} to {most:g} s."
        )
    return duration


def _check_file(flag: str, path: Path | None) -> None:
    """Refuse a place that cannot be written before the run, not after it."""
    if path is not None and path.is_dir():
        raise InputError(f"simulate: {flag} {path} is a folder. Name a file.")
    folders = [] if path is None else [f for f in path.absolute().parents if f.exists()]
    if folders and not folders[0].is_dir():
        raise InputError(f"simulate: {flag} {path}: {folders[0]} is a file. Choose another place.")
    if folders and not os.access(folders[0], os.W_OK):
        raise InputError(
            f"simulate: {flag} {path}: {folders[0]} is read-only. Choose another place."
        )


def read_task(arguments: Sequence[str]) -> Task:
    """Read and check the words of a command line."""
    options = _parser().parse_args(list(arguments))
    controls = find_controls(options.style, options.form)
    own_file = options.style.lower().endswith(".xml")
    row = _row(options.subjects, options.subject) if options.subject else {}
    posture = options.posture or controls.posture or row.get("posture") or "upright"
    if posture not in GRAVITY:
        raise InputError(f"{options.subjects}: posture is '{posture}'. Use {' or '.join(GRAVITY)}.")
    _check_file("--json", options.json)
    _check_file("--out", options.out)
    if options.json is not None and options.json == options.out:
        raise ParameterError("simulate: --json and --out name one file. Give two.")
    duration = _duration(options, controls)
    # a value out of bounds is found before the torso is built
    controls.drive(duration, parameters(options.parameters))
    return Task(
        style=Path(options.style).stem if own_file else options.style,
        form=None if own_file else options.form,
        controls=controls,
        duration=duration,
        posture=posture,
        name=options.subject or "reference",
        subject=_subject(options, row),
        age=_age(options, row),
        parameters=options.parameters,
        json=options.json,
        out=options.out,
        seed=options.seed,
    )


def run_task(task: Task, resting: RestingTorso) -> tuple[Motion, dict[str, Any]]:
    """Run, and return the motion with its figures.

    Parameters
    ----------
    resting : the task's subject at rest
    """
    controls = task.controls
    beside = task.out or task.json or Path(task.style)
    done = run_controls(
        resting, controls, posture=task.posture, duration=task.duration,
        tension=task.out is not None, dump=beside.with_suffix(".unstable.npz"),
    )  # fmt: skip
    torso, size = resting.torso, task.subject
    figures = {"style": task.style, "form": task.form, "duration_s": task.duration}
    figures |= {"step_s": done.step, "posture": task.posture, "subject": task.name}
    figures |= {"sex": size.sex, "stature_m": size.stature, "mass_kg": size.mass}
    figures |= done.figures()
    if task.style == "vital_capacity":
        figures["vital_capacity_l"] = figures["tidal_volume_l"]
    figures |= {
        "realtime_factor": done.realtime_factor,
        "n_rigid_bodies": torso.skeleton.model.nbody - 1,
        "n_particles": torso.n_particles,
        "n_muscle_elements": len(torso.plant.muscles.a),
        "parameters": torso.parameters.name,
        "seed": task.seed,
        "version": metadata.version("pleura"),
    }
    return done.motion, figures


def _lines(figures: dict[str, Any]) -> str:
    pleural = " to ".join(f"{p:.1f}" for p in figures["pleural_pressure_cmh2o"])
    share, rate = figures["rib_cage_share"], figures["breaths_per_min"]
    rib_cage = "nothing moved" if share is None else f"rib cage {100 * share:.0f} % of it"
    many = figures["n_breaths"] > 1
    out = [
        f"{figures['style']}, {figures['posture']}, {figures['duration_s']:g} s:"
        f" {figures['tidal_volume_l']:.2f} L"
        + (f" a breath, {rate:.3g} a minute" if many else " between least and largest"),
        f"  {rib_cage}, pleural {pleural} cmH2O, {figures['realtime_factor']:.1f} times real time",
    ]
    if not many:
        bursts = figures["burst_rate_hz"]
        rhythm = "" if bursts is None else f"{bursts:.1f} bursts a second, "
        closed = figures["closed_glottis_s"]
        larynx = f", larynx closed for {closed:.2g} s" if closed else ""
        out.append(
            f"  {rhythm}{figures['volume_fall_l']:.2f} L below rest, at most"
            f" {figures['peak_gastric_pressure_cmh2o']:.0f} cmH2O in the belly and"
            f" {figures['peak_flow_l_s']:.1f} L/s out{larynx}"
        )
    if not figures["steady"]:
        out.append(f"  not steady: {figures['not_steady_because']}")
    return "\n".join(out)


def main(arguments: Sequence[str]) -> int:
    """Run `pleura simulate`; bad input is one line and exit code 1."""
    try:
        task = read_task(arguments)
        resting = rest_torso(task.subject, parameters=parameters(task.parameters))
        moved, figures = run_task(task, resting)
        if task.out is not None:
            names = ("version", "seed", "style", "subject", "posture")
            save_motion(task.out, dressed(moved, task.age), {name: figures[name] for name in names})
        if task.json is not None:
            write_summary(task.json, figures)
    except TorsoError as error:
        print(f"pleura: {error}", file=sys.stderr)
        return 1
    print(_lines(figures))
    for path in (task.out, task.json):
        if path is not None:
            print(f"  {path}")
    return 0
