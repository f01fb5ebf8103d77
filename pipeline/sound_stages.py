"""The stages of a laugh joined to their files: audio, pressure, calls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import calls_file, records
from pipeline.job import Job
from pipeline.records import seconds_or_none, write_rows
from pipeline.run import Content, Stage
from sim.errors import InputError
from sim.units import PASCAL_PER_CMH2O

if TYPE_CHECKING:
    from pipeline.audio import Sound
    from pipeline.calls import Candidates
    from pipeline.calls_file import Call
    from pipeline.laughter import Verdict
    from pipeline.pressure import PressureCurve
    from pipeline.pressure_map import PressureMap
    from pipeline.settings import CallSettings

MUDDY_DB = 8.0


def audio(job: Job, folder: Path, processes: int) -> Content:
    """Read the sound, and tell which kind it is."""
    from pipeline.audio import read_sound
    from pipeline.calls import call_envelope, find_calls
    from pipeline.sound_kind import kind_measures, tell_kind
    from pipeline.voice import frame_measures

    sound = read_sound(
        Path(job.file),
        job.section("audio"),
        start_s=seconds_or_none(job.recording["start_s"]),
        end_s=seconds_or_none(job.recording["end_s"]),
    )
    records.save(_as_type(sound, np.float32), folder / "audio.npz")
    frames, settings = frame_measures(sound.samples, sound.rate), job.section("calls")
    found = find_calls(call_envelope(sound, settings), frames, settings)
    kind = tell_kind(kind_measures(found, frames))
    quality = sound.quality
    return {
        "summary": f"{quality['duration_s']:.1f} s at {quality['rate_hz']:g} Hz, {kind.sentence}",
        "kind": kind.kind,
        "kind_confidence": kind.confidence,
        "kind_of_each": kind.of_each,
        "quality": quality,
        "warnings": sound.warnings,
    }


def pressure(job: Job, folder: Path, processes: int) -> Content:
    """Turn loudness into lung pressure."""
    from pipeline.pressure import pressure_curve

    sound, settings = _sound(folder), job.section("pressure")
    stronger = job.section("calls").stronger
    form, figures, notes = _map(job, stronger)
    curve = pressure_curve(sound, form, settings, stronger=stronger)
    records.save(curve, folder / "pressure.npz")
    write_rows(folder / "pressure.csv", _pressure_rows(curve, settings.table_rate_hz))
    top = float(curve.pressure.max()) / PASCAL_PER_CMH2O
    word = "calibrated" if curve.calibrated else "relative, scale assumed"
    return {
        "summary": f"up to {top:.0f} cmH2O ({word})",
        "calibrated": curve.calibrated,
        "map": form.form,
        "offset": form.offset,
        "slope": form.slope,
        "exponent": form.exponent,
        "mean_peak_cmh2o": curve.mean_peak / PASCAL_PER_CMH2O,
        "mean_peak_log_sd": form.scale_log_sd,
        "highest_cmh2o": top,
        "probability": settings.probability,
        "calibration": figures,
        "notes": notes,
    }


def _map(job: Job, stronger: bool) -> tuple[PressureMap, dict[str, Any], list[str]]:
    """Return the map from loudness to pressure, figures of its calibration, and what to say."""
    from pipeline.pressure_map import assumed_map, fit_map
    from pipeline.sound_calibration import calibration_figures, read_calibration

    settings = job.section("pressure")
    if not job.markers:
        form = assumed_map(settings.map, job.subject["sex"])
        note = (
            "no calibration recording: the pressure is relative, its scale in cmH2O (a mean peak of"
            f" {form.scale / PASCAL_PER_CMH2O:.1f}) an assumption"
        )
        return form, {}, [note]
    subjects = read_calibration(
        Path(job.markers), job.section("audio"), settings, stronger=stronger
    )
    form = fit_map(subjects, settings.map)
    return form, calibration_figures(subjects, form, settings, job.seed), []


def _pressure_rows(curve: PressureCurve, rate: float) -> list[dict[str, str]]:
    step = max(1, round(curve.rate / rate))
    word = calls_file.YES if curve.calibrated else calls_file.NO
    values = [v[::step] / PASCAL_PER_CMH2O for v in (curve.pressure, curve.low, curve.high)]
    return [
        {
            "time_s": f"{t:.3f}",
            "pressure_cmh2o": f"{p:.2f}",
            "low": f"{low:.2f}",
            "high": f"{high:.2f}",
            "calibrated": word,
        }
        for t, p, low, high in zip(curve.time[::step], *values, strict=True)
    ]


def calls(job: Job, folder: Path, processes: int) -> Content:
    """Find calls and bouts, say what is no laughter, or respect what a person made of it."""
    from pipeline.calls import call_envelope, find_breaths, find_calls
    from pipeline.laughter import judge
    from pipeline.voice import frame_measures

    sound, settings = _sound(folder), job.section("calls")
    frames = frame_measures(sound.samples, sound.rate)
    envelope = call_envelope(sound, settings)
    found = find_calls(envelope, frames, settings)
    verdicts = judge(found, frames, settings)
    laughing = np.isin(found.bout, [one.bout for one in verdicts if one.laughter])
    edited = calls_file.is_edited(folder)
    breaths = [(a + sound.start, b + sound.start) for a, b in find_breaths(found, laughing, frames)]
    automatic = _listed(found, verdicts, sound.start, breaths)
    listed = automatic
    if edited:
        listed = _completed(calls_file.read_calls(folder / calls_file.TABLE), sound, envelope)
    calls_file.write_calls(folder / calls_file.FOUND, automatic)
    if not edited:
        calls_file.write_calls(folder / calls_file.TABLE, listed)
    calls_file.write_text_grid(
        folder / calls_file.GRID, listed, breaths, sound.start, sound.start + sound.duration
    )
    _draw(folder, sound, listed, breaths)
    kept = [one for one in listed if one.kept]
    bouts = len({one.bout for one in kept})
    why = "" if kept else _why_no_laugh(verdicts)
    counted = f"{_count(len(kept), 'call')} in {_count(bouts, 'bout')}"
    summary = counted if kept else f"no laugh found: {why}"
    return {
        "summary": summary + (", calls.csv edited by hand" if edited else ""),
        "n_calls": len(kept),
        "n_bouts": bouts,
        "n_voiced": sum(one.voiced for one in kept),
        "calls_per_s": _rate(kept),
        "edited": edited,
        "laughter": bool(kept),
        "why_no_laugh": why,
        "calls": [asdict(one) for one in listed],
        "inhalations_s": [[round(a, 3), round(b, 3)] for a, b in breaths],
        "valley_depth_db": found.depth,
        "bouts": _judged(found, verdicts, sound.start),
        "warnings": _warnings(found, settings, why, edited),
    }


def _numbers(verdicts: Sequence[Verdict]) -> dict[int, int]:
    """Number of each bout of peaks among the bouts of laughter; 0 for what is none."""
    laughs = [one.bout for one in verdicts if one.laughter]
    return {one.bout: laughs.index(one.bout) + 1 if one.laughter else 0 for one in verdicts}


def _listed(
    found: Candidates,
    verdicts: Sequence[Verdict],
    start: float,
    breaths: Sequence[tuple[float, float]],
) -> list[Call]:
    of, numbers = {one.bout: one for one in verdicts}, _numbers(verdicts)
    out = []
    for i, peak in enumerate(start + found.peak):
        verdict = of[int(found.bout[i])]
        why_not = verdict.why_not
        if not verdict.laughter and any(a <= peak <= b for a, b in breaths):
            why_not = "a breath in between bouts"
        out.append(
            calls_file.Call(
                call=i + 1,
                start=start + float(found.start[i]),
                peak_time=float(peak),
                end=start + float(found.end[i]),
                peak=float(found.height[i]),
                bout=numbers[verdict.bout],
                voiced=bool(found.voiced[i]),
                kept=verdict.laughter,
                why_not=why_not,
            )
        )
    return out


def _judged(found: Candidates, verdicts: Sequence[Verdict], start: float) -> list[dict[str, Any]]:
    """Every bout of peaks with its verdict, for the record."""
    numbers = _numbers(verdicts)
    return [
        {
            **asdict(one),
            "bout": numbers[one.bout],
            "start_s": round(start + float(found.start[found.of_bout(one.bout)].min()), 3),
            "end_s": round(start + float(found.end[found.of_bout(one.bout)].max()), 3),
        }
        for one in verdicts
    ]


def _completed(listed: list[Call], sound: Sound, envelope: np.ndarray[Any, Any]) -> list[Call]:
    """Fill in what a person left empty: the peak, its height, the bout of the call before."""
    from pipeline.envelope import RATE, mean_peak_height

    out: list[Call] = []
    top, last = mean_peak_height(envelope), sound.start + sound.duration
    for one in listed:
        if one.start < sound.start - 1e-3 or one.end > last + 1e-3:
            raise InputError(
                f"{calls_file.TABLE}: call {one.call}: lies outside the sound, which runs from"
                f" {sound.start:.2f} to {last:.2f} s. Correct it."
            )
        first = round((one.start - sound.start) * RATE)
        piece = envelope[first : max(first + 1, round((one.end - sound.start) * RATE))]
        at = one.peak_time
        if not np.isfinite(at):
            at = one.start + float(piece.argmax()) / RATE
        height = one.peak if np.isfinite(one.peak) else float(piece.max()) / top
        bout = one.bout or ((out[-1].bout if out else 0) or 1 if one.kept else 0)
        out.append(replace(one, peak_time=at, peak=height, bout=bout))
    return out


def _rate(kept: Sequence[Call]) -> float:
    steps = [b.peak_time - a.peak_time for a, b in pairwise(kept) if a.bout == b.bout]
    return 1.0 / float(np.median(steps)) if steps else float("nan")


def _count(number: int, word: str) -> str:
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def _why_no_laugh(verdicts: Sequence[Verdict]) -> str:
    """Return the reason of the bout that came nearest: the one with most voiced calls."""
    if not verdicts:
        return "no peak of loudness stands out"
    return max(verdicts, key=lambda one: (one.voiced, one.calls)).why_not


def _warnings(found: Candidates, settings: CallSettings, why: str, edited: bool) -> list[str]:
    out = []
    if why:
        out.append(f"no laugh found: {why}")
    if edited:
        out.append("calls.csv was edited by hand and is respected; delete it to have it made anew")
    if found.depth < MUDDY_DB and not settings.stronger:
        out.append(
            f"muddy: the valleys between calls are only {found.depth:.0f} dB deep; try the setting"
            " calls.stronger: true"
        )
    return out


def _draw(
    folder: Path,
    sound: Sound,
    listed: Sequence[Call],
    breaths: Sequence[tuple[float, float]],
) -> None:
    from pipeline.draw.sound import calls_svg, spectrogram_svg
    from pipeline.pressure import PressureCurve

    curve = records.load(PressureCurve, folder / "pressure.npz")
    drawing = calls_svg(
        samples=sound.samples,
        rate=sound.rate,
        start=sound.start,
        time=curve.time,
        pressure=curve.pressure / PASCAL_PER_CMH2O,
        low=curve.low / PASCAL_PER_CMH2O,
        high=curve.high / PASCAL_PER_CMH2O,
        calibrated=bool(curve.calibrated),
        probability=float(curve.probability),
        spans=[(one.start, one.peak_time, one.end) for one in listed],
        kept=[one.kept for one in listed],
        voiced=[one.voiced for one in listed],
        bout=[one.bout for one in listed],
        breaths=breaths,
    )
    records.write_text(folder / "calls.svg", drawing)
    records.write_text(
        folder / "spectrogram.svg",
        spectrogram_svg(samples=sound.samples, rate=sound.rate, start=sound.start),
    )


def _sound(folder: Path) -> Sound:
    from pipeline.audio import Sound

    return _as_type(records.load(Sound, folder / "audio.npz"), np.float64)


def _as_type(sound: Sound, kind: type[np.floating[Any]]) -> Sound:
    """Return the sound with samples of another type; on disk single precision is plenty."""
    samples, rectified = sound.samples.astype(kind), sound.rectified.astype(kind)
    return replace(sound, samples=samples, rectified=rectified)


STAGES: dict[str, Stage] = {"audio": audio, "pressure": pressure, "calls": calls}
