"""Calls, bouts, what is no laughter: planted laughs, music, real recordings."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pipeline.audio import Sound
from pipeline.calls import call_envelope, find_breaths, find_calls
from pipeline.laughter import judge
from pipeline.voice import frame_measures

RATE = 16000


def sound_of(samples: np.ndarray) -> Sound:
    return Sound(
        source="planted",
        rate=float(RATE),
        start=0.0,
        samples=samples,
        rectified=np.abs(samples),
        quality={},
        warnings=(),
    )


def judged(samples: np.ndarray, settings):
    sound = sound_of(samples)
    frames = frame_measures(sound.samples, sound.rate)
    found = find_calls(call_envelope(sound, settings), frames, settings)
    return found, judge(found, frames, settings), frames


def notes(pitches: list[float], seconds: float = 0.2, decay: float = 10.0) -> np.ndarray:
    time = np.arange(int(seconds * RATE)) / RATE
    fade = np.minimum(1, np.minimum(time / 0.01, (seconds - time) / 0.02)) * np.exp(-decay * time)
    played = [
        fade * sum(np.sin(2 * np.pi * k * pitch * time) / k for k in range(1, 7))
        for pitch in pitches
    ]
    noise = 1e-4 * np.random.default_rng(0).normal(size=len(pitches) * len(time))
    return np.concatenate(played) + noise


@pytest.mark.parametrize("name", ["laugh1", "laugh2"])
def test_samples(data_samples: Path, targets, name: str) -> None:
    found, verdicts, frames = targets.analyse(data_samples / f"{name}.flac")
    truth = json.loads((data_samples / f"{name}.truth.json").read_text())
    good = targets.kept(found, verdicts)
    marked = np.array([call["peak_s"] for call in truth["calls"]])
    assert targets.f1(targets.hits(found.peak[good], marked)) == 1.0
    # cut within the valley of the pressure, whose middle is where the truth was cut
    ends = np.array([call["end_s"] for call in truth["calls"]])
    inner = np.diff([call["bout"] for call in truth["calls"]]) == 0
    assert np.abs(found.end[good][:-1][inner] - ends[:-1][inner]).max() < 0.08
    breaths = find_breaths(found, good, frames)
    assert len(breaths) == len(truth["inhalations_s"])
    for (begin, end), (true_begin, true_end) in zip(breaths, truth["inhalations_s"], strict=True):
        assert min(end, true_end) - max(begin, true_begin) > 0.6 * (true_end - true_begin)


@pytest.mark.parametrize(
    ("samples", "word"),
    [
        (notes([440.0] * 15), "music"),
        (notes([220.0, 247.0, 277.0, 294.0, 330.0] * 3), "music"),
        (notes([262.0] * 12, decay=2.0), "music"),
        (np.random.default_rng(1).normal(0, 0.1, 3 * RATE), "too few"),
        (notes([200.0, 190.0]), "too few"),
        (np.r_[np.zeros(RATE), notes([200.0])], "too few"),
    ],
)
def test_what_is_no_laughter(samples: np.ndarray, word: str, call_settings) -> None:
    _, verdicts, _ = judged(samples, call_settings)
    assert not any(one.laughter for one in verdicts)
    assert all(one.why_not for one in verdicts)
    assert any(word in one.why_not for one in verdicts) or not verdicts


def test_level_and_offset_of_time_change_nothing(data_samples: Path, call_settings) -> None:
    import soundfile

    samples, _ = soundfile.read(data_samples / "laugh2.flac")
    first, _, _ = judged(samples, call_settings)
    second, _, _ = judged(samples / 100, call_settings)
    np.testing.assert_allclose(first.peak, second.peak)
    later, _, _ = judged(np.r_[samples[:1600], samples], call_settings)
    np.testing.assert_allclose(later.peak - 0.1, first.peak, atol=0.003)


def test_annotated_recordings(data_real: Path, targets) -> None:
    total = np.zeros(3, dtype=int)
    marks = sorted(data_real.rglob("*.calls.csv"))
    assert len(marks) == 5
    for marked_file in marks:
        stem = marked_file.name.split(".")[0]
        path = next(p for p in marked_file.parent.glob(f"{stem}.*") if p.suffix in targets.SOUNDS)
        marked = targets.pd.read_csv(marked_file)
        found, verdicts, _ = targets.analyse(path)
        good = targets.kept(found, verdicts) & found.voiced
        voiced = marked.loc[marked["kind"] == "voiced", "peak_s"].to_numpy()
        total += targets.hits(found.peak[good], voiced)
    assert targets.f1(tuple(total)) >= 0.9


def test_speech_is_no_laugh(data_real: Path, targets) -> None:
    folder = data_real / "audio_derived"
    found, verdicts, _ = targets.analyse(folder / "speech_only_jfk.flac")
    assert len(found.peak) > 20
    assert not any(one.laughter for one in verdicts)
    found, verdicts, _ = targets.analyse(
        data_real / "wikimedia_commons" / "en_uk_ha_ha_dcoffset.ogg"
    )
    assert not any(one.laughter for one in verdicts)


def test_laugh_under_speech_keeps_its_clean_bouts(data_real: Path, targets) -> None:
    found, verdicts, _ = targets.analyse(data_real / "audio_derived" / "laugh_plus_speech_0dB.flac")
    marked = targets.pd.read_csv(
        data_real / "wikimedia_commons" / "bursting_out_laughing.calls.csv"
    )
    clean = marked.loc[(marked["kind"] == "voiced") & (marked["peak_s"] > 9.0), "peak_s"]
    good = targets.kept(found, verdicts) & found.voiced & (found.peak > 9.0)
    assert targets.f1(targets.hits(found.peak[good], clean.to_numpy())) >= 0.9


def test_a_bout_forty_decibels_down_is_kept(targets, call_settings) -> None:
    parameters = {**targets.laughs.read_parameters(), "noise_level": -70.0}
    rng = np.random.default_rng(3)
    speaker = targets.laughs.draw_speaker(rng, "male", parameters)
    laugh = targets.laughs.draw_laugh(rng, speaker, (6, 6), parameters)
    middle = int((laugh.peaks[5] + laugh.peaks[6]) / 2 * RATE)
    sound = laugh.sound / np.abs(laugh.sound).max()
    samples = np.r_[sound[:middle] / 100, np.zeros(RATE), sound[middle:]]
    found, verdicts, _ = judged(samples, call_settings)
    marked = laugh.peaks + np.r_[np.zeros(6), np.ones(6)]
    kept = targets.kept(found, verdicts)
    assert targets.hits(found.peak[kept], marked) == (12, 12, 12)
