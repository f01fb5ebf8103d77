"""Sound files to samples at a working rate; the only module that reads audio."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import soundfile
from numpy.typing import NDArray
from scipy import signal

from pipeline.settings import AudioSettings
from sim.errors import InputError

Floats = NDArray[np.float64]

MIN_RATE = 8000.0
"""Hz; the voice's formants lie below 4 kHz."""
EXPORT = "Export it anew as WAV or FLAC."


@dataclass(frozen=True, kw_only=True, slots=True)
class Sound:
    """A recording of sound without offset, at the working rate.

    Parameters
    ----------
    source : file, for messages
    rate : Hz
    start : s, time of the first sample in the file's own time
    samples : (n,), the loudest channel, full scale = 1
    rectified : (n,), root mean square over the channels: |samples| of a file with one
    quality : what was found about the file, units in the keys
    warnings : one sentence each
    """

    source: str
    rate: float
    start: float
    samples: Floats
    rectified: Floats
    quality: dict[str, Any]
    warnings: tuple[str, ...]

    @property
    def duration(self) -> float:
        """Length, s."""
        return len(self.samples) / self.rate


def read_sound(
    path: Path,
    settings: AudioSettings,
    *,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Sound:
    """Read a sound file, or a part of it.

    Parameters
    ----------
    path : WAV, FLAC, OGG, MP3 and whatever else libsndfile reads
    settings : section `audio`
    start_s, end_s : s in the file's time; None is its start or end
    """
    raw, rate, start, about = _read_part(path, settings, start_s, end_s)
    warnings: list[str] = []
    raw, mended = _finite(path, raw)
    if mended:
        warnings.append(f"{mended} samples were not numbers; straight lines bridge them")
    offset = raw.mean(axis=0)
    peak = float(np.abs(raw - offset).max())
    if peak <= 0.0:
        raise InputError(f"{path}: sound: every sample is the same, silence. Record again.")
    flat = max(clipped_share(channel) for channel in raw.T)
    if flat > settings.clipped_share:
        warnings.append(
            f"clipped: {100 * flat:.2g} % of the samples lie on a flat top; the loudest parts were"
            " louder than they look, and the pressure there is too low"
        )
    if np.abs(raw).max() > 1.0:
        warnings.append("decoded samples go beyond full scale, as lossy files may")
    clean = _high_pass(raw - offset, rate, settings.highpass_hz)
    clean, work_rate = _resample(clean, rate, settings.rate_hz)
    loudest = int(np.argmax((clean**2).mean(axis=0)))
    quality = {
        **about,
        "duration_s": raw.shape[0] / rate,
        "peak": peak,
        "dc_offset": float(offset[np.argmax(np.abs(offset))]),
        "clipped_share": flat,
        "samples_mended": mended,
        "working_rate_hz": work_rate,
        "channel_used": loudest + 1,
        "channel_correlation": _channel_correlation(clean, loudest),
    }
    if quality["channel_correlation"] is not None and quality["channel_correlation"] < 0.5:
        warnings.append(
            f"the channels differ (correlation {quality['channel_correlation']:.2f}): their mean"
            " power gives the pressure, the loudest one the voice"
        )
    return Sound(
        source=str(path),
        rate=work_rate,
        start=start,
        samples=np.ascontiguousarray(clean[:, loudest]),
        rectified=np.sqrt((clean**2).mean(axis=1)),
        quality=quality,
        warnings=tuple(warnings),
    )


def _read_part(
    path: Path, settings: AudioSettings, start_s: float | None, end_s: float | None
) -> tuple[Floats, float, float, dict[str, Any]]:
    """Samples (n, n_channels), rate, time of the first one, and what the file says of itself."""
    try:
        with soundfile.SoundFile(path) as file:
            rate, total = float(file.samplerate), int(file.frames)
            about = {
                "file": path.name,
                "format": f"{file.format}/{file.subtype}",
                "rate_hz": rate,
                "channels": file.channels,
            }
            _check_rate(path, rate)
            first, stop = _part(path, rate, total, start_s, end_s)
            _check_length(path, (stop - first) / rate, settings)
            file.seek(first)
            raw = file.read(stop - first, dtype="float64", always_2d=True)
    except (soundfile.LibsndfileError, OSError, ValueError) as error:
        raise InputError(_unreadable(path, error)) from error
    _check_length(path, raw.shape[0] / rate, settings)
    return raw, rate, first / rate, about


def read_samples(path: Path) -> tuple[Floats, int]:
    """Samples (n, n_channels) of a sound file as they are, full scale = 1, and their rate, Hz."""
    try:
        samples, rate = soundfile.read(path, dtype="float64", always_2d=True)
    except (soundfile.LibsndfileError, OSError, ValueError) as error:
        raise InputError(_unreadable(path, error)) from error
    return samples, int(rate)


def _unreadable(path: Path, error: Exception) -> str:
    """One line that names the remedy; the library's own words are for programmers."""
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except FileNotFoundError:
        return f"{path}: there is no such file. Correct the path."
    except OSError as problem:
        return f"{path}: cannot be read ({problem.strerror}). Mend its permissions."
    if not head:
        return f"{path}: sound: the file is empty. {EXPORT}"
    if head[:4] == b"OggS":
        track = " (it begins with a Skeleton track)" if b"fishead" in head else ""
        return (
            f"{path}: sound: an Ogg file that the sound library refuses{track}. Convert it first;"
            f" ffmpeg -i {path.name} {path.stem}.flac does it."
        )
    if b"\x00" not in head and head.isascii():
        return f"{path}: sound: holds text, not sound. {EXPORT}"
    words = " ".join(str(getattr(error, "error_string", error)).split()).rstrip(".")
    return f"{path}: sound: cannot be read ({words}). {EXPORT}"


def _check_rate(path: Path, rate: float) -> None:
    if rate < MIN_RATE:
        raise InputError(
            f"{path}: rate {rate:g} Hz: too low to tell voice from noise. Record at"
            f" {MIN_RATE:g} Hz or more."
        )


def _check_length(path: Path, seconds: float, settings: AudioSettings) -> None:
    if seconds < settings.min_duration_s:
        held = "no samples" if seconds == 0 else f"only {seconds:.3g} s"
        raise InputError(
            f"{path}: sound: holds {held}; at least {settings.min_duration_s:g} s are needed."
            " Give a longer recording."
        )
    if seconds > settings.max_duration_s:
        raise InputError(
            f"{path}: sound: lasts {seconds:.0f} s, more than {settings.max_duration_s:g} s. Name"
            " the part with start_s and end_s, or raise audio.max_duration_s."
        )


def _part(
    path: Path, rate: float, total: int, start_s: float | None, end_s: float | None
) -> tuple[int, int]:
    last = total / rate
    begin = 0.0 if start_s is None else start_s
    end = last if end_s is None else end_s
    if total and not 0.0 <= begin < last:
        raise InputError(
            f"{path}: start_s {begin:g}: outside the file, which lasts {last:.2f} s. Change it."
        )
    if total and not begin < end <= last + 0.5:
        raise InputError(
            f"{path}: end_s {end:g}: must lie after start_s ({begin:g}) and not after the end of"
            f" the file ({last:.2f} s). Change it."
        )
    return round(begin * rate), min(total, round(end * rate))


def _finite(path: Path, raw: Floats) -> tuple[Floats, int]:
    """Bridge single samples that are not numbers; refuse a file full of them."""
    bad = ~np.isfinite(raw)
    count = int(bad.sum())
    if count > 0.01 * raw.size:
        raise InputError(
            f"{path}: samples: {100 * count / raw.size:.0f} % are not numbers. {EXPORT}"
        )
    if count:
        raw = raw.copy()
        at = np.arange(len(raw))
        for channel in range(raw.shape[1]):
            good = ~bad[:, channel]
            raw[:, channel] = np.interp(at, at[good], raw[good, channel]) if good.any() else 0.0
    return raw, count


def clipped_share(channel: Floats) -> float:
    """Share of samples that stand in runs of three or more on the file's own flat top.

    A converter that runs out of range leaves equal samples, at full scale or below it where the
    level was lowered afterwards. Both ends are looked at, the worse one counts.
    """
    shares = []
    for side in (channel, -channel):
        top = float(side.max())
        if top <= 0.0:
            continue
        at_top = side >= top * (1.0 - 1e-3)
        edges = np.diff(np.concatenate([[0], at_top.astype(np.int8), [0]]))
        runs = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
        long = runs[runs >= 3]
        # one loud low note also turns slowly at its top, once
        shares.append(float(long.sum()) / len(side) if len(long) >= 3 else 0.0)
    return max(shares, default=0.0)


def _high_pass(raw: Floats, rate: float, cutoff: float) -> Floats:
    sections = signal.butter(2, cutoff, "highpass", fs=rate, output="sos")
    pad = min(len(raw) - 1, round(rate / cutoff))
    return np.asarray(signal.sosfiltfilt(sections, raw, axis=0, padlen=pad), dtype=np.float64)


def _resample(clean: Floats, rate: float, wanted: float) -> tuple[Floats, float]:
    """Bring a faster file to the working rate; a slower one stays as it is."""
    if rate <= wanted:
        return clean, rate
    divisor = math.gcd(round(rate), round(wanted))
    up, down = round(wanted) // divisor, round(rate) // divisor
    return np.asarray(signal.resample_poly(clean, up, down, axis=0), dtype=np.float64), wanted


def _channel_correlation(clean: Floats, loudest: int) -> float | None:
    """Lowest correlation of a channel that holds sound with the loudest one; None for mono."""
    power = (clean**2).sum(axis=0)
    others = [i for i in range(clean.shape[1]) if i != loudest and power[i] > 1e-4 * power[loudest]]
    if not others:
        return None
    main = clean[:, loudest]
    return min(
        abs(float(main @ clean[:, i])) / math.sqrt(power[loudest] * power[i]) for i in others
    )
