"""The stage `follow`: the torso follows a sound, and what that gives is written down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline import calls_file, records
from pipeline.job import Job
from pipeline.run import Content, Stage
from sim.errors import InputError
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

if TYPE_CHECKING:
    from pipeline.audio import Sound
    from pipeline.followed import Followed
    from pipeline.score import Score
    from pipeline.settings import FollowSettings
    from pipeline.torso_runs import TorsoRuns
    from sim.resting import RestingTorso

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


def follow(job: Job, folder: Path, processes: int) -> Content:
    """Let the torso follow the sound."""
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
    _write(job, folder, told, done, runs)
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
    from pipeline.laugh import desired_laugh
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
        spans=[(c.space.start + origin, c.space.end + origin) for c in fit.calls],
        breaths=[(b.span[0] + origin, b.span[1] + origin) for b in fit.breaths if b.span],
        rows=laugh_fit.call_columns(fit),
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
            "air_foreseen_l": laugh_fit.volumes_litre(fit.needed),
            "volume_at_start_of_bouts_over_rest_l": laugh_fit.volumes_litre(
                [begun - fit.air.rest for begun in fit.begun]
            ),
            "air_used_by_bouts_l": laugh_fit.volumes_litre(fit.used),
            "inspiratory_levels": [round(one.level, 3) for one in fit.breaths],
            "asked_s": used,
            "stops": sorted({str(c.fit.stop) for c in fit.calls}),
            "at_bound": laugh_fit.bound_lines(fit),
            "warnings": laugh_fit.warnings_of(fit),
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


def _write(job: Job, folder: Path, told: Told, done: Followed, runs: TorsoRuns) -> None:
    from pipeline.followed import in_space
    from sim.control.writer import write_controls
    from sim.trajectory import save_motion

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
    moved = in_space(runs, controls, told.end)
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
    from sim.simulate import LEVELS

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
    from sim.simulate import LEVELS

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


def _sound(folder: Path) -> Sound:
    from pipeline.audio import Sound

    sound = records.load(Sound, folder / "audio.npz")
    samples, rectified = sound.samples.astype(float), sound.rectified.astype(float)
    return replace(sound, samples=samples, rectified=rectified)


STAGES: dict[str, Stage] = {"follow": follow}
