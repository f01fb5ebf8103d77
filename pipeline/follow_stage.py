"""The stage `follow`: the torso follows a sound, and what that gives is written down."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline import calls_file, records
from pipeline.job import Job
from pipeline.run import Content, Stage
from sim.errors import InputError
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

if TYPE_CHECKING:
    from pipeline.audio import Sound
    from pipeline.follow_write import Told
    from pipeline.followed import Followed
    from pipeline.settings import FollowSettings
    from pipeline.torso_runs import TorsoRuns
    from sim.resting import RestingTorso

Floats = NDArray[np.float64]


def follow(job: Job, folder: Path, processes: int) -> Content:
    """Let the torso follow the sound."""
    from pipeline.follow_write import write_followed

    settings, sound = job.section("follow"), _sound(folder)
    if sound.duration > settings.max_duration_s:
        raise InputError(
            f"{job.name}: the sound lasts {sound.duration:.0f} s, more than follow.max_duration_s"
            f" ({settings.max_duration_s:g}). Name a part of it by start_s and end_s."
        )
    kind, why = _kind(folder, settings)
    runs, notes = _runs(job, settings, processes)
    told = _told(kind, folder, sound, runs, job)
    done = _play(told, runs)
    write_followed(job, folder, told, done, runs)
    r = done.correlation()
    litre = CUBIC_METRE_PER_LITRE
    return {
        "summary": f"{kind} followed: r = {r:.2f}, {told.content['in_short']}",
        "kind": kind,
        "why_kind": why,
        "lung": settings.lung,
        "quantity": told.quantity,
        "correlation": r,
        "highest_simulated_cmh2o": float(done.pressure.max()) / PASCAL_PER_CMH2O,
        "highest_flow_l_s": float(done.flow.max()) / litre,
        "least_volume_below_rest_l": (done.rest - float(done.lung.min())) / litre,
        "most_volume_above_rest_l": (float(done.lung.max()) - done.rest) / litre,
        "sound_starts_at_s": sound.start,
        "control_starts_at_s": told.origin,
        "control_ends_at_s": told.origin + told.end,
        **told.content,
        "notes": notes,
    }


def _kind(folder: Path, settings: FollowSettings) -> tuple[str, str]:
    """Which primitives to take, and why."""
    if settings.kind != "auto":
        return settings.kind, "named in the settings (follow.kind)"
    audio, calls = (records.read_json(folder / f"{name}.json") for name in ("audio", "calls"))
    sure = f"{audio['kind']} with a confidence of {audio['kind_confidence']:.0%}"
    if calls["laughter"]:
        return "laugh", f"calls of laughter were found; as a whole it sounds like {sure}"
    if audio["kind"] in ("cough", "sneeze", "breath"):
        return audio["kind"], f"no laughter was found; it sounds like {sure}"
    table = folder / calls_file.TABLE
    raise InputError(
        f"{folder.name}: nothing for a torso to follow: no laugh found ({calls['why_no_laugh']}),"
        f" and it sounds like {sure}. If it is one all the same, write yes under 'kept' in {table},"
        " or name follow.kind."
    )


@cache
def _resting(sex: str, stature: float, mass: float) -> RestingTorso:
    """The subject's torso at rest; solving it costs as much as a call."""
    from sim.model.torso import Subject
    from sim.resting import rest_torso

    return rest_torso(Subject(sex=sex, stature=stature, mass=mass))


def _runs(job: Job, settings: FollowSettings, processes: int) -> tuple[TorsoRuns, tuple[str, ...]]:
    from pipeline.population import subject_size
    from pipeline.torso_runs import TorsoRuns

    size = subject_size(job.subject)
    resting = _resting(size.sex, size.stature, size.mass)
    step = min(settings.step_s, resting.torso.parameters["longest_step"])
    runs = TorsoRuns(
        resting=resting, posture=job.subject["posture"], step=step, lung=settings.lung,
        workers=processes,
    )  # fmt: skip
    return runs, size.notes


def _told(kind: str, folder: Path, sound: Sound, runs: TorsoRuns, job: Job) -> Told:
    if kind == "laugh":
        return _told_laugh(folder, sound, runs, job)
    return _told_event(kind, sound, runs, job)


