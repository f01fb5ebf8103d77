"""Figures that compare runs of one form, and all figures of the page under their names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.papers.behaviours import EVENTS, FORMS
from pipeline.records import read_json

STYLES = ("calm", "deep", "panting", "forced_exhale")
PERCENT = 1e2

Figures = dict[str, Any]


def _grows(values: list[float]) -> bool:
    return bool((np.diff(values) > 0.0).all())


def cross_figures(f: Mapping[str, Any]) -> Figures:
    """Figures over several runs of a form; one that lacks a run is left out.

    Parameters
    ----------
    f : `STYLE.NAME` to value
    """
    laughs = EVENTS[:3]
    made: dict[str, Callable[[], object]] = {
        "panting_under_calm": lambda: f["panting.tidal_volume_l"] < f["calm.tidal_volume_l"],
        "deep_over_calm": lambda: f["deep.tidal_volume_l"] > f["calm.tidal_volume_l"],
        "navel_over_sternum": lambda: f["calm.belly_forward_mm"] / f["calm.chest_forward_mm"],
        "forced_flow_ratio": lambda: f["forced_exhale.peak_flow_l_s"] / f["calm.peak_flow_l_s"],
        "breath_volume_error_pct": lambda: (
            PERCENT * max(f[f"{style}.abdomen_volume_error"] for style in STYLES)
        ),
        "laugh_pressure_grows": lambda: _grows(
            [f[f"{style}.peak_gastric_pressure_cmh2o"] for style in laughs]
        ),
        "laugh_fall_grows": lambda: _grows([f[f"{style}.volume_fall_l"] for style in laughs]),
        "sneeze_over_cough_air": lambda: f["sneeze.expired_l"] / f["cough.expired_l"],
        "sneeze_over_cough_pressure": lambda: (
            f["sneeze.peak_gastric_pressure_cmh2o"] / f["cough.peak_gastric_pressure_cmh2o"]
        ),
        "paradoxical_ratio": lambda: (
            f["paradoxical.tidal_volume_l"] / f["paradoxical_normal.tidal_volume_l"]
        ),
        "paradoxical_dome_ratio": lambda: (
            f["paradoxical.diaphragm_excursion_mm"] / f["paradoxical_normal.diaphragm_excursion_mm"]
        ),
        "paradoxical_skin_mm": lambda: _skin_difference(f),
        "slowest_breath_speed": lambda: min(f[f"{s}.realtime_factor"] for s in STYLES),
        "slowest_event_speed": lambda: min(f[f"{s}.realtime_factor"] for s in EVENTS),
    }
    out: Figures = {}
    for name, measure in made.items():
        try:
            out[name] = measure()
        except KeyError:
            continue
    return out


def _skin_difference(f: Mapping[str, Any]) -> float:
    """Mm by which the pair differs most at a marker, from least to largest volume."""
    one, other = (
        np.array([list(way.values()) for way in f[f"{style}.marker_excursion_mm"].values()])
        for style in ("paradoxical", "paradoxical_normal")
    )
    return float(np.linalg.norm(one - other, axis=1).max())


def read_figures(folder: Path) -> Figures:
    """Every figure under its name in the table.

    Parameters
    ----------
    folder : results of the heavy rules
    """
    out: Figures = {}
    for form in FORMS:
        own = read_json(folder / f"{form}.json")["figures"]
        out |= {f"{form}.{name}": value for name, value in own.items()}
        out |= {f"{form}.cross.{k}": v for k, v in cross_figures(own).items()}
    found = read_json(folder / "map.json")["figures"]
    out |= {f"map.{name}": value for name, value in found.items()}
    return out | dict(read_json(folder / "experiments.json")["figures"])
