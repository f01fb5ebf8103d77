"""The stage `retraining`: the steps of one person, each simulated and kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import records
from pipeline.job import Job
from pipeline.run import Content, Stage
from sim.units import CUBIC_METRE_PER_LITRE

if TYPE_CHECKING:
    from pipeline.fit import FitResult
    from pipeline.model import TorsoModel
    from pipeline.retraining import Breathed, Floats, Pattern, Player, Step

TABLE, DRAWING = "retraining.csv", "retraining.svg"
FEW = 1e-6
"""m^3; a breath of less has no shares."""


def motion_file(folder: Path, number: int) -> Path:
    """Trajectory of a step; the person's own breath is step 0."""
    return folder / f"retraining_{number}.h5"


def retraining(job: Job, folder: Path, processes: int) -> Content:
    """Lead the fitted breath to the target."""
    from pipeline.draw.retraining import steps_svg
    from pipeline.fit import FitResult
    from pipeline.population import subject_size
    from pipeline.retraining import Pattern, patterns, retrain

    settings, result = job.section("retraining"), records.load(FitResult, folder / "fit.npz")
    size = subject_size(job.subject)
    play = _player(job, result, processes)
    own = Pattern(
        inspiration=result.inspiration_time, expiration=result.expiration_time,
        pause=result.pause_time, tidal=0.0, belly_share=0.0, expiratory=result.levels[2:],
    )  # fmt: skip
    first = play(own, result.levels)
    if first.tidal < FEW:
        raise _nothing(job)
    own = replace(own, tidal=first.tidal, belly_share=first.belly_share)
    steps = retrain(play, patterns(own, settings, size.mass), result.levels, first, settings)
    rows = [_row(number, step, size.mass, settings) for number, step in enumerate(steps)]
    _keep(job, folder, steps, result.posture)
    records.write_rows(folder / TABLE, [{k: _text(v) for k, v in row.items()} for row in rows])
    curves = [
        (s.breathed.motion.time, s.breathed.motion.volumes["lung"] / CUBIC_METRE_PER_LITRE)
        for s in steps
    ]
    records.write_text(folder / DRAWING, steps_svg(curves=curves))
    return {
        "summary": f"{len(steps) - 1} steps to {rows[-1]['rate_per_min']:.3g} breaths a minute,"
        f" belly {rows[-1]['belly_share']:.2f} of {rows[-1]['asked_belly_share']:.2f} asked for",
        "target": {
            "rate_per_min": settings.rate_per_min,
            "belly_share": settings.belly_share,
            "inspiration_share": settings.inspiration_share,
        },
        "tolerance": settings.tolerance,
        "steps": rows,
        "n_runs": sum(step.n_runs for step in steps) + 2,
        "notes": size.notes,
        "warnings": _warnings(rows, settings.tolerance),
    }


def _nothing(job: Job) -> Exception:
    from sim.errors import InputError

    return InputError(
        f"{job.name}: the fitted torso hardly breathes, so there is no breath to begin with."
        f" Look at its fit first: reports/{job.name}.html."
    )


def _player(job: Job, result: FitResult, processes: int) -> Player:
    from pipeline.breath_motion import best_breath
    from pipeline.retraining import Breathed

    model, rate = _model(job, processes), job.section("retraining").frame_rate_hz

    def play(asked: Pattern, levels: Floats) -> Breathed:
        run = replace(
            result, levels=np.asarray(levels), inspiration_time=asked.inspiration,
            expiration_time=asked.expiration, pause_time=asked.pause,
        )  # fmt: skip
        breath = best_breath(run, model, rate)
        litres = [breath.figures[key] for key in ("rib_cage_volume_l", "abdominal_wall_volume_l")]
        volumes = CUBIC_METRE_PER_LITRE * np.array(litres)
        return Breathed(volumes=volumes, motion=breath.motion, figures=breath.figures)

    return play


def _model(job: Job, processes: int) -> TorsoModel:
    from pipeline.model import TorsoModel
    from pipeline.population import subject_size
    from sim.model.torso import Subject

    size = subject_size(job.subject)
    subject = Subject(sex=size.sex, stature=size.stature, mass=size.mass)
    return TorsoModel(subject=subject, workers=processes)


def _row(number: int, step: Step, mass: float, settings: Any) -> dict[str, Any]:
    from pipeline.model import GROUPS

    asked, done, litre = step.asked, step.breathed, CUBIC_METRE_PER_LITRE
    dead = settings.dead_space_ml_per_kg * mass * 1e-3
    lung = float(np.ptp(done.motion.volumes["lung"])) / litre
    return {
        "step": number,
        "rate_per_min": asked.rate,
        "inspiration_s": asked.inspiration,
        "expiration_s": asked.expiration,
        "tidal_volume_l": lung,
        "swept_volume_l": done.tidal / litre,
        "asked_swept_volume_l": asked.tidal / litre,
        "belly_share": done.belly_share,
        "asked_belly_share": asked.belly_share,
        "rib_cage_share": 1.0 - done.belly_share,
        "alveolar_ventilation_l_min": asked.rate * (lung - dead),
        **dict(zip(GROUPS, step.levels.tolist(), strict=True)),
        "error": step.error,
        "n_runs": step.n_runs,
        "steady": done.figures["steady"],
    }


def _text(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _warnings(rows: list[dict[str, Any]], tolerance: float) -> list[str]:
    found = [
        f"step {row['step']} misses what was asked of it by {100 * row['error']:.0f} % of its"
        f" tidal volume (belly {row['belly_share']:.2f}, asked {row['asked_belly_share']:.2f})"
        for row in rows
        if row["error"] > tolerance
    ]
    unsteady = [str(row["step"]) for row in rows if not row["steady"]]
    if unsteady:
        found.append(
            f"step {', '.join(unsteady)}: the second of two breaths from rest is not yet the"
            " same as the first"
        )
    return found


def _keep(job: Job, folder: Path, steps: list[Step], posture: str) -> None:
    from pipeline.population import subject_age
    from sim.motion import dressed
    from sim.trajectory import save_motion

    for old in folder.glob("retraining_*.h5"):
        old.unlink()
    for number, step in enumerate(steps):
        about: dict[str, str | int] = {
            "version": job.version, "seed": job.seed, "style": f"{job.name}, step {number}",
            "subject": job.recording["subject"], "posture": posture,
        }  # fmt: skip
        motion = dressed(step.breathed.motion, subject_age(job.subject))
        save_motion(motion_file(folder, number), motion, about)


STAGES: dict[str, Stage] = {"retraining": retraining}
