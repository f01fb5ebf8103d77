"""Loudness to pressure: the published filter, planted maps, correlation, fifty speakers."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from pipeline.audio import read_sound
from pipeline.correlation import correlate
from pipeline.delimited_text import read_table
from pipeline.envelope import RATE, mean_peak_height, published_envelope, without_floor
from pipeline.pressure import pressure_curve
from pipeline.pressure_map import CalibratedSubject, assumed_map, fit_map
from pipeline.sound_calibration import read_calibration
from sim.errors import InputError
from sim.units import PASCAL_PER_CMH2O


@pytest.mark.parametrize("passes", [1, 2])
def test_low_pass_is_first_order_and_in_time(passes: int) -> None:
    # a slow swell passes with the gain of a first-order filter and without delay
    rate, cutoff, frequency = 8000.0, 10.0, 1.0
    time = np.arange(int(6 * rate)) / rate
    swell = 1 + 0.5 * np.sin(2 * np.pi * frequency * time)
    out = published_envelope(swell, rate, cutoff, passes)
    at = np.arange(len(out)) / RATE
    inside = slice(2000, 4000)
    wave = np.exp(-2j * np.pi * frequency * at[inside])
    response = 2 * (out[inside] * wave).mean() / 0.5
    assert abs(response) == pytest.approx((1 + 0.01) ** (-passes / 2), rel=1e-3)
    assert np.degrees(np.angle(response)) == pytest.approx(-90.0, abs=0.05)


def test_floor_is_taken_off() -> None:
    at = np.arange(0, 3, 1 / RATE)
    muddy = 1.0 + 0.3 * np.cos(2 * np.pi * 5 * at)
    clear = without_floor(muddy)[500:-500]
    assert clear.min() < 0.05 * clear.max()
    assert mean_peak_height(muddy) == pytest.approx(1.3, abs=0.01)


def person(rng: np.random.Generator, form, scale: float, noise: float = 0.05) -> CalibratedSubject:
    level = rng.uniform(0.05, 1.5, 4000)
    pressure = form(level) + noise * rng.normal(size=4000)
    return CalibratedSubject(
        name="one",
        loudness=level,
        filtered=pressure,
        measured=pressure,
        active=np.ones(4000, dtype=bool),
        mean_peak=scale,
    )


def test_planted_line_and_power_come_back() -> None:
    rng = np.random.default_rng(2)
    line = fit_map([person(rng, lambda e: 0.2 + 0.7 * e, 1500.0) for _ in range(4)], "linear")
    assert (line.offset, line.slope) == pytest.approx((0.2, 0.7), abs=0.01)
    power = fit_map([person(rng, lambda e: 0.9 * e**0.6, 1500.0) for _ in range(4)], "power")
    assert (power.slope, power.exponent) == pytest.approx((0.9, 0.6), abs=0.01)


def test_interval_narrows_with_more_people_and_never_under_its_scatter() -> None:
    rng = np.random.default_rng(3)
    people = [person(rng, lambda e: e, 1500.0 * np.exp(0.35 * rng.normal())) for _ in range(40)]
    widths = []
    for count in (1, 3, 10, 40):
        low, high = fit_map(people[:count], "linear").band(np.array([1.0]), 0.9)
        widths.append(float(np.log(high[0] / max(low[0], 1.0))))
    assert widths[0] > widths[1] > widths[3]
    assert widths[3] > 2 * 1.645 * 0.3


def test_without_calibration_it_is_an_assumption(
    data_samples: Path, audio_settings, pressure_settings
) -> None:
    sound = read_sound(data_samples / "laugh2.flac", audio_settings)
    curve = pressure_curve(sound, assumed_map("linear", "male"), pressure_settings)
    assert not curve.calibrated
    assert (curve.low <= curve.pressure).all() and (curve.pressure <= curve.high).all()
    # level of recording and intensity: the one changes nothing, the other all alike
    soft = dataclasses.replace(sound, samples=sound.samples / 100, rectified=sound.rectified / 100)
    again = pressure_curve(soft, assumed_map("linear", "male"), pressure_settings)
    np.testing.assert_allclose(again.pressure, curve.pressure, rtol=1e-6, atol=1e-6)
    twice = dataclasses.replace(pressure_settings, intensity=2.0)
    louder = pressure_curve(sound, assumed_map("linear", "male"), twice)
    np.testing.assert_allclose(louder.high, 2 * curve.high)


def test_correlation_and_its_interval() -> None:
    rng = np.random.default_rng(4)
    # slow curves: ten thousand samples that say as much as a hundred
    slow = np.repeat(rng.normal(size=(2, 100)), 100, axis=1)
    mixed = slow[0] + slow[1]
    found = correlate(slow[0], mixed, block=200, draws=400, probability=0.9, rng=rng)
    assert found.r == pytest.approx(stats.pearsonr(slow[0], mixed).statistic)
    assert found.low < found.r < found.high
    naive = 2 * 1.645 * (1 - found.r**2) / np.sqrt(len(mixed))
    assert found.high - found.low > 4 * naive


def test_shipped_sample_is_recovered(data_samples: Path, audio_settings, pressure_settings) -> None:
    table = data_samples / "calibration" / "calibration.tsv"
    people = read_calibration(table, audio_settings, pressure_settings, stronger=False)
    assert len(people) == 3
    for name in ("laugh1", "laugh2"):
        sound = read_sound(data_samples / f"{name}.flac", audio_settings)
        curve = pressure_curve(sound, fit_map(people, "linear"), pressure_settings)
        truth = read_table(data_samples / f"{name}.truth.csv").numbers
        true = PASCAL_PER_CMH2O * np.interp(curve.time, truth[:, 0], truth[:, 1])
        assert np.corrcoef(curve.pressure, true)[0, 1] > 0.92


def test_calibration_complaints(tmp_path: Path, audio_settings, pressure_settings) -> None:
    table = tmp_path / "calibration.tsv"
    table.write_text("subject\taudio\na\tb.wav\n")
    with pytest.raises(InputError, match="columns subject, audio, pressure"):
        read_calibration(table, audio_settings, pressure_settings, stronger=False)


@pytest.mark.slow
def test_fifty_speakers(targets) -> None:
    people = targets.speakers(50, seed=1)
    for form in ("linear", "power"):
        found = targets.recovery(people, form, 10)
        assert found["r"] >= 0.92
        assert 0.85 <= found["coverage in bouts"] <= 0.95
        assert 0.85 <= found["coverage"] <= 0.95
