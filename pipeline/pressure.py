"""From the sound of a laugh to lung pressure, with what is not known about it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.audio import Sound
from pipeline.envelope import RATE, mean_peak_height, presence, published_envelope, without_floor
from pipeline.pressure_map import PressureMap
from pipeline.settings import PressureSettings

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, slots=True)
class PressureCurve:
    """Predicted tracheal pressure, which is the lung's (Finnegan 1999), over atmosphere.

    Parameters
    ----------
    time : (n,), s in the file's time, at `rate`
    pressure, low, high : (n,), Pa
    loudness : (n,), over its mean peak height
    active : (n,), where there is sound; elsewhere the pressure is nothing, with a wide band
    rate : Hz
    calibrated : whether a person's sound and pressure were measured together
    mean_peak : Pa, the scale that the curve was given
    probability : of the interval
    """

    time: Floats
    pressure: Floats
    low: Floats
    high: Floats
    loudness: Floats
    active: Bools
    rate: float
    calibrated: bool
    mean_peak: float
    probability: float


def loudness(sound: Sound, settings: PressureSettings, *, stronger: bool) -> tuple[Floats, Floats]:
    """Loudness over its mean peak height at RATE, and how much there is sound, 0 to 1.

    Parameters
    ----------
    sound : a recording
    settings : section `pressure`
    stronger : take the floor under the valleys off first
    """
    envelope = published_envelope(sound.rectified, sound.rate, settings.cutoff_hz, settings.passes)
    if stronger:
        envelope = without_floor(envelope)
    top = max(mean_peak_height(envelope), 1e-30)
    there = presence(envelope, top, settings.active_share, settings.fade_s)
    return envelope / top, there


def pressure_curve(
    sound: Sound, form: PressureMap, settings: PressureSettings, *, stronger: bool = False
) -> PressureCurve:
    """Predict the pressure behind a sound.

    Parameters
    ----------
    sound : a recording
    form : of `pressure_map.fit_map` or, without calibration, `assumed_map`
    settings : section `pressure`
    stronger : as setting `calls.stronger`
    """
    level, there = loudness(sound, settings, stronger=stronger)
    pressure = there * form.scale * form.shape(level)
    low, high = form.band(level, settings.probability)
    quiet_low, quiet_high = form.quiet_band(settings.probability)
    low = there * low + (1.0 - there) * quiet_low
    high = there * high + (1.0 - there) * quiet_high
    factor = settings.intensity
    return PressureCurve(
        time=sound.start + np.arange(len(level)) / RATE,
        pressure=factor * pressure,
        low=factor * np.minimum(low, pressure),
        high=factor * np.maximum(high, pressure),
        loudness=level,
        active=there >= 0.5,
        rate=RATE,
        calibrated=form.n_subjects > 0,
        mean_peak=factor * form.scale,
        probability=settings.probability,
    )
