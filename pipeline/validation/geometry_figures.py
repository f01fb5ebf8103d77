"""Sizes of the torso at rest, upright, in the units of the validation table."""

from __future__ import annotations

import numpy as np

from pipeline.validation.capacity_figures import girth
from pipeline.validation.static_figures import Figures
from sim.physics.contact import EDGE, cross_sheet, follow_sheet
from sim.physics.types import Floats, Ints
from sim.resting import RestingTorso
from sim.tables import column, read_rows

MM, CM2, PERCENT = 1e3, 1e4, 1e2
APPOSED = 0.003
"""m; what lies this near to the rib cage is apposed."""
SLICE = 0.02
"""m, height of the slice in which a breadth is measured."""


def _area(x: Floats, faces: Ints) -> float:
    a, b, c = (x[faces[:, k]] for k in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def _length(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def skin_figures(resting: RestingTorso) -> Figures:
    """Breadth, depth and girth of chest and waist, heights between landmarks, mm."""
    skin, faces = resting.vertices("upright"), resting.skin.faces
    marks, anatomy = resting.landmarks("upright"), resting.torso.anatomy
    out: Figures = {}
    for name, z in (("chest", marks["STRN"][2]), ("waist", anatomy.navel_height)):
        near = skin[np.abs(skin[:, 2] - z) < SLICE]
        front = np.array([near[:, 0].max(), 0.0, z])
        back = np.array([near[:, 0].min(), 0.0, z])
        out[f"{name}_breadth"] = MM * float(np.ptp(near[:, 1]))
        out[f"{name}_depth"] = MM * float(np.ptp(near[:, 0]))
        out[f"{name}_girth"] = MM * girth(skin, faces, front, back)
    notch, tenth = anatomy.sternum_front[:, 2].max(), anatomy.rib[:, 9, :, 2].min()
    out["notch_navel"] = MM * float(notch - anatomy.navel_height)
    out["notch_tenth_rib"] = MM * float(notch - tenth)
    out["tenth_rib_crest"] = MM * float(tenth - anatomy.pelvis_rim[:, 2].max())
    out["c7_notch"] = MM * float(anatomy.process["C7"][2] - notch)
    return out


def bone_figures(resting: RestingTorso) -> Figures:
    """Lengths of ribs, cartilages and sternum, mm; axes of the ribs, deg."""
    anatomy = resting.torso.anatomy
    out: Figures = {}
    for rib in (4, 5, 6):
        line = anatomy.rib[0, rib - 1]
        out[f"rib_length_{rib}"] = MM * _length(line)
        gap = line[-1] - anatomy.facet[0, rib - 1]
        out[f"cartilage_length_{rib}"] = MM * float(np.linalg.norm(gap))
    axes = column(read_rows("rib_joints.csv"), "axis_angle_from_sagittal_deg")
    out["rib_axis"] = float(axes[2:7].mean())
    out["sternum_length"] = MM * float(np.ptp(anatomy.sternum_front[:, 2]))
    return out


def apposition(resting: RestingTorso, posture: str) -> Figures:
    """Zone of apposition and areas of the diaphragm at rest in a posture."""
    torso, x = resting.torso, np.ascontiguousarray(resting.rest(posture).points)
    columns = torso.diaphragm
    gap = _gaps(resting, x)
    rim = x[columns[:, 0]]
    height = np.array([_top(x, fibre, gap) for fibre in columns]) - rim[:, 2]
    middle = np.abs(rim[:, 0] - 0.5 * (rim[:, 0].min() + rim[:, 0].max()))
    side = [int(np.argmin(np.where(sign * rim[:, 1] > 0.0, middle, np.inf))) for sign in (-1, 1)]
    near = set(columns[:, 0].tolist()) | {p for p, g in gap.items() if g < APPOSED}
    dome, sheet = (
        torso.plant.abdomen_faces[-torso.n_dome :],
        torso.plant.chest_faces[: -torso.n_dome],
    )
    on_ribs = np.array([set(face) <= near for face in dome.tolist()])
    fleshy = set(columns[:, :-1].ravel().tolist())
    muscle = np.array([bool(set(face) & fleshy) for face in dome.tolist()])
    whole = _area(x, dome)
    return {
        "apposition_height": MM * float(height[side].mean()),
        "apposition_of_rib_cage": PERCENT * _area(x, dome[on_ribs]) / _area(x, sheet),
        "apposition_of_diaphragm": _area(x, dome[on_ribs]) / whole,
        "tendon_share": 1.0 - _area(x, dome[muscle]) / whole,
        "diaphragm_area": CM2 * _area(x, dome[muscle]),
    }


def _gaps(resting: RestingTorso, x: Floats) -> dict[int, float]:
    """Gap between each diaphragm particle and the rib cage, m; 1 where there is no face."""
    contacts = resting.torso.plant.contacts
    held = contacts.start.copy()
    normals, weight, normal = np.zeros_like(x), np.empty(3), np.empty(3)
    follow_sheet(x, contacts, held, np.ones(len(held)), 1.0, normals)
    out = {}
    for p, g in zip(contacts.point.tolist(), held.tolist(), strict=True):
        gap, inside = cross_sheet(x, contacts.face, g, p, contacts.axis, normals, weight, normal)
        out[p] = gap if inside >= -EDGE else 1.0
    return out


def _top(x: Floats, fibre: Ints, gap: dict[int, float]) -> float:
    """Height at which a fibre leaves the rib cage, m, between its points."""
    below, last = float(x[fibre[0], 2]), 0.0
    for p in fibre[1:].tolist():
        here = gap.get(p, 1.0)
        if here >= APPOSED:
            share = (APPOSED - last) / (here - last)
            return below + share * max(0.0, float(x[p, 2]) - below)
        below, last = float(x[p, 2]), here
    return below


def geometry_figures(resting: RestingTorso) -> Figures:
    """All sizes."""
    supine = apposition(resting, "supine")["apposition_of_diaphragm"]
    return {
        **skin_figures(resting),
        **bone_figures(resting),
        **apposition(resting, "upright"),
        "apposition_of_diaphragm": supine,
    }
