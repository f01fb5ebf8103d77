"""Steps (e) and (f) of the calibration ladder: intercostals alone, then breaths."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from sim.cli import read_task, run_task
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.statics import LITRE, closed_effort
from sim.units import PASCAL_PER_CMH2O as CMH2O

Row = tuple[str, str, float, str, str, str]
LAYERS = {
    "inspiratory": ("external_intercostals", "parasternal_intercostals", "levatores_costarum"),
    "expiratory": ("internal_intercostals",),
}
PRINTED = {"inspiratory": -18.0, "expiratory": 40.0}
"""cmH2O if every fibre of the external or the internal layer contracts, inferred for man."""
WILSON = "Wilson 2001 (from memory in the reference)"
BREATHS = {
    "calm": ("0.5 +- 0.1", "issue target; Konno & Mead 1967"),
    "panting": ("under calm", "dilorenzo2009 Fig. 5.2"),
    "deep": ("2 to 3.5", "issue target"),
    "vital_capacity": ("5.0 +- 0.6", "ECSC 1993"),
}


def step_e(resting: RestingTorso, axes: Axes, volumes: Floats) -> list[Row]:
    """Intercostals alone, airway closed."""
    rows: list[Row] = []
    torso = resting.torso
    navel = torso.wall[len(torso.wall) // 2, torso.wall.shape[1] // 2]
    for layer, groups in LAYERS.items():
        pairs = [closed_effort(resting, float(v), dict.fromkeys(groups, 1.0)) for v in volumes]
        at = np.array([before.lung for before, _ in pairs]) / LITRE
        rise = np.array([during.alveolar - before.alveolar for before, during in pairs]) / CMH2O
        axes.plot(at, rise, "o-", label=f"{layer} intercostals")
        rows += [
            ("e", f"airway pressure at {v:.1f} L, {layer} intercostals", p, "cmH2O",
             f"{PRINTED[layer]:.0f}", WILSON)
            for v, p in zip(at, rise, strict=True)
        ]  # fmt: skip
        before, during = pairs[len(pairs) // 2]
        out = 1e3 * float(during.places[navel, 0] - before.places[navel, 0])
        target = "in" if layer == "inspiratory" else "out"
        rows.append(("e", f"belly at the middle, forwards, {layer}", out, "mm", target,
                     "DESIGN section 4"))  # fmt: skip
    axes.axhline(0.0, color="0.8", zorder=0)
    axes.set(xlabel="lung volume (L)", ylabel="change of airway pressure (cmH2O)")
    axes.legend()
    return rows


def step_f(resting: RestingTorso, axes: Axes) -> list[Row]:
    """Breaths by activations only."""
    rows: list[Row] = []
    for style, (target, source) in BREATHS.items():
        moved, figures = run_task(read_task([style]), resting)
        axes.plot(moved.time, moved.volumes["lung"] / LITRE, label=style.replace("_", " "))
        name = "vital_capacity_l" if style == "vital_capacity" else "tidal_volume_l"
        rows.append(("f", f"{style}, volume", float(figures[name]), "L", target, source))
        if style != "panting":
            share = float(figures["rib_cage_share"])
            rows.append(("f", f"{style}, rib cage share", share, "1", "", ""))
    axes.set(xlabel="time (s)", ylabel="lung volume (L)", xlim=(0.0, 20.0))
    axes.legend()
    return rows
