"""Figures of breaths, in the units of the validation table."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.validation.behaviours import Run
from pipeline.validation.static_figures import Figures, rib_means
from sim.model.skeleton import SEGMENTS
from sim.motion import Motion
from sim.physics.types import Floats
from sim.summary import (
    Breath,
    compartments,
    find_breaths,
    rib_rotations,
    summarise,
)
from sim.ultrasound import dome_excursion
from sim.units import PASCAL_PER_CMH2O

CM = 1e2
QUIET_RIBS = range(3, 8)


def konno_mead(motion: Motion, breath: Breath) -> tuple[Floats, Floats]:
    """Volumes of rib cage and abdomen since the start of a breath, (n_frames,) each, m^3."""
    frames = range(breath.first, breath.last + 1)
    parts = [compartments(motion, breath.first, frame) for frame in frames]
    return np.array([p["rib_cage"] for p in parts]), np.array([p["belly"] for p in parts])


def phase_angle(rib_cage: Floats, abdomen: Floats) -> float:
    """Phase angle of a closed loop of two volumes, deg: 0 together, 180 opposed.

    sin = m / s, with s the excursion of the abdomen and m the width of the loop where the rib
    cage is halfway; a falling loop counts from 180.
    """
    s, half = float(np.ptp(abdomen)), 0.5 * float(rib_cage.max() + rib_cage.min())
    start = int(np.argmin(rib_cage))
    rc, ab = np.roll(rib_cage, -start), np.roll(abdomen, -start)
    top = int(np.argmax(rc))
    up = float(np.interp(half, np.maximum.accumulate(rc[: top + 1]), ab[: top + 1]))
    down = float(np.interp(half, np.maximum.accumulate(rc[: top - 1 : -1]), ab[: top - 1 : -1]))
    angle = float(np.degrees(np.arcsin(min(1.0, abs(up - down) / s)))) if s > 0.0 else 0.0
    return angle if np.corrcoef(rib_cage, abdomen)[0, 1] >= 0.0 else 180.0 - angle


def loop_turn(rib_cage: Floats, abdomen: Floats) -> float:
    """Area of the loop over the box around it; positive: counter-clockwise, rib cage upwards."""
    x, y = abdomen, rib_cage
    area = 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    return area / (float(np.ptp(x)) * float(np.ptp(y)))


def _way(figures: dict[str, Any], name: str) -> Floats:
    way = figures["marker_excursion_mm"][name]
    return np.array([way["x"], way["y"], way["z"]])


def _surface(figures: dict[str, Any]) -> Figures:
    """Ways of third and fifth costal cartilage and of the navel, mm."""
    out: Figures = {}
    for name, rib in (("UCH", 3), ("MCH", 5)):
        left, right = _way(figures, f"L{name}"), _way(figures, f"R{name}")
        out[f"cartilage_{rib}_ventral"] = float(0.5 * (left[0] + right[0]))
        out[f"cartilage_{rib}_cranial"] = float(0.5 * (left[2] + right[2]))
        out[f"cartilage_{rib}_lateral"] = float(0.5 * (left[1] - right[1]))
    navel = _way(figures, "NAVEL")
    other = float(np.abs(navel[1:]).max())
    out |= {"navel_ventral": float(navel[0]), "navel_cranial": float(navel[2])}
    return out | {"navel_ventral_only": bool(navel[0] > 2.0 * other)}


def breath_figures(run: Run) -> Figures:
    """Figures of the last breath of a run."""
    f = summarise(run.motion, run.rest, rate=run.rate)
    b = find_breaths(run.motion, 1.0 / run.rate)[-1]
    m, time = run.motion, run.motion.time
    pleural = m.pressures["pleural"][b.first : b.last + 1] / PASCAL_PER_CMH2O
    dia = (m.pressures["abdomen"] - m.pressures["pleural"])[b.first : b.last + 1]
    gastric = m.pressures["abdomen"][b.first : b.last + 1]
    inspiration = float(time[b.high] - time[b.low])
    dome = dome_excursion(m, run.rest, b.low, b.high)
    turned = rib_means(rib_rotations(m, run.rest, b.high), "rib")
    loop = konno_mead(m, b)
    quiet = {
        f"quiet_{axis}": float(np.mean([turned[f"rib_{axis}_{rib}"] for rib in QUIET_RIBS]))
        for axis in ("pump", "bucket")
    }
    return {
        "breaths_per_min": f["breaths_per_min"],
        "te_over_ti": (1.0 / run.rate - inspiration) / inspiration,
        "tidal_volume": f["tidal_volume_l"],
        "dome_right": CM * dome["right"],
        "dome_left": CM * dome["left"],
        "pleural_end_expiration": float(
            m.pressures["pleural"][b.low] / PASCAL_PER_CMH2O
        ),
        "pleural_swing": float(np.ptp(pleural)),
        "pdi_swing": float(np.ptp(dia)) / PASCAL_PER_CMH2O,
        "gastric_swing": float(np.ptp(gastric)) / PASCAL_PER_CMH2O,
        "rib_cage_share": f["rib_cage_share"],
        "diaphragm_share": f["diaphragm_volume_l"] / f["tidal_volume_l"],
        "phase_angle": phase_angle(*loop),
        "phase_opposed": phase_angle(*loop) > 90.0,
        "loop_counter_clockwise": loop_turn(*loop) > 0.0,
        "abdomen_volume_error": 100.0 * f["abdomen_volume_error"],
        "sternum_way": float(np.linalg.norm(_way(f, "STRN"))),
        "navel_way": float(np.linalg.norm(_way(f, "NAVEL"))),
        "spine_turn": spine_turn(m, b),
        "steady": f["steady"],
        **_surface(f),
        **turned,
        **quiet,
    }  # fmt: skip


def spine_turn(motion: Motion, breath: Breath) -> float:
    """Largest rotation between neighbours of the spine in a breath, deg."""
    chain = [motion.bodies.index(name) for name in ("pelvis", *SEGMENTS)]
    turn = [
        Rotation.from_quat(motion.quaternion[frame, chain], scalar_first=True)
        for frame in (breath.low, breath.high)
    ]
    bend = [t[:-1].inv() * t[1:] for t in turn]
    return float(np.degrees((bend[0].inv() * bend[1]).magnitude().max()))
