"""Make the four synthetic subjects: `python -m data_samples.make_samples` from the repository.

The model is kinematic (rib rotations and a bulging wall scaled by volumes) and shares nothing with
the simulated torso, so that a fit to it is a test.
"""

from __future__ import annotations

import argparse
import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from data_samples.breaths import Breaths, Volumes, draw_breaths, volumes
from data_samples.c3d_file import MM_PER_M, write_c3d
from data_samples.disturbances import gaps, skin_and_noise, sway
from data_samples.modes import Modes, build_modes
from data_samples.parameters import FOLDER, Parameters, read_parameters, read_places
from data_samples.trunk import Floats, build_trunk, place_markers

ML_PER_M3 = 1e6
TRUTH_EVERY = 4


@dataclass(frozen=True, kw_only=True, slots=True)
class Subject:
    """Who is recorded, and in which of the usual file forms."""

    name: str
    sex: str
    style: str
    prefix: str
    lost: str
    integers: bool


SUBJECTS = (
    Subject(name="subject1", sex="male", style="rib-cage breather, slight active exhale",
            prefix="", lost="zero", integers=True),
    Subject(name="subject2", sex="female", style="pure rib-cage breather, passive exhale",
            prefix="", lost="zero_unflagged", integers=True),
    Subject(name="subject3", sex="male", style="mixed, active exhale",
            prefix="subject3:", lost="zero", integers=True),
    Subject(name="subject4", sex="female", style="mixed, passive exhale",
            prefix="", lost="nan", integers=False),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class Sample:
    """A recording and everything that is true about it (positions in laboratory axes, m)."""

    labels: tuple[str, ...]
    rest: Floats
    hips: Floats
    modes: Modes
    breaths: Breaths
    volumes: Volumes
    positions: Floats
    lost: NDArray[np.bool_]


def make(p: Parameters) -> Sample:
    """One subject's recording; every random stream comes from the seed and the subject's name."""
    number = int(p.subject.removeprefix("subject"))
    streams = [np.random.default_rng([int(p("seed")), number, k]) for k in range(4)]
    places = read_places()
    trunk = build_trunk(p)
    rest, azimuth = place_markers(trunk, places)
    modes = build_modes(p, trunk, rest, azimuth)
    breaths = draw_breaths(p, streams[0])
    volume = volumes(p, breaths, upper_share=modes.rib_cage_share_upper)
    body = (
        rest
        + volume.upper[:, None, None] * modes.upper
        + volume.lower[:, None, None] * modes.lower
        + volume.abdomen[:, None, None] * modes.abdomen
    )
    body = body + skin_and_noise(p, streams[2], body.shape)
    turn, shift = sway(p, streams[1], volume.lung / p("tidal_volume"))
    hips = np.array([0.5 * trunk.depth(trunk.heights["bottom"]), 0.0, trunk.heights["bottom"]])
    moved = np.einsum("fij,fmj->fmi", turn.as_matrix(), body - hips) + hips + shift[:, None]
    heading = Rotation.from_rotvec([0.0, 0.0, p("heading")])
    return Sample(
        labels=tuple(place.label for place in places),
        rest=rest,
        hips=hips,
        modes=modes,
        breaths=breaths,
        volumes=volume,
        positions=moved @ heading.as_matrix().T,
        lost=gaps(p, streams[3], *body.shape[:2]),
    )


def _breath_rows(p: Parameters, sample: Sample) -> list[dict[str, object]]:
    breaths, v = sample.breaths, sample.volumes
    rows: list[dict[str, object]] = []
    for k in range(len(breaths.onset)):
        if breaths.onset[k] < 0.0 or breaths.end[k] > p("duration"):
            continue
        at = [round(time * p("rate")) for time in (breaths.onset[k], breaths.peak[k])]
        inspired = v.lung[at[1]] - v.lung[at[0]]
        rows.append(
            {
                "onset_s": round(float(breaths.onset[k]), 4),
                "peak_s": round(float(breaths.peak[k]), 4),
                "rest_s": round(float(breaths.rest[k]), 4),
                "end_s": round(float(breaths.end[k]), 4),
                "tidal_volume_ml": round(float(inspired) * ML_PER_M3, 1),
                "rib_cage_share": round(
                    float((v.rib_cage[at[1]] - v.rib_cage[at[0]]) / inspired), 4
                ),
                "end_expiratory_volume_ml": round(float(v.lung[at[0]]) * ML_PER_M3, 1),
                "sigh": breaths.sigh[k],
            }
        )
    return rows


def _marker_rows(sample: Sample) -> dict[str, object]:
    modes = (sample.modes.upper, sample.modes.lower, sample.modes.abdomen)
    return {
        label: {
            "rest_mm": [round(float(x) * MM_PER_M, 2) for x in sample.rest[k]],
            **{
                f"{name}_mm_per_l": [round(float(x), 3) for x in mode[k] * MM_PER_M / 1e3]
                for name, mode in zip(("upper", "lower", "abdomen"), modes, strict=True)
            },
        }
        for k, label in enumerate(sample.labels)
    }


def truth(subject: Subject, p: Parameters, sample: Sample) -> dict[str, object]:
    """Tell what is true about a recording, in the units that the keys name."""
    inspiratory = (p("tlc_per_stature") - p("frc_per_stature")) * p("stature")
    inspiratory += p("tlc_constant") - p("frc_constant") - p("frc_per_year") * p("age")
    return {
        "subject": subject.name,
        "style": subject.style,
        "sex": subject.sex,
        "stature_m": p("stature"),
        "mass_kg": p("mass"),
        "posture": "upright",
        "seed": int(p("seed")),
        "rate_hz": p("rate"),
        "duration_s": p("duration"),
        "heading_deg": round(float(np.degrees(p("heading"))), 6),
        "axes": "X anterior, Y left, Z up for rest_mm and *_mm_per_l; laboratory Z up in the C3D",
        "onset": "start of inspiration, the end of the rest before it",
        "inspiratory_capacity_l": round(inspiratory * 1e3, 3),
        "rib_cage_volume_of_full_rotation_l": round(sample.modes.full_rotation_volume * 1e3, 3),
        "trunk_shift_mm_per_tidal_volume": round(p("breath_shift") * MM_PER_M, 3),
        "trunk_pitch_deg_per_tidal_volume": round(float(np.degrees(p("breath_pitch"))), 3),
        "usual_tidal_volume_ml": round(p("tidal_volume") * ML_PER_M3, 1),
        "hips_mm": [round(float(x) * MM_PER_M, 2) for x in sample.hips],
        "rib_cage_share_upper": round(sample.modes.rib_cage_share_upper, 5),
        "markers_lost_fraction": round(float(sample.lost.mean()), 6),
        "breaths": _breath_rows(p, sample),
        "markers": _marker_rows(sample),
    }


def _write_volumes(path: Path, volume: Volumes) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time_s", "lung_ml", "rib_cage_ml", "abdomen_ml"])
        table = np.stack([volume.lung, volume.rib_cage, volume.abdomen], axis=1) * ML_PER_M3
        for time, row in zip(volume.time[::TRUTH_EVERY], table[::TRUTH_EVERY], strict=True):
            writer.writerow([f"{time:.2f}", *(f"{value:.2f}" for value in row)])


def write(subject: Subject, folder: Path) -> None:
    """Write `NAME.c3d`, `NAME.truth.json` and `NAME.truth.csv` into a folder."""
    p = read_parameters(subject.name, subject.sex)
    sample = make(p)
    positions = sample.positions.copy()
    positions[sample.lost] = np.nan if subject.lost == "nan" else 0.0
    flagged = subject.lost != "zero_unflagged"
    write_c3d(
        folder / f"{subject.name}.c3d",
        labels=tuple(subject.prefix + label for label in sample.labels),
        positions=positions,
        residuals=np.where(sample.lost & flagged, -1.0, 0.0),
        rate=p("rate"),
        step=p("file_step") if subject.integers else None,
    )
    (folder / f"{subject.name}.truth.json").write_text(
        json.dumps(truth(subject, p, sample), indent=1) + "\n", encoding="utf-8"
    )
    _write_volumes(folder / f"{subject.name}.truth.csv", sample.volumes)


def main() -> None:
    """Write all subjects, or the one that is asked for."""
    parser = argparse.ArgumentParser(description="Make the synthetic subjects.")
    names = [subject.name for subject in SUBJECTS]
    parser.add_argument("--subject", choices=names, help="only this one")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder to write into")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    for subject in SUBJECTS:
        if chosen.subject in (None, subject.name):
            write(subject, chosen.out)


if __name__ == "__main__":
    main()
