"""A ball on the belly, the printed control file, the muscle laws, the size of the system."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import page, places
from pipeline.papers.behaviours import MAN, curve_csv, matrix_csv
from pipeline.papers.muscles import write_muscles
from pipeline.records import write_json, write_text
from pipeline.settings import PapersSettings
from sim.behaviour import run_controls
from sim.control.reader import read_controls
from sim.errors import ParameterError
from sim.impact import drop_ball
from sim.model.skeleton import SEGMENTS
from sim.resting import RestingTorso, rest_torso
from sim.units import CUBIC_METRE_PER_LITRE as LITRE

PRINTED = page.TABLES / "printed_control_file.xml"
MM, PERCENT = 1e3, 1e2
MIDLINE = 0.02
"""m; points of the wall nearer to the midline are drawn."""
BEFORE = 4
"""Frames before the ball strikes, for the first picture."""
AXES_OF_A_BALL_JOINT = 3


def ball_figures(
    resting: RestingTorso, settings: PapersSettings
) -> tuple[dict[str, Any], dict[str, Any], str]:
    """Fig. 3.6: figures, four pictures of the wall's midline, curves as text."""
    done = drop_ball(resting, mass=settings.ball_mass_kg, height=settings.ball_height_m)
    dent, error = MM * done.dent, PERCENT * done.volume_error
    deepest = int(np.argmax(dent))
    struck = int(np.argmax(dent > 1.0))
    near = np.flatnonzero(np.abs(done.start[:, 1]) < MIDLINE)
    near = near[(done.start[near, 0] > 0.0)]
    near = near[np.argsort(done.start[near, 2])]
    moments = {"falling": max(0, struck - BEFORE), "struck": struck, "deepest": deepest,
               "end": len(dent) - 1}  # fmt: skip
    pictures = {
        "radius_mm": MM * done.radius,
        "frames": [
            {
                "title": title,
                "time_s": float(done.time[frame]),
                "wall_mm": (MM * done.wall[frame][near][:, [2, 0]]).tolist(),
                "ball_mm": (MM * done.ball[frame, [2, 0]]).tolist(),
            }
            for title, frame in moments.items()
        ],
    }
    figures = {
        "volume_error_pct": float(np.abs(error).max()),
        "dent_mm": float(dent.max()),
        "dent_left_mm": float(dent[-1]),
        "dent_left_share": float(dent[-1] / dent.max()),
    }
    curves = matrix_csv("time_s", done.time, ["dent_mm", "volume_error_pct"],
                        np.stack([dent, error], axis=1))  # fmt: skip
    return figures, pictures, curves


def printed_figures(resting: RestingTorso) -> tuple[dict[str, Any], str]:
    """The control file of section 8.1: air of each breath, L; curves as text."""
    controls = read_controls(PRINTED)
    duration = controls.run_duration
    if duration is None:
        raise ParameterError(f"{controls.place}: says no length. Add duration_s.")
    done = run_controls(resting, controls, posture="upright", duration=duration)
    t, period = done.trajectory, done.cycle
    tidal = [
        float(np.ptp(t.lung[(t.time > start) & (t.time <= start + period)])) / LITRE
        for start in np.arange(0.0, duration - 0.5 * period, period)
    ]
    return {
        "ran": bool(np.isfinite(t.lung).all()),
        "breaths_l": tidal,
        "first_breath_l": tidal[0],
        "later_breath_l": tidal[-1],
        "diaphragm_first_only": tidal[0] > max(tidal[1:]),
        "rib_cage_goes_on_l": min(tidal[1:]),
        "volume_error_pct": PERCENT * done.figures()["abdomen_volume_error"],
    }, curve_csv(done)


def size_figures(resting: RestingTorso) -> dict[str, Any]:
    """Counts of the system."""
    torso = resting.torso
    arms = [name for name in torso.skeleton.body if "arm" in name or "girdle" in name]
    return {
        "rigid_bodies": torso.skeleton.model.nbody - 1,
        "rigid_bodies_without_arms": torso.skeleton.model.nbody - 1 - len(arms),
        "muscle_elements": len(torso.plant.muscles.a),
        "particles": torso.n_particles,
        "degrees_of_freedom": int(torso.skeleton.model.nv),
        "spine_degrees_of_freedom": AXES_OF_A_BALL_JOINT * (len(SEGMENTS) + 1),
    }


def run_experiments(folder: Path, settings: PapersSettings) -> Path:
    """Make all of them and write experiments.json with its curves."""
    began, resting = time.monotonic(), rest_torso(MAN)
    write_muscles(folder)
    ball, pictures, curves = ball_figures(resting, settings)
    write_text(folder / "ball.csv", curves)
    write_json(folder / "ball_pictures.json", pictures)
    printed, curves = printed_figures(resting)
    write_text(folder / "printed.csv", curves)
    figures = {f"ball.{k}": v for k, v in ball.items()}
    figures |= {f"printed.{k}": v for k, v in printed.items()}
    figures |= {f"size.{k}": v for k, v in size_figures(resting).items()}
    path = folder / "experiments.json"
    write_json(path, {
        "figures": figures, "seconds": round(time.monotonic() - began, 1),
        "ball_mass_kg": settings.ball_mass_kg, "ball_height_m": settings.ball_height_m,
        "version": places.version(), "source": places.fingerprint(places.PACKAGE.parent),
    })  # fmt: skip
    return path
