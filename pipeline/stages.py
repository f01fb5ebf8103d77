"""Each stage joined to its files: read the records before it, call one function, write."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import follow_stage, records, retraining_stage, sound_stages
from pipeline.job import Job
from pipeline.report_tables import main_error
from pipeline.run import Content, Stage

if TYPE_CHECKING:
    from pipeline.fit import FitResult
    from pipeline.markers import MarkerRecording
    from pipeline.model import Bend, TorsoModel
    from pipeline.signature import BreathSignature


def markers(job: Job, folder: Path, processes: int) -> Content:
    """Read and clean the recording."""
    from pipeline.draw.recording import input_svg, marker_names
    from pipeline.markers import read_recording

    recording = read_recording(
        Path(job.file),
        job.section("markers"),
        name=job.name,
        posture=job.subject["posture"],
        start_s=records.seconds_or_none(job.recording["start_s"]),
        end_s=records.seconds_or_none(job.recording["end_s"]),
        marker_map=Path(job.markers) if job.markers else None,
    )
    records.save(recording, folder / "markers.npz")
    shown = marker_names(recording.names, recording.labels)
    drawing = input_svg(
        positions=recording.positions,
        measured=recording.measured,
        rate=recording.rate,
        start=recording.start,
        shown=shown,
        front=recording.sagittal,
        back=recording.back,
    )
    records.write_text(folder / "input.svg", drawing)
    n_frames, n_markers = recording.measured.shape
    seconds = n_frames / recording.rate
    return {
        "summary": f"{n_markers} markers, {seconds:.0f} s at {recording.rate:g} Hz",
        "n_markers": n_markers,
        "labels": recording.labels,
        "names": recording.names,
        "posture": recording.posture,
        "quality": recording.quality,
    }


def signature(job: Job, folder: Path, processes: int) -> Content:
    """Find the breaths and average them."""
    from pipeline.draw.recording import cycles_svg, marker_names, signature_svg
    from pipeline.signature import breath_signature

    recording = _recording(folder)
    found = breath_signature(recording, job.section("signature"))
    records.save(found, folder / "signature.npz")
    records.write_rows(folder / "cycles.csv", _cycle_rows(found))
    drawing = cycles_svg(
        signal=found.breathing_signal,
        rate=found.rate,
        start=recording.start,
        onset=found.onset,
        peak=found.peak,
        used=found.used,
    )
    records.write_text(folder / "cycles.svg", drawing)
    drawing = signature_svg(
        time=found.time,
        mean=found.mean,
        low=found.low,
        high=found.high,
        turn=found.inspiration_time,
        shown=marker_names(recording.names, recording.labels),
        front=recording.sagittal,
    )
    records.write_text(folder / "signature.svg", drawing)
    period = found.inspiration_time + found.expiration_time
    return {
        "summary": f"{found.n_used} of {len(found.onset)} breaths used, {period:.1f} s each",
        "n_cycles": len(found.onset),
        "n_used": found.n_used,
        "inspiration_time_s": found.inspiration_time,
        "expiration_time_s": found.expiration_time,
        "pause_time_s": found.pause_time,
        "breaths_per_min": 60 / period,
    }


def _cycle_rows(found: BreathSignature) -> list[dict[str, Any]]:
    events = zip(found.onset, found.peak, found.end, found.used, found.why_not, strict=True)
    return [
        {
            "cycle": number,
            "onset_s": f"{onset:.3f}",
            "peak_s": f"{peak:.3f}",
            "end_s": f"{end:.3f}" if np.isfinite(end) else "",
            "used": "yes" if used else "no",
            "why_not": why_not,
        }
        for number, (onset, peak, end, used, why_not) in enumerate(events)
    ]


def _recording(folder: Path) -> MarkerRecording:
    from pipeline.markers import MarkerRecording

    return records.load(MarkerRecording, folder / "markers.npz")


def _signature(folder: Path) -> BreathSignature:
    from pipeline.signature import BreathSignature

    return records.load(BreathSignature, folder / "signature.npz")


def _model(job: Job, processes: int) -> tuple[TorsoModel, tuple[str, ...]]:
    from pipeline.model import TorsoModel
    from pipeline.population import subject_size
    from sim.model.torso import Subject

    size = subject_size(job.subject)
    subject = Subject(sex=size.sex, stature=size.stature, mass=size.mass)
    return TorsoModel(subject=subject, workers=processes), size.notes


def fit(job: Job, folder: Path, processes: int) -> Content:
    """Fit the torso to the breath."""
    from pipeline.fit import fit_breath

    model, notes = _model(job, processes)
    recording, found = _recording(folder), _signature(folder)
    result = fit_breath(recording, found, model, job.section("fit"), job.seed)
    records.save(result, folder / "fit.npz")
    records.write_rows(folder / "errors.csv", result.errors)
    _draw_fit(folder, recording, found, result)
    figures = _keep_breath(job, folder, result, model, found)
    main = main_error(result.errors)
    error, still = float(main["error_p_mm"]), float(main["error_p_still_mm"])
    return {
        "summary": f"error {error:.2f} mm, not moving {still:.2f} mm",
        "levels": dict(zip(result.groups, result.levels.tolist(), strict=True)),
        "stop": str(result.stop),
        "n_runs": len(result.trace_cost),
        "cost_mm": 1e3 * result.cost,
        "fit_scale": result.fit_scale,
        **_bend_degrees(result.bend),
        "registration_residual_mm": 1e3 * float(np.nanmean(np.abs(result.residual))),
        "tidal_volume_l": 1e3 * float(np.ptp(result.lung_volume)),
        **figures,
        "cycle_how": result.cycle_how,
        "errors": result.errors,
        "notes": notes,
        "warnings": result.warnings,
    }


def _bend_degrees(bend: Bend) -> Content:
    """Bend of the spine by the way it goes, if it was fitted and is any."""
    ways = ("flexion", "lateral", "twist")
    angles = np.degrees(bend).round(2).tolist()
    return {f"spine_{way}_deg": angle for way, angle in zip(ways, angles, strict=True) if any(bend)}


def _draw_fit(
    folder: Path, recording: MarkerRecording, found: BreathSignature, result: FitResult
) -> None:
    from pipeline.cost import play
    from pipeline.draw import fit as draw
    from pipeline.draw.recording import marker_names

    period = result.inspiration_time + result.expiration_time
    measured, low, high = (
        play(found.time, band, period, result.time) for band in (found.mean, found.low, found.high)
    )
    shown = marker_names(recording.names, recording.labels)
    simulated, front = result.positions, recording.sagittal
    drawings = {
        "sagittal": draw.sagittal_svg(
            measured=measured, simulated=simulated, shown=shown, front=front
        ),
        "markers_time": draw.markers_time_svg(
            time=result.time,
            measured=measured,
            low=low,
            high=high,
            simulated=simulated,
            shown=shown,
            front=front,
        ),
        "trace": draw.trace_svg(
            cost=result.trace_cost,
            still=result.cost_still,
            levels=result.trace_levels,
            groups=result.groups,
        ),
        "volume": draw.volume_svg(
            time=result.time, volume=result.lung_volume, turn=result.inspiration_time
        ),
    }
    for name, drawing in drawings.items():
        records.write_text(folder / f"{name}.svg", drawing)


def _keep_breath(
    job: Job, folder: Path, result: FitResult, model: TorsoModel, found: BreathSignature
) -> dict[str, Any]:
    """Write the torso's motion over the best breath; return its figures."""
    from pipeline.breath_motion import RIBS, best_breath, with_measured
    from pipeline.draw.fit import ribs_svg
    from pipeline.population import subject_age
    from sim.motion import dressed
    from sim.trajectory import save_motion

    breath = best_breath(result, model, job.section("fit").frame_rate_hz)
    motion = with_measured(breath.motion, result, found)
    about: dict[str, str | int] = {
        "version": job.version,
        "seed": job.seed,
        "recording": job.name,
        "subject": job.recording["subject"],
        "posture": result.posture,
    }
    motion = dressed(motion, subject_age(job.subject))
    save_motion(folder / "trajectory.h5", motion, about)
    drawing = ribs_svg(time=breath.motion.time, pump=breath.pump, bucket=breath.bucket, ribs=RIBS)
    records.write_text(folder / "ribs.svg", drawing)
    return breath.figures


