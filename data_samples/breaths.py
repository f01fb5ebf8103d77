"""When a subject breathes and how much: breath by breath, then volumes against time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.stats import beta

from data_samples.parameters import Parameters
from data_samples.trunk import Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class Breaths:
    """One entry a breath: times (s), volumes above FRC (m3).

    `onset` is the start of inspiration (the end of the rest before it), `peak` its end, `rest` the
    end of moving expiration, `end` the next onset. `start`, `top`, `stop` are the passive part of
    the lung volume at onset, peak and rest; `active` is what muscles expel below that level;
    `share` is the rib cage's part of the breath.
    """

    onset: Floats
    peak: Floats
    rest: Floats
    end: Floats
    start: Floats
    top: Floats
    stop: Floats
    active: Floats
    share: Floats
    sigh: tuple[bool, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class Volumes:
    """Volumes above FRC against time, (n_frames,) m3; `upper` and `lower` add to `rib_cage`."""

    time: Floats
    lung: Floats
    rib_cage: Floats
    abdomen: Floats
    upper: Floats
    lower: Floats


def _deviates(p: Parameters, rng: np.random.Generator, count: int) -> Floats:
    """Draw standard deviates, correlated from breath to breath, cut at the limit."""
    correlation = p("breath_correlation")
    innovation = rng.standard_normal(count) * np.sqrt(1.0 - correlation**2)
    innovation[0] /= np.sqrt(1.0 - correlation**2)
    limit = p("draw_limit")
    return np.clip(lfilter([1.0], [1.0, -correlation], innovation), -limit, limit)


def _sighs(p: Parameters, rng: np.random.Generator, count: int) -> tuple[bool, ...]:
    """Sighs at random breaths, never among the first or last three."""
    flags = np.zeros(count, dtype=bool)
    flags[rng.choice(np.arange(3, count - 3), size=int(p("n_sighs")), replace=False)] = True
    return tuple(bool(flag) for flag in flags)


def draw_breaths(p: Parameters, rng: np.random.Generator) -> Breaths:
    """Breaths that cover the recording, from one before its start to one after its end."""
    count = int(np.ceil(p("duration") * p("breathing_rate") * 1.3)) + 4
    period = np.exp(p("period_cv") * _deviates(p, rng, count)) / p("breathing_rate")
    tidal = np.exp(p("tidal_cv") * _deviates(p, rng, count)) * p("tidal_volume")
    timing = np.exp(p("timing_cv") * _deviates(p, rng, count))
    level = p("rest_level_sd") * _deviates(p, rng, count + 1)
    first = -period[0] * rng.uniform(0.2, 0.9)
    within = first + np.concatenate([[0.0], np.cumsum(period)[:-1]]) < p("duration")
    sigh = _sighs(p, rng, int(within.sum()))
    large = np.where(np.pad(sigh, (0, count - len(sigh))), 1.0, 0.0)
    period *= 1.0 + large * (p("sigh_stretch") - 1.0)
    tidal = np.where(large > 0.0, p("sigh_ratio") * p("tidal_volume"), tidal)
    onset = first + np.concatenate([[0.0], np.cumsum(period)[:-1]])
    moving = 1.0 - p("pause_fraction")
    peak = onset + period * moving * timing / (1.0 + p("exp_insp_ratio"))
    level += p("rest_level_drift") * np.append(onset, onset[-1] + period[-1])
    active = np.full(count, p("active_volume")) * tidal / p("tidal_volume")
    active = np.minimum(active, 0.5 * tidal)
    # What was expelled before a breath returns with it: inspired volume is the tidal volume.
    top = level[:-1] + tidal - np.append(active[:1], active[:-1])
    keep = slice(0, int((onset < p("duration")).sum()))
    return Breaths(
        onset=onset[keep],
        peak=peak[keep],
        rest=(onset + period * moving)[keep],
        end=(onset + period)[keep],
        start=level[:-1][keep],
        top=top[keep],
        stop=level[1:][keep],
        active=active[keep],
        share=np.clip(p("rib_cage_share") + p("share_sd") * _deviates(p, rng, count), 0.0, 0.97)[
            keep
        ],
        sigh=sigh[keep],
    )


def _passive(p: Parameters, breaths: Breaths, time: Floats, scale: Floats) -> Floats:
    """Passive volume against time with each breath's swing above its start scaled."""
    volume = np.empty_like(time)
    insp, exp = (p("insp_a"), p("insp_b")), (p("passive_a"), p("passive_b"))
    level = scale[0] * breaths.start[0]
    for k in range(len(breaths.onset)):
        frames = (time >= breaths.onset[k]) & (time < breaths.end[k])
        t = time[frames]
        rise = beta.cdf((t - breaths.onset[k]) / (breaths.peak[k] - breaths.onset[k]), *insp)
        fall = beta.cdf((t - breaths.peak[k]) / (breaths.rest[k] - breaths.peak[k]), *exp)
        up = scale[k] * (breaths.top[k] - breaths.start[k])
        down = up + scale[k] * (breaths.start[k] - breaths.stop[k])
        volume[frames] = level + up * rise - down * fall
        level += up - down
    return volume


def _active(p: Parameters, breaths: Breaths, time: Floats) -> Floats:
    """Volume held below the passive level by expiratory muscles, (n_frames,) m3, >= 0."""
    volume = np.zeros_like(time)
    insp, push = (p("insp_a"), p("insp_b")), (p("active_a"), p("active_b"))
    before = breaths.active[0]
    for k in range(len(breaths.onset)):
        frames = (time >= breaths.onset[k]) & (time < breaths.end[k])
        t = time[frames]
        letting_go = p("active_release") * (breaths.peak[k] - breaths.onset[k])
        release = beta.cdf((t - breaths.onset[k]) / letting_go, *insp)
        expel = beta.cdf((t - breaths.peak[k]) / (breaths.rest[k] - breaths.peak[k]), *push)
        volume[frames] = before * (1.0 - release) + breaths.active[k] * expel
        before = breaths.active[k]
    return volume


def volumes(p: Parameters, breaths: Breaths, *, upper_share: float) -> Volumes:
    """Lung volume and its compartments at the frames of the recording.

    Lags are written with the flow, which vanishes at onset, peak and rest: they tilt the loops and
    leave the sum and its turning points alone.
    """
    time = np.arange(round(p("duration") * p("rate"))) / p("rate")
    ones = np.ones(len(breaths.onset))
    passive = _passive(p, breaths, time, ones)
    active = _active(p, breaths, time)
    lung = passive - active
    quadrature = np.gradient(lung, time) / (2.0 * np.pi * p("breathing_rate"))
    share = p("rib_cage_share")
    # atan(w / share) + atan(w / (1 - share)) = phase, to first order in w.
    swap = np.tan(p("phase_angle")) * share * (1.0 - share)
    rib_cage = _passive(p, breaths, time, breaths.share)
    rib_cage = rib_cage - (1.0 - p("active_abdomen_share")) * active - swap * quadrature
    lag = np.tan(p("upper_rib_lag")) * upper_share * (1.0 - upper_share) * share * quadrature
    return Volumes(
        time=time,
        lung=lung,
        rib_cage=rib_cage,
        abdomen=lung - rib_cage,
        upper=upper_share * rib_cage - lag,
        lower=(1.0 - upper_share) * rib_cage + lag,
    )
