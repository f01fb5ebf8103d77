"""Calibration recordings: sound and tracheal pressure of the same laughs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.audio import read_sound
from pipeline.calibration_table import calibration_files
from pipeline.correlation import Correlation, correlate
from pipeline.delimited_text import Table, read_table
from pipeline.envelope import RATE, mean_peak_height, published_envelope
from pipeline.pressure import loudness
from pipeline.pressure_map import CalibratedSubject, PressureMap, fit_map
from pipeline.settings import AudioSettings, PressureSettings
from sim.errors import InputError
from sim.units import PASCAL_PER_CMH2O

Floats = NDArray[np.float64]

UNITS = {"pressure_cmh2o": PASCAL_PER_CMH2O, "pressure_pa": 1.0, "pressure_kpa": 1000.0}


def read_calibration(
    table: Path, audio: AudioSettings, settings: PressureSettings, *, stronger: bool
) -> tuple[CalibratedSubject, ...]:
    """Read the calibration recordings of a table.

    Parameters
    ----------
    table : TSV with columns subject, audio, pressure; paths start at its folder
    audio, settings : sections `audio` and `pressure`
    stronger : as for the sound that is to be predicted
    """
    return tuple(
        calibrated_subject(name, sound, pressure, audio, settings, stronger=stronger)
        for name, sound, pressure in calibration_files(table)
    )


def calibrated_subject(
    name: str,
    sound_file: Path,
    pressure_file: Path,
    audio: AudioSettings,
    settings: PressureSettings,
    *,
    stronger: bool = False,
) -> CalibratedSubject:
    """Bring one person's sound and pressure to the same times and to their mean peaks."""
    sound = read_sound(sound_file, audio)
    level, there = loudness(sound, settings, stronger=stronger)
    times, values = _read_pressure(pressure_file)
    grid = np.arange(len(level)) / RATE
    if times[0] > grid[-1] or times[-1] < 0.8 * grid[-1]:
        raise InputError(
            f"{pressure_file}: pressure: runs from {times[0]:.2f} to {times[-1]:.2f} s, its sound"
            f" lasts {grid[-1]:.2f} s. Both must begin together and cover the same time."
        )
    return normalised_subject(name, level, there >= 0.5, np.interp(grid, times, values), settings)


def normalised_subject(
    name: str,
    level: Floats,
    where: NDArray[np.bool_],
    pressure: Floats,
    settings: PressureSettings,
) -> CalibratedSubject:
    """Put measured pressure (n,), Pa at RATE, beside loudness, both over their mean peak."""
    filtered = _low_passed(pressure, settings)
    mean_peak = mean_peak_height(filtered)
    if mean_peak <= 0.0:
        raise InputError(f"{name}: calibration: the pressure never rises. Check its sign.")
    return CalibratedSubject(
        name=name,
        loudness=level,
        filtered=filtered / mean_peak,
        measured=pressure / mean_peak,
        active=where,
        mean_peak=mean_peak,
    )


def _low_passed(pressure: Floats, settings: PressureSettings) -> Floats:
    """Pressure through the low-pass of the sound (dilorenzo2009 §6.3), negative values kept."""
    lowest = float(pressure.min())
    raised = published_envelope(pressure - lowest, RATE, settings.cutoff_hz, settings.passes)
    # before the first sample lies the first value, not nothing
    ahead = published_envelope(
        np.full_like(pressure, 1.0), RATE, settings.cutoff_hz, settings.passes
    )
    return np.asarray(raised / np.maximum(ahead, 1e-3) + lowest, dtype=np.float64)


def _read_pressure(path: Path) -> tuple[Floats, Floats]:
    table = read_table(path)
    names = [name.strip().lower() for name in table.names]
    unit = next((name for name in names if name in UNITS), None)
    if "time_s" not in names or unit is None:
        raise InputError(
            f"{path}: header: needs columns time_s and one of {', '.join(UNITS)}. Rename them."
        )
    times, values = _column(table, names.index("time_s")), _column(table, names.index(unit))
    good = np.isfinite(times) & np.isfinite(values)
    if good.sum() < 10 or np.any(np.diff(times[good]) <= 0):
        raise InputError(f"{path}: time_s: must rise over at least ten rows. Mend the table.")
    return times[good], UNITS[unit] * values[good]


def _column(table: Table, index: int) -> Floats:
    return np.asarray(table.numbers[:, index], dtype=np.float64)


def calibration_figures(
    subjects: Sequence[CalibratedSubject],
    form: PressureMap,
    settings: PressureSettings,
    seed: int,
) -> dict[str, Any]:
    """How well sound tells pressure: within each person, all together, and in people left out."""
    rng = np.random.default_rng(seed)
    within = {
        one.name: asdict(_correlation([(one.loudness, one)], settings, rng)) for one in subjects
    }
    together = _correlation([(one.loudness, one) for one in subjects], settings, rng)
    figures: dict[str, Any] = {
        "n_subjects": len(subjects),
        "within_subject": within,
        "all_subjects": asdict(together),
    }
    if len(subjects) > 1:
        unseen = []
        for k, one in enumerate(subjects):
            others = [s for i, s in enumerate(subjects) if i != k]
            unseen.append((fit_map(others, form.form).shape(one.loudness), one))
        figures["left_out_subject"] = asdict(_correlation(unseen, settings, rng))
    return figures


def _correlation(
    pairs: Sequence[tuple[Floats, CalibratedSubject]],
    settings: PressureSettings,
    rng: np.random.Generator,
) -> Correlation:
    """Of predicted and low-passed measured pressure, in mean peaks, while there is sound."""
    step = round(RATE / 100.0)
    first = np.concatenate([curve[one.active][::step] for curve, one in pairs])
    second = np.concatenate([one.filtered[one.active][::step] for _, one in pairs])
    return correlate(
        first,
        second,
        block=round(settings.block_s * 100.0),
        draws=settings.n_bootstrap,
        probability=settings.probability,
        rng=rng,
    )
