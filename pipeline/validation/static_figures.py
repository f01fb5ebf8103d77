"""Figures of the torso without breathing: relaxation, efforts, pressures at rest."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from sim.bench import Bench
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import lung_capacity
from sim.motion import Motion, rest_motion, still_motion
from sim.physics import lung
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import group_activation
from sim.statics import (
    LITRE,
    airway_pressure,
    as_arrays,
    at_volume,
    belly_inflation,
    closed_effort,
    compliance,
    diaphragm_rise,
    inspired_effort,
    relaxation,
)
from sim.summary import rib_rotations
from sim.units import PASCAL_PER_CMH2O as CMH2O

Figures = dict[str, Any]
UPRIGHT = np.array([-30, -25, -20, -15, -10, -7.5, -4, -2.5, -1, 0, 2.5, 5, 9, 15, 20, 25]) * CMH2O
SUPINE = np.array([0, 1, 2.5, 4, 5]) * CMH2O
BELLY = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0]) * LITRE
"""Gas; the free diaphragm makes way for a part of it."""
SONG = 16.3
"""cmH2O, pressure of insufflation in Song 2006 (12 mmHg)."""
HIGH = 0.95
"""Share of TLC at which efforts at high volume are made (Wanke 1990)."""
INSPIRED = (0.1, 0.3, 0.6, 0.8, 1.0)
"""Levels by which the volumes of efforts are reached actively."""
INSPIRE = np.array([1.0, 1.0, 0.0, 0.0])
EXPIRE = np.array([0.0, 0.0, 1.0, 1.0])
EXPEL = np.array([0.0, 1.0, 0.0, 1.0])
"""Maximal levels of external intercostals, diaphragm, internal intercostals, abdomen."""
GRAVITY = 9.81
HALF_LITRE = 0.5e-3
"""m^3/s, flow at which the resistance of an airway is stated."""
MMHG = 1.3595
"""cmH2O."""


def level_groups(levels: Floats) -> dict[str, float]:
    """Muscle groups and their activation at four levels, (4,)."""
    return dict(zip(MUSCLE_GROUPS, map(float, group_activation(levels)), strict=True))


def reached(pressure: Floats, volume: Floats, wanted: float) -> float | str:
    """Pressure at which a rising curve has a volume, or the end it would lie beyond."""
    if wanted > volume[-1]:
        return f"> {pressure[-1]:.0f}"
    if wanted < volume[0]:
        return f"< {pressure[0]:.0f}"
    return float(np.interp(wanted, volume, pressure))


def relaxation_figures(resting: RestingTorso) -> tuple[Figures, dict[str, list[float]]]:
    """Compliances and places on the Rahn diagram; the curve itself."""
    capacity = {k: v / LITRE for k, v in lung_capacity(resting.torso.subject).items()}
    k = resting.torso.plant.constants
    out: Figures = {}
    for posture, pressures in (("supine", SUPINE), ("upright", UPRIGHT)):
        points = relaxation(resting, pressures, posture)
        start = min(points, key=lambda p: abs(p.rib_cage) + abs(p.wall))
        curve = as_arrays(points, start)
        airway = airway_pressure(resting, curve)
        parts = [compliance(airway, curve["pleural"], curve[part]) for part in ("rib_cage", "wall")]
        out[f"rib_cage_compliance_{posture}"] = parts[0]
        out[f"abdomen_compliance_{posture}"] = parts[1]
        out[f"chest_wall_compliance_{posture}"] = sum(parts)
    wall, volume = curve["pleural"], curve["lung"]
    recoil = airway - wall
    frc = float(np.interp(0.0, airway, volume))
    neutral = float(np.interp(0.0, wall, volume))
    share = 100.0 / (capacity["tlc"] - capacity["rv"])
    out["frc_share"] = share * (frc - capacity["rv"])
    out["wall_neutral_share"] = share * (neutral - capacity["rv"])
    out["wall_pressure_rv"] = reached(wall, volume, capacity["rv"])
    out["wall_pressure_tlc"] = reached(wall, volume, capacity["tlc"])
    for name in ("frc", "tlc"):
        litres = capacity[name] * LITRE
        at = lung.recoil_pressure(litres, k.lung_limit, k.lung_scale, k.lung_rate)
        out[f"lung_recoil_{name}"] = at / CMH2O
    stiffness = lung.recoil_stiffness(
        capacity["frc"] * LITRE, k.lung_limit, k.lung_scale, k.lung_rate
    )
    out["lung_compliance"] = CMH2O / stiffness / LITRE
    curves = {"volume": volume, "wall": wall, "lung": recoil}
    return out, {
        **{name: curve.tolist() for name, curve in curves.items()},
        "capacity": [capacity[name] for name in ("rv", "frc", "tlc")],
    }


def effort_figures(resting: RestingTorso) -> tuple[Figures, dict[str, list[float]]]:
    """Maximal efforts against a closed airway; transdiaphragmatic pressure against volume."""
    c = lung_capacity(resting.torso.subject)
    rv, frc, tlc = c["rv"], c["frc"], c["tlc"]
    volumes = [rv, 0.5 * (rv + frc), frc, 0.5 * (frc + HIGH * tlc), 0.9 * tlc, HIGH * tlc]
    alone = [closed_effort(resting, v, {"diaphragm": 1.0}, braced=True) for v in volumes]
    rise = [diaphragm_rise(pair) for pair in alone]
    out: Figures = {"pdi_rv": rise[0], "pdi_frc": rise[2], "pdi_high": rise[-1]}
    out["pdi_fall"] = rise[-1] / rise[0]
    out["pi_max"] = -closed_effort(resting, rv, level_groups(INSPIRE))[1].alveolar / CMH2O
    out["pe_max"] = closed_effort(resting, HIGH * tlc, level_groups(EXPIRE))[1].alveolar / CMH2O
    for name, levels in (("mueller", INSPIRE), ("expulsive", EXPEL)):
        pair = closed_effort(resting, frc, level_groups(levels))
        out[f"{name}_pdi"] = diaphragm_rise(pair)
        fall = (pair[0].pleural - pair[1].pleural) / CMH2O
        out[f"{name}_pleural_share"] = fall / out[f"{name}_pdi"]
    active = [inspired_effort(resting, level_groups(share * INSPIRE)) for share in INSPIRED]
    volume = np.array([during.lung for _, during in active]) / LITRE
    shorter = [diaphragm_rise(pair) for pair in active]
    out["pdi_high_active"] = float(np.interp(HIGH * tlc / LITRE, volume, shorter))
    curve = {"volume": [before.lung / LITRE for before, _ in alone], "pdi": rise}
    return out, curve | {"active_volume": volume.tolist(), "active_pdi": shorter}


def _at_depth(motion: Motion, resting: RestingTorso, posture: str, pressure: float) -> Figures:
    """Pressure at rest where it is measured, mmHg or cmH2O: contents weigh."""
    plant, belly = resting.torso.plant, motion.soft["abdomen"].vertices[0]
    weight = plant.constants.content_density * GRAVITY
    axis = 2 if posture == "upright" else 0
    units = {"mid_axillary": MMHG, "pelvic_floor": 1.0}
    places = {
        "mid_axillary": 0.5 * (belly[:, axis].max() + belly[:, axis].min()),
        "pelvic_floor": belly[np.argmin(belly[:, 2]), axis],
    }
    return {
        f"abdomen_pressure_{name}_{posture}":
            (pressure - weight * (at - plant.reference[axis])) / CMH2O / units[name]
        for name, at in places.items()
    }  # fmt: skip


def rest_figures(resting: RestingTorso) -> Figures:
    """Lung volume and pressures at rest in both postures."""
    out: Figures = {}
    volume = {}
    for posture in ("upright", "supine"):
        point = Bench(resting, posture).go(0.5)
        volume[posture] = point.lung / LITRE
        out[f"pleural_rest_{posture}"] = point.pleural / CMH2O
        still = rest_motion(resting, posture)
        out |= _at_depth(still, resting, posture, point.abdominal)
    k = resting.torso.plant.constants
    resistance = k.airway_k1 + k.airway_k2 * HALF_LITRE
    return out | {
        "frc": volume["upright"],
        "frc_shift": volume["supine"] - volume["upright"],
        "airway_k1": k.airway_k1 * LITRE / CMH2O,
        "airway_resistance": resistance * LITRE / CMH2O,
    }


def inflated_ribs(resting: RestingTorso) -> Figures:
    """Rotation of the ribs between supine FRC and TLC, relaxed, deg (Wilson 1987)."""
    bench = at_volume(resting, lung_capacity(resting.torso.subject)["tlc"], "supine")
    full = still_motion(resting, bench.state, "supine")
    turned = rib_rotations(full, rest_motion(resting, "supine"), 0)
    out = rib_means(turned, "relaxed")
    return out | {"relaxed_falls": falls(out, "relaxed", range(3, 8))}


def falls(figures: Figures, prefix: str, ribs: range) -> bool:
    """Whether both components of the ribs' rotations fall from rib to rib."""
    rows = [[figures[f"{prefix}_{axis}_{rib}"] for rib in ribs] for axis in ("pump", "bucket")]
    return all(upper > lower for row in rows for upper, lower in pairwise(row))


def rib_means(turned: dict[str, dict[str, float]], prefix: str) -> Figures:
    """Rotation of each rib, mean of the two sides, deg."""
    return {
        f"{prefix}_{axis}_{rib}":
            float(np.degrees(0.5 * (turned[f"rib_L{rib}"][axis] + turned[f"rib_R{rib}"][axis])))
        for rib in range(1, 11) for axis in ("pump", "bucket")
    }  # fmt: skip


def belly_gain(resting: RestingTorso) -> Figures:
    """Volume that the belly wall gives at the pressure of an insufflation, L."""
    points, start = belly_inflation(resting, BELLY, wall_alone=False)
    curve = as_arrays([start, *points], start)
    return {"belly_gain": float(np.interp(SONG, curve["abdominal"], curve["wall"], right=np.nan))}