def posterior(job: Job, folder: Path, processes: int) -> Content:
    """Give the activations intervals."""
    from pipeline.draw.posterior import posterior_svg
    from pipeline.fit import FitResult
    from pipeline.inference_data import write_netcdf
    from pipeline.uncertainty import sample_posterior

    model, _ = _model(job, processes)
    result = records.load(FitResult, folder / "fit.npz")
    found = sample_posterior(
        result,
        _recording(folder),
        _signature(folder),
        model,
        job.section("posterior"),
        job.seed,
    )
    write_netcdf(found, folder / "posterior.nc")
    records.write_rows(folder / "activations.csv", found.activations)
    draws = found.draws.reshape(-1, len(found.groups))
    if len(draws):
        drawing = posterior_svg(draws=draws, best=result.levels, groups=found.groups)
        records.write_text(folder / "posterior.svg", drawing)
    warnings = [found.why] if found.why else []
    if not found.converged:
        warnings.append(found.convergence)
    return {
        "summary": found.why or f"intervals from {len(draws)} draws",
        "intervals": found.status,
        "convergence": found.convergence,
        "tau": found.tau,
        "r_hat": found.r_hat,
        "emulator_error_mm": 1e3 * found.emulator_error,
        "emulator_share_of_residual_variance": found.emulator_share,
        "residual_mm": 1e3 * found.residual,
        "n_runs": found.n_runs,
        "noise_mm": 1e3 * found.noise,
        "n_effective_values": found.n_effective,
        "n_values": found.n_values,
        "correlation": found.correlation,
        "identifiability": found.identifiability,
        "warnings": warnings,
    }


STAGES: dict[str, Stage] = {
    "markers": markers,
    "signature": signature,
    "fit": fit,
    "posterior": posterior,
    **sound_stages.STAGES,
    **follow_stage.STAGES,
    **retraining_stage.STAGES,
}
