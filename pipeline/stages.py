"""Each stage joined to its files: read the records before it, call one function, write."""

from __future__ import annotations

from pathlib import Path

from pipeline import records
from pipeline.job import Job
from pipeline.run import Content, Stage


def _seconds(text: str) -> float | None:
    return float(text) if text else None


def markers(job: Job, folder: Path, processes: int) -> Content:
    """Read and clean the recording."""
    from pipeline.markers import read_recording

    recording = read_recording(
        Path(job.file),
        job.section("markers"),
        name=job.name,
        posture=job.subject["posture"],
        start_s=_seconds(job.recording["start_s"]),
        end_s=_seconds(job.recording["end_s"]),
        marker_map=Path(job.markers) if job.markers else None,
    )
    records.save(recording, folder / "markers.npz")
    n_frames, n_markers = recording.measured.shape
    seconds = n_frames / recording.rate
    return {
        "summary": f"{n_markers} markers, {seconds:.0f} s at {recording.rate:g} Hz",
        "n_markers": n_markers,
        "labels": list(recording.labels),
        "names": list(recording.names),
        "posture": recording.posture,
        "quality": recording.quality,
    }


STAGES: dict[str, Stage] = {"markers": markers}
