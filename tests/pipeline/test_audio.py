"""Sound files of every form: a right result or one clear line."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import soundfile

from pipeline.audio import clipped_share, read_sound
from pipeline.settings import AudioSettings
from sim.errors import InputError

RATE = 16000


def tone(seconds: float = 1.0, rate: int = RATE, pitch: float = 200.0) -> np.ndarray:
    time = np.arange(int(seconds * rate)) / rate
    # a chord with a swell: no flat top of its own
    swell = 0.3 * (1 + 0.5 * np.sin(2 * np.pi * 3 * time))
    return swell * (np.sin(2 * np.pi * pitch * time) + 0.3 * np.sin(2 * np.pi * 3.1 * pitch * time))


@pytest.mark.parametrize(
    ("name", "subtype"),
    [
        ("a.wav", "PCM_U8"),
        ("a.wav", "PCM_16"),
        ("a.wav", "PCM_24"),
        ("a.wav", "FLOAT"),
        ("a.wav", "DOUBLE"),
        ("a.flac", "PCM_16"),
        ("a.ogg", "VORBIS"),
        ("a.mp3", "MPEG_LAYER_III"),
    ],
)
def test_forms(tmp_path: Path, audio_settings: AudioSettings, name: str, subtype: str) -> None:
    soundfile.write(tmp_path / name, tone(), RATE, subtype=subtype)
    sound = read_sound(tmp_path / name, audio_settings)
    assert sound.duration == pytest.approx(1.0, abs=0.1)
    assert np.sqrt((sound.samples**2).mean()) == pytest.approx(
        np.sqrt((tone() ** 2).mean()), rel=0.05
    )


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 44100, 48000, 96000, 192000])
def test_rates(tmp_path: Path, audio_settings: AudioSettings, rate: int) -> None:
    soundfile.write(tmp_path / "a.wav", tone(rate=rate), rate)
    sound = read_sound(tmp_path / "a.wav", audio_settings)
    assert sound.rate == min(rate, audio_settings.rate_hz)
    assert len(sound.samples) == pytest.approx(sound.rate, abs=1)


def test_offset_is_removed_and_reported(tmp_path: Path, audio_settings: AudioSettings) -> None:
    soundfile.write(tmp_path / "a.wav", tone() + 0.3, RATE)
    sound = read_sound(tmp_path / "a.wav", audio_settings)
    assert abs(sound.samples.mean()) < 1e-3
    assert sound.quality["dc_offset"] == pytest.approx(0.3, abs=0.01)


def test_level_does_not_matter(tmp_path: Path, audio_settings: AudioSettings) -> None:
    soundfile.write(tmp_path / "loud.wav", tone(), RATE, subtype="PCM_24")
    soundfile.write(tmp_path / "soft.wav", tone() / 100, RATE, subtype="PCM_24")
    loud = read_sound(tmp_path / "loud.wav", audio_settings)
    soft = read_sound(tmp_path / "soft.wav", audio_settings)
    np.testing.assert_allclose(100 * soft.rectified, loud.rectified, atol=2e-4)


def test_seven_channels_that_have_nothing_in_common(
    tmp_path: Path, audio_settings: AudioSettings
) -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(0, [0.01, 0.02, 0.03, 0.2, 0.02, 0.1, 0.0], (RATE, 7))
    soundfile.write(tmp_path / "a.wav", noise, RATE)
    sound = read_sound(tmp_path / "a.wav", audio_settings)
    assert sound.quality["channels"] == 7
    assert sound.quality["channel_used"] == 4
    assert sound.quality["channel_correlation"] < 0.1
    assert any("channels differ" in line for line in sound.warnings)


def test_channels_in_opposition_do_not_cancel(
    tmp_path: Path, audio_settings: AudioSettings
) -> None:
    soundfile.write(tmp_path / "a.wav", np.stack([tone(), -tone()], axis=1), RATE)
    sound = read_sound(tmp_path / "a.wav", audio_settings)
    assert sound.rectified.max() == pytest.approx(np.abs(tone()).max(), rel=0.05)


def test_clipping_is_found_below_full_scale(tmp_path: Path, audio_settings: AudioSettings) -> None:
    soundfile.write(tmp_path / "a.wav", 0.8 * np.clip(2 * tone(), -0.5, 0.5), RATE)
    sound = read_sound(tmp_path / "a.wav", audio_settings)
    assert any("clipped" in line for line in sound.warnings)
    assert clipped_share(tone(3.0)) < audio_settings.clipped_share


def test_some_samples_that_are_no_numbers(tmp_path: Path, audio_settings: AudioSettings) -> None:
    samples = tone()
    samples[100:110] = np.nan
    soundfile.write(tmp_path / "a.wav", samples, RATE, subtype="FLOAT")
    sound = read_sound(tmp_path / "a.wav", audio_settings)
    assert sound.quality["samples_mended"] == 10
    assert np.isfinite(sound.samples).all()


def written(path: Path, samples: np.ndarray, rate: int = RATE, **form: str) -> Path:
    soundfile.write(path, samples, rate, **form)
    return path


def text_named_wav(folder: Path) -> Path:
    (folder / "a.wav").write_text("ha ha ha\n" * 100)
    return folder / "a.wav"


def empty(folder: Path) -> Path:
    (folder / "a.wav").touch()
    return folder / "a.wav"


def skeleton(folder: Path) -> Path:
    (folder / "a.ogg").write_bytes(b"OggS" + bytes(24) + b"fishead\x00" + bytes(300))
    return folder / "a.ogg"


BAD = {
    "empty": (empty, "is empty"),
    "no frames": (lambda f: written(f / "a.wav", np.zeros(0)), "no samples"),
    "all zero": (lambda f: written(f / "a.wav", np.zeros(RATE)), "silence"),
    "constant": (lambda f: written(f / "a.wav", np.full(RATE, 0.5)), "silence"),
    "0.05 s": (lambda f: written(f / "a.wav", tone(0.05)), "only 0.05 s"),
    "two hours": (lambda f: written(f / "a.wav", np.zeros(7200 * 8000), 8000), "start_s and end_s"),
    "not a number": (
        lambda f: written(f / "a.wav", np.full(RATE, np.nan), subtype="FLOAT"),
        "not numbers",
    ),
    "text": (text_named_wav, "holds text"),
    "skeleton": (skeleton, "ffmpeg -i a.ogg a.flac"),
    "slow": (lambda f: written(f / "a.wav", tone(rate=4000), 4000), "8000 Hz or more"),
    "missing": (lambda f: f / "none.wav", "no such file"),
    "folder": (lambda f: f, "cannot be read"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(tmp_path: Path, audio_settings: AudioSettings, case: str) -> None:
    make, words = BAD[case]
    with pytest.raises(InputError) as caught:
        read_sound(make(tmp_path), audio_settings)
    line = str(caught.value)
    assert words in line
    assert "\n" not in line and line.endswith((".", "flac"))


def test_part_of_a_long_file(tmp_path: Path, audio_settings: AudioSettings) -> None:
    samples = np.concatenate([np.zeros(20 * 8000), tone(2.0, rate=8000)])
    soundfile.write(tmp_path / "a.wav", samples, 8000)
    short = dataclasses.replace(audio_settings, max_duration_s=5.0)
    sound = read_sound(tmp_path / "a.wav", short, start_s=20.0, end_s=22.0)
    assert sound.start == 20.0
    assert sound.duration == pytest.approx(2.0)
    with pytest.raises(InputError, match="outside the file"):
        read_sound(tmp_path / "a.wav", audio_settings, start_s=50.0)


def test_every_real_file_is_read_or_answered(
    data_real: Path, audio_settings: AudioSettings
) -> None:
    lines = {}
    for path in sorted(data_real.rglob("*")):
        if path.suffix in {".wav", ".flac", ".ogg", ".mp3"}:
            try:
                read_sound(path, audio_settings)
            except InputError as error:
                lines[path.name] = str(error)
    assert set(lines) == {
        "2XgDqz_cough-shallow_ALLZERO.flac",
        "9XKj7f_cough-heavy_EMPTY.wav",
        "bursting_out_laughing_skeleton.ogg",
    }
    assert "ffmpeg" in lines["bursting_out_laughing_skeleton.ogg"]
