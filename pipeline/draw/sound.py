"""Figures of a sound: waveform, pressure with its interval, calls; and the spectrogram."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy import signal

from pipeline.draw.figure import ACCENT, FAINT, MEASURED, SIMULATED, as_svg, panels

Floats = NDArray[np.float64]

N_WAVE, N_CURVE = 1500, 2500
RANGE_DB = 60.0
N_IMAGE = 500


def calls_svg(
    *,
    samples: Floats,
    rate: float,
    start: float,
    time: Floats,
    pressure: Floats,
    low: Floats,
    high: Floats,
    calibrated: bool,
    probability: float,
    spans: Sequence[tuple[float, float, float]],
    kept: Sequence[bool],
    voiced: Sequence[bool],
    bout: Sequence[int],
    breaths: Sequence[tuple[float, float]],
) -> str:
    """Waveform and pressure over time with the calls.

    Parameters
    ----------
    samples, rate, start : of the sound, Hz, s
    time : s; pressure, low, high : (n,), cmH2O
    calibrated : whether the scale was measured; probability : of the interval
    spans : start, peak, end of each call, s; kept, voiced, bout : of each
    breaths : inhalations, s
    """
    figure, (wave, curve) = panels(2, 1, width=9.0, height=4.6, share_x=True)
    _waveform(wave, samples, rate, start)
    shown = slice(None, None, max(1, len(time) // N_CURVE))
    curve.fill_between(
        time[shown],
        low[shown],
        high[shown],
        color=FAINT,
        alpha=0.5,
        lw=0,
        label=f"{probability:.0%} interval",
    )
    curve.plot(time[shown], pressure[shown], color=SIMULATED, label="pressure", lw=1.2)
    _calls((wave, curve), spans, kept, voiced, bout)
    for axis in (wave, curve):
        for k, (first, last) in enumerate(breaths):
            label = "inhalation" if k == 0 and axis is curve else None
            axis.axvspan(first, last, color="#6a4fa3", alpha=0.12, lw=0, label=label)
    wave.set_title("sound; shaded: calls that are kept, hatched: unvoiced, grey: not laughter")
    word = "calibrated" if calibrated else "relative: the scale is an assumption"
    curve.set_title(f"lung pressure ({word})")
    curve.set_ylabel("cmH2O")
    curve.set_xlabel("s")
    curve.legend(fontsize=6, loc="upper right", ncols=3)
    curve.set_xlim(start, start + len(samples) / rate)
    return as_svg(figure, timed=(wave, curve))


def _waveform(axis: Axes, samples: Floats, rate: float, start: float) -> None:
    """Range of the samples in as many pieces as can be seen."""
    parts = np.array_split(samples, min(N_WAVE, len(samples)))
    at = start + (np.arange(len(parts)) + 0.5) * len(samples) / rate / len(parts)
    low, high = [p.min() for p in parts], [p.max() for p in parts]
    axis.fill_between(at, low, high, color=MEASURED, lw=0.3)
    axis.set_ylabel("full scale = 1")


def _calls(
    axes: Sequence[Axes],
    spans: Sequence[tuple[float, float, float]],
    kept: Sequence[bool],
    voiced: Sequence[bool],
    bout: Sequence[int],
) -> None:
    named: set[int] = set()
    for (first, peak, last), good, voice, number in zip(spans, kept, voiced, bout, strict=True):
        colour = ACCENT if good else FAINT
        for axis in axes:
            axis.axvspan(
                first,
                last,
                facecolor=colour,
                edgecolor=ACCENT if good else FAINT,
                alpha=0.22 if good else 0.35,
                lw=0.5,
                hatch="" if voice else "////",
            )
        axes[0].plot([peak], [0.0], marker="|", color=SIMULATED if good else FAINT, ms=14)
        if good and number not in named:
            named.add(number)
            axes[0].annotate(
                f"bout {number}",
                (first, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2, -8),
                textcoords="offset points",
                fontsize=7,
                color=ACCENT,
            )


def spectrogram_svg(*, samples: Floats, rate: float, start: float) -> str:
    """Power over time and frequency, 60 dB deep.

    Parameters
    ----------
    samples, rate, start : of the sound, Hz, s
    """
    figure, (axis,) = panels(1, 1, width=9.0, height=2.6)
    window = min(512, len(samples))
    frequency, _, power = signal.spectrogram(
        samples, rate, "hann", window, max(0, window - max(1, len(samples) // N_IMAGE)), mode="psd"
    )
    keep = frequency <= 5000.0
    level = 10 * np.log10(power[keep] + 1e-20)
    level = level[:, :: max(1, level.shape[1] // N_IMAGE)]
    axis.imshow(
        level,
        origin="lower",
        aspect="auto",
        cmap="magma",
        vmin=float(level.max()) - RANGE_DB,
        vmax=float(level.max()),
        extent=(start, start + len(samples) / rate, 0.0, float(frequency[keep][-1]) / 1000.0),
        interpolation="nearest",
    )
    axis.set_ylabel("kHz")
    axis.set_xlabel("s")
    axis.set_title("spectrogram")
    return as_svg(figure, timed=(axis,))
