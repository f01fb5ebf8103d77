from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pipeline import records
from pipeline.markers import prepare, read_recording
from pipeline.raw import RawMarkers
from pipeline.signature import BreathSignature, breath_signature, warp

LABELS = ("CLAV", "STRN", "XIPH", "NAVEL", "C7", "T10", "L1", "LBAK", "RBAK")
PLACES = np.array(
    [
        (0.05, 0, 1.38), (0.09, 0, 1.28), (0.10, 0, 1.21), (0.11, 0, 1.03), (-0.09, 0, 1.47),
        (-0.13, 0, 1.22), (-0.10, 0, 1.12), (-0.13, 0.09, 1.30), (-0.13, -0.09, 1.30),
    ]
)  # fmt: skip


def breath(time, inspiration, expiration, pause, size):
    """Half-cosine up, half-cosine down, rest."""
    down = expiration - pause
    return size * np.where(
        time < inspiration,
        0.5 * (1 - np.cos(np.pi * time / inspiration)),
        np.where(
            time < inspiration + down, 0.5 * (1 + np.cos(np.pi * (time - inspiration) / down)), 0.0
        ),
    )


def recording_of(cycles, settings, rate=100.0, drift=0.0, holes=()):
    """Recording of breaths (inspiration, expiration, pause, size), 1 s of rest before."""
    parts = [np.zeros(round(rate))]
    for inspiration, expiration, pause, size in cycles:
        time = np.arange(round(rate * (inspiration + expiration))) / rate
        parts.append(breath(time, inspiration, expiration, pause, size))
    move = np.concatenate(parts)
    move = move + drift * np.arange(move.size) / move.size
    ways = np.zeros((9, 3))
    ways[:4] = [(0.3, 0, 0.9), (0.7, 0, 0.7), (0.8, 0, 0.4), (1.0, 0, 0.0)]
    tracks = PLACES + move[:, None, None] * ways
    tracks = tracks + 5e-5 * np.random.default_rng(0).normal(size=tracks.shape)
    for first, stop, marker in holes:
        tracks[first:stop, marker] = np.nan
    raw = RawMarkers(
        source="made.c3d", labels=LABELS, positions=tracks, rate=rate, start=0.0, vertical=2,
        notes=(),
    )  # fmt: skip
    return prepare(raw, settings, name="made", posture="upright", mapping=None)


USUAL = (1.6, 2.4, 0.6, 8e-3)


def test_mean_cycle_of_equal_breaths(marker_settings, signature_settings):
    recording = recording_of([USUAL] * 6, marker_settings)
    found = breath_signature(recording, signature_settings)
    assert found.n_used >= 4
    assert found.inspiration_time == pytest.approx(1.6, abs=0.08)
    assert found.expiration_time == pytest.approx(2.4, abs=0.08)
    assert found.pause_time == pytest.approx(0.6, abs=0.3)
    n = signature_settings.n_phase
    assert found.mean.shape == found.low.shape == found.high.shape == (n, 9, 3)
    assert found.time[-1] == pytest.approx(found.inspiration_time + found.expiration_time)
    navel = found.mean[:, 3, 0] - found.mean[0, 3, 0]
    np.testing.assert_allclose(navel, breath(found.time, *USUAL), atol=6e-4)
    assert np.all(found.low <= found.mean + 1e-12)
    assert np.all(found.mean <= found.high + 1e-12)
    assert (found.high - found.low)[:, 3, 0].max() < 8e-4


def test_inspiration_and_expiration_are_warped_apart(marker_settings, signature_settings):
    mixed = [(1.4, 2.8, 0.6, 8e-3), (1.8, 2.2, 0.6, 8e-3)] * 4
    found = breath_signature(recording_of(mixed, marker_settings), signature_settings)
    turn = found.time[np.argmax(found.mean[:, 3, 0])]
    assert turn == pytest.approx(found.inspiration_time, abs=0.08)
    # one warp for the whole cycle would smear the peak: here it keeps its height
    assert np.ptp(found.mean[:, 3, 0]) == pytest.approx(8e-3, rel=0.04)


def test_warp_meets_onset_peak_and_end(marker_settings):
    recording = recording_of([USUAL] * 3, marker_settings)
    time = np.linspace(0.0, 5.0, 51)
    cycle = warp(recording, 1.0, 2.6, 5.0, time, 2.0)
    frames = [100, 260, 500]
    np.testing.assert_allclose(cycle[[0, 20, 50]], recording.positions[frames], atol=1e-9)


def test_unusual_cycles_are_left_out_and_why(marker_settings, signature_settings):
    cycles = [USUAL] * 4 + [(2.5, 4.0, 0.6, 2.2e-2)] + [USUAL] * 3 + [(1.0, 1.2, 0.2, 3e-3)]
    cycles += [USUAL] * 4
    n_before_gap = 100 + 400 * 2
    recording = recording_of(
        cycles, marker_settings, holes=[(n_before_gap + 20, n_before_gap + 120, 1)]
    )
    found = breath_signature(recording, signature_settings)
    assert len(found.onset) == len(cycles)
    assert found.why_not[2].startswith("gap")
    assert found.why_not[4] == "sigh"
    assert found.why_not[8].startswith("outlier")
    assert found.why_not[-1].startswith("edge")
    left_out = {2, 4, 8, 12}
    assert set(np.flatnonzero(~found.used)) == left_out
    assert found.n_used == len(cycles) - len(left_out)
    assert [bool(why) for why in found.why_not] == (~found.used).tolist()
    assert np.isfinite(found.mean).all()


def test_two_breaths_are_enough(marker_settings, signature_settings):
    found = breath_signature(
        recording_of([(2.2, 4.4, 0.3, 2e-2)] * 2, marker_settings), signature_settings
    )
    assert found.n_used == 2
    assert np.isfinite(found.end).all()


def test_times_are_those_of_the_file(
    data_samples, sample_recording, marker_settings, signature_settings
):
    path = data_samples / "subject1.c3d"
    whole = breath_signature(sample_recording("subject1"), signature_settings)
    part = breath_signature(
        read_recording(path, marker_settings, name="a", posture="upright", start_s=30.0),
        signature_settings,
    )
    inside = whole.onset[whole.onset > 32.0]
    for onset in inside:
        assert np.abs(part.onset - onset).min() < 0.15


def test_chestvolume_parts(data_real, marker_settings, signature_settings):
    path = data_real / "chestvolume" / "derived" / "chestvolume_assumed100hz.c3d"
    spread = {}
    for part, (start, end) in {"quiet": (None, 10.0), "deep": (10.0, None)}.items():
        recording = read_recording(
            path, marker_settings, name=part, posture="upright", start_s=start, end_s=end
        )
        found = breath_signature(recording, signature_settings)
        assert found.n_used == 2
        spread[part] = 1e3 * np.ptp(found.mean[:, recording.labels.index("M02"), 0])
    assert spread["quiet"] == pytest.approx(5.9, abs=1.2)
    assert spread["deep"] == pytest.approx(22.0, abs=2.5)


def test_saved_and_loaded(tmp_path, marker_settings, signature_settings):
    found = breath_signature(recording_of([USUAL] * 5, marker_settings), signature_settings)
    records.save(found, tmp_path / "signature.npz")
    back = records.load(BreathSignature, tmp_path / "signature.npz")
    for field in dataclasses.fields(BreathSignature):
        np.testing.assert_array_equal(getattr(back, field.name), getattr(found, field.name))
