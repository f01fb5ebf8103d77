"""Figures of laughs, coughs and sneezes."""

from __future__ import annotations

import numpy as np

from pipeline.validation.behaviours import Run
from pipeline.validation.static_figures import MMHG, Figures
from sim.events import burst_frames, burst_rate, fall_shares
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.units import PASCAL_PER_CMH2O as CMH2O

LITRES = 1e3
STILL = 0.05e-3
"""m^3/s; below it the glottis counts as closed."""
PROMINENCE = 0.2
"""Share of the largest flow above which a sneeze still breathes out."""


def laugh_figures(run: Run, resting: RestingTorso) -> Figures:
    """Burst rate, Hz; duration, s; drop of volume, L, and its shares; Pga - Pes, cmH2O."""
    t, time = run.trajectory, run.motion.time
    peaks = burst_frames(t.alveolar)
    low, rest = int(np.argmin(t.lung)), float(run.rest.volumes["lung"][0])
    rise = (t.abdominal - t.pleural) - float(t.abdominal[0] - t.pleural[0])
    shares = fall_shares(run.motion, run.rest, low) or {}
    return {
        "burst_rate": burst_rate(time, t.alveolar) or 0.0,
        "duration": float(time[peaks[-1]] - time[peaks[0]]) if len(peaks) else 0.0,
        "volume_drop": LITRES * (rest - float(t.lung[low])),
        "pdi_rise": float(np.mean(rise[peaks])) / CMH2O if len(peaks) else 0.0,
        **{f"share_{part}": share for part, share in shares.items()},
    }


def cough_figures(run: Run, resting: RestingTorso) -> Figures:
    """Gastric pressure, cmH2O; flow, L/s; volumes, L; times of the strongest cough of a run."""
    t, time = run.trajectory, run.motion.time
    peak = int(np.argmax(t.flow))
    start, end = _around(t.flow, peak, STILL)
    begin = shut = max(start - 1, 0)
    while begin > 0 and abs(t.flow[begin - 1]) < STILL:
        begin -= 1
    rate = np.gradient(t.pleural, time) / CMH2O
    gastric = float(t.abdominal.max() - t.abdominal[0]) / CMH2O
    return {
        "gastric_pressure": gastric,
        "gastric_pressure_mmhg": gastric / MMHG,
        "oesophageal_pressure": float(t.pleural.max() - t.pleural[0]) / CMH2O,
        "pressure_rate": float(rate.max()),
        "peak_flow": LITRES * float(t.flow[peak]),
        "peak_flow_l_min": 60.0 * LITRES * float(t.flow[peak]),
        "compression": float(time[shut] - time[begin]),
        "time_to_peak_ms": 1e3 * float(time[peak] - time[shut]),
        "expired": LITRES * float(t.lung[shut] - t.lung[end]),
        "inspired": LITRES * float(t.lung[: peak + 1].max() - t.lung[0]),
    }


def sneeze_figures(run: Run, resting: RestingTorso) -> Figures:
    """The same of a sneeze, and how long its burst lasts, s; what wavers after it is no part."""
    flow, time = run.trajectory.flow, run.motion.time
    peak = int(np.argmax(flow))
    start, end = _around(flow, peak, PROMINENCE * float(flow[peak]))
    return cough_figures(run, resting) | {"expiration": float(time[end] - time[start])}


def _around(flow: Floats, peak: int, level: float) -> tuple[int, int]:
    """First and last frame about a peak in which the flow stays above a level."""
    start = end = peak
    while start > 0 and flow[start - 1] > level:
        start -= 1
    while end + 1 < len(flow) and flow[end + 1] > level:
        end += 1
    return start, end