def _told_event(kind: str, sound: Sound, runs: TorsoRuns, job: Job) -> Told:
    from pipeline.event_fit import fit_breaths, fit_bursts
    from pipeline.event_plan import find_events
    from pipeline.follow_write import Told

    settings = job.section("follow")
    events = find_events(sound, kind, settings.strength)
    if kind == "breath":
        fit = fit_breaths(events, runs, settings)
    else:
        fit = fit_bursts(events, kind, runs, settings, job.seed)
    origin, rms = fit.origin, [float(row.get("rms_normalised", "nan")) for row in fit.rows]
    said = f"{len(fit.rows)} {'breaths' if kind == 'breath' else 'bursts'}"
    assumed = (
        "the flow's shape is loudness to a power, its size what is usual: an assumption"
        " (follow.strength)"
    )
    return Told(
        score=fit.score,
        origin=origin,
        end=fit.end,
        quantity="flow",
        time=events.time,
        desired=events.flow,
        low=events.flow,
        high=events.flow,
        asked=[(a + origin, b + origin) for a, b in fit.asked],
        spans=events.spans,
        breaths=[(a + origin, b + origin) for a, b in fit.breaths],
        rows={},
        content={
            "in_short": said,
            "median_rms_normalised": float(np.median(rms)),
            "evaluations": fit.evaluations,
            "events": list(fit.rows),
            "warnings": [assumed, *fit.warnings],
        },
    )


def _told_laugh(folder: Path, sound: Sound, runs: TorsoRuns, job: Job) -> Told:
    from pipeline import laugh_fit
    from pipeline.follow_write import Told
    from pipeline.laugh import desired_laugh
    from pipeline.laugh_words import bound_lines, call_columns, volumes_litre, warnings_of
    from pipeline.search_comparison import compare_searches

    settings, desired = job.section("follow"), desired_laugh(folder)
    span = (sound.start, sound.start + sound.duration)
    fit = laugh_fit.fit_laugh(desired, span, runs, settings, job.seed)
    plan, rms = fit.plan, np.array([one.rms for one in fit.calls if np.isfinite(one.rms)])
    rms = rms if len(rms) else np.array([np.nan])
    origin = plan.origin
    used = [(bout.start + origin, bout.end + origin) for bout in plan.bouts]
    return Told(
        score=fit.score,
        origin=origin,
        end=plan.end,
        quantity="pressure",
        time=desired.time,
        desired=desired.pressure,
        low=desired.low,
        high=desired.high,
        asked=[(used[0][0], used[-1][1])],
        spans=[(c.span[0] + origin, c.span[1] + origin) for c in fit.calls],
        breaths=[(b.span[0] + origin, b.span[1] + origin) for b in fit.breaths if b.span],
        rows=call_columns(fit),
        traces=compare_searches(fit, runs, settings, job.seed),
        content={
            "in_short": f"median error of a call {np.median(rms):.2f} of no pressure",
            "n_calls": len(fit.calls),
            "n_calls_without_error": sum(not np.isfinite(one.rms) for one in fit.calls),
            "median_rms_normalised": float(np.median(rms)),
            "largest_rms_normalised": float(np.max(rms)),
            "n_calls_over_0_16": int(np.sum(rms > 0.16)),
            "evaluations": fit.evaluations,
            "seconds_of_calls": sum(c.fit.seconds for c in fit.calls),
            "lag_ms": 1e3 * fit.probe.lag,
            "air_foreseen_l": volumes_litre(fit.needed),
            "volume_at_start_of_bouts_over_rest_l": volumes_litre(
                [begun - fit.air.rest for begun in fit.begun]
            ),
            "air_used_by_bouts_l": volumes_litre(fit.used),
            "inspiratory_levels": [round(one.level, 3) for one in fit.breaths],
            "asked_s": used,
            "stops": sorted({str(c.fit.stop) for c in fit.calls}),
            "at_bound": bound_lines(fit),
            "warnings": warnings_of(fit),
        },
    )


def _play(told: Told, runs: TorsoRuns) -> Followed:
    from pipeline.followed import Followed, play
    from pipeline.laugh_plan import air_of

    got = play(runs, told.score, told.end)
    time = got.pop("time") + told.origin
    desired, low, high = (
        np.interp(time, told.time, values, left=0.0, right=0.0)
        for values in (told.desired, told.low, told.high)
    )
    asked = np.zeros(len(time), dtype=bool)
    for start, end in told.asked:
        asked |= (time > start) & (time <= end)
    return Followed(
        time=time, desired=desired, low=low, high=high, asked=asked, quantity=told.quantity,
        rest=air_of(runs).rest, start=told.origin, end=told.origin + told.end, **got,
    )  # fmt: skip


def _sound(folder: Path) -> Sound:
    from pipeline.audio import Sound

    sound = records.load(Sound, folder / "audio.npz")
    samples, rectified = sound.samples.astype(float), sound.rectified.astype(float)
    return replace(sound, samples=samples, rectified=rectified)


STAGES: dict[str, Stage] = {"follow": follow}
