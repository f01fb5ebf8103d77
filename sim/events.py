"""Figures of what is no quiet breath: bursts, pressures, flows and the fall below rest."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import find_peaks

from sim.motion import Motion
from sim.physics.types import Floats, Ints
from sim.simulate import Trajectory
from sim.summary import swept_volume
from sim.units import CUBIC_METRE_PER_LITRE, PASCAL_PER_CMH2O

LEAST_BURST = 1.0 * PASCAL_PER_CMH2O
"""Pa; what rises less above its surroundings is no burst."""
BURST_SHARE = 0.2
"""Of the largest burst; smaller ones are ripple."""
LONGEST_BURST = 0.5
"""s from one burst to the next; what comes more slowly is a breath."""
LEAST_BURSTS = 3
LEAST_FALL = 5e-5
"""m^3; a smaller fall below the resting volume has no shares."""


def burst_frames(pressure: Floats) -> Ints:
    """(n,), frames at which the bursts of a pressure (n_frames,), Pa, are largest."""
    peaks, about = find_peaks(pressure, prominence=LEAST_BURST)
    large = about["prominences"] >= BURST_SHARE * about["prominences"].max(initial=0.0)
    return np.asarray(peaks[large], dtype=np.int64)


def burst_rate(time: Floats, pressure: Floats) -> float | None:
    """Bursts of a pressure in a second, or nothing if there is no such rhythm.

    Parameters
    ----------
    time : (n,), s
    pressure : (n,), Pa
    """
    between = np.diff(time[burst_frames(pressure)])
    between = between[between <= LONGEST_BURST]
    return float(1.0 / between.mean()) if len(between) >= LEAST_BURSTS - 1 else None


def fall_shares(motion: Motion, rest: Motion, frame: int) -> dict[str, float] | None:
    """Shares of upper and lower rib cage and of the belly in what is lost between rest and `frame`.

    The rib cage is parted at the height of the xiphoid, as in optoelectronic plethysmography.
    """
    chest, belly = motion.soft["chest_cavity"], motion.soft["abdomen"]
    n_dome = len(motion.soft["diaphragm"].faces)
    start, sheet = rest.soft["chest_cavity"].vertices[0], chest.faces[:-n_dome]
    level = rest.markers[0, rest.marker_names.index("XIPH"), 2]
    upper = start[sheet].mean(axis=1)[:, 2] > level
    lost = {
        "upper_rib_cage": -swept_volume(start, chest.vertices[frame], sheet[upper]),
        "lower_rib_cage": -swept_volume(start, chest.vertices[frame], sheet[~upper]),
        "abdomen": -swept_volume(
            rest.soft["abdomen"].vertices[0], belly.vertices[frame], belly.faces[:-n_dome]
        ),
    }
    total = sum(lost.values())
    return {k: v / total for k, v in lost.items()} if total > LEAST_FALL else None


def event_figures(
    trajectory: Trajectory, motion: Motion, rest: Motion, *, closed: float
) -> dict[str, Any]:
    """Figures of the whole run, in the units of their names.

    Parameters
    ----------
    rest : the torso at rest in the same posture, one frame
    closed : s, for which the larynx stayed closed at the longest
    """
    lung, resting = motion.volumes["lung"], float(rest.volumes["lung"][0])
    least, t = int(np.argmin(lung)), motion.time
    above = np.flatnonzero(lung[: least + 1] >= resting)
    fall = max(0.0, resting - float(lung[least]))
    shares = fall_shares(motion, rest, least)
    gastric, pleural = trajectory.abdominal, trajectory.pleural
    return {
        "burst_rate_hz": burst_rate(trajectory.time, trajectory.alveolar),
        "inspired_above_rest_l": max(0.0, float(lung.max()) - resting) / CUBIC_METRE_PER_LITRE,
        "volume_fall_l": fall / CUBIC_METRE_PER_LITRE,
        "volume_fall_time_s": float(t[least] - (t[above[-1]] if len(above) else 0.0)),
        "volume_fall_share": shares,
        "closed_glottis_s": closed,
        "peak_alveolar_pressure_cmh2o": _peak(trajectory.alveolar),
        "peak_pleural_pressure_cmh2o": _peak(pleural),
        # against the first frame, as a catheter is read against its baseline
        "peak_gastric_pressure_cmh2o": _peak(gastric - gastric[0]),
        "peak_transdiaphragmatic_pressure_cmh2o": _peak(gastric - pleural - (gastric - pleural)[0]),
        "peak_flow_l_s": max(0.0, float(trajectory.flow.max())) / CUBIC_METRE_PER_LITRE,
        "peak_inspiratory_flow_l_s": max(0.0, -float(trajectory.flow.min()))
        / CUBIC_METRE_PER_LITRE,
    }


def _peak(pressure: Floats) -> float:
    return float(pressure.max()) / PASCAL_PER_CMH2O
