"""Every drawing of the page: curves from the tables of the runs, pictures as they were written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from pipeline import page
from pipeline.draw import papers as draw
from pipeline.draw.section import Floats
from pipeline.papers.behaviours import FORMS
from pipeline.papers.breath_map import FIRST, volumes
from pipeline.papers.table import RUNS
from pipeline.records import read_json
from sim.control.curves import Sawtooth
from sim.control.library import find_controls

STRIPS = ("calm", "giggle", "laugh", "belly_laugh", "cough", "sneeze", "paradoxical")
MUSCLES = tuple(f"muscle_{name}" for name in ("curves", "activation", "contraction_strip",
                "relaxation_strip", "release", "release_strip"))  # fmt: skip
SPAN, PAIR_SPAN = 16.0, 16.0
"""s of a run that are shown."""
SKIN_GAIN = 5.0

Drawings = dict[str, Markup | None]


def read_curve(path: Path) -> dict[str, Floats]:
    """Columns of a table of numbers by name; empty when there is no such run."""
    rows = page.read_rows(path)
    names = list(rows[0]) if rows else []
    return {name: np.array([float(row[name]) for row in rows]) for name in names}


def _curves(folder: Path, styles: tuple[str, ...]) -> dict[str, dict[str, dict[str, Floats]]]:
    """Title of a form to style to curve."""
    found = {form: {s: read_curve(folder / form / f"{s}.csv") for s in styles} for form in FORMS}
    return {
        _title(form): {style: curve for style, curve in runs.items() if curve}
        for form, runs in found.items()
    }


def _title(form: str) -> str:
    return RUNS[form][:1].upper() + RUNS[form][1:]


def _ribs(folder: Path, figures: Mapping[str, Any]) -> Markup | None:
    forms = {}
    for form in FORMS:
        table = read_curve(folder / form / "ribs.csv")
        if table:
            turn = np.stack([v for k, v in table.items() if k != "time_s"], axis=1)
            late = np.array(figures[f"{form}.calm.rib_delay_s"])
            forms[_title(form)] = (table["time_s"], turn, late)
    return page.own_ids(draw.ribs_svg(forms), "ribs") if forms else None


def calm_place() -> tuple[float, float]:
    """Contraction and period of the calm behaviour on the map."""
    calm = find_controls("calm")
    level = next(
        c.high
        for s in calm.springs
        for c in s.curves
        if s.name == FIRST and isinstance(c, Sawtooth)
    )
    return level, calm.run_cycle(0.0)


def _events(
    folder: Path, forms: tuple[str, ...], names: Mapping[str, str], pressure: str, label: str
) -> str | None:
    runs = {}
    for form in forms:
        for style, name in names.items():
            curve = read_curve(folder / form / f"{style}.csv")
            if curve:
                runs[f"{name}, {RUNS[form]}"] = curve
    return draw.events_svg(runs, pressure, label) if runs else None


def drawings(folder: Path, parts: Mapping[str, Any], figures: Mapping[str, Any]) -> Drawings:
    """Name to drawing; nothing for one whose run is missing.

    Parameters
    ----------
    folder : results of the heavy rules
    parts : their records
    figures : all figures by name
    """
    capacity = {k: parts["calibrated"]["capacity_l"][k] for k in ("rv", "frc", "tlc")}
    made: dict[str, str | None] = {
        "volumes": draw.volumes_svg(_curves(folder, tuple(draw.STYLE_LINES)), capacity, SPAN),
        "pair": draw.pair_svg(_curves(folder, tuple(draw.PAIR_LINES)), capacity, PAIR_SPAN),
        "map": draw.map_svg(*volumes(page.read_rows(folder / "map.csv")), calm_place()),
        "ball": draw.ball_svg(
            read_json(folder / "ball_pictures.json"), read_curve(folder / "ball.csv")
        ),
        "printed": draw.events_svg(
            {"the printed file": read_curve(folder / "printed.csv")}, "abdominal_cmh2o",
            "belly's pressure (cmH2O)",
        ),
    }  # fmt: skip
    for end, forms in (("", ("papers", "calibrated")), ("_papers_set", ("papers_set",))):
        made[f"laughs{end}"] = _events(
            folder, forms, {"laugh": "laugh", "belly_laugh": "deep laugh"}, "alveolar_cmh2o",
            "alveolar pressure (cmH2O)",
        )  # fmt: skip
        made[f"bursts{end}"] = _events(
            folder, forms, {"cough": "cough", "sneeze": "sneeze"}, "abdominal_cmh2o",
            "belly's pressure (cmH2O)",
        )  # fmt: skip
    out = {name: page.own_ids(text, name) if text else None for name, text in made.items()}
    out |= {name: page.inline_svg(folder / f"{name}.svg") for name in MUSCLES}
    out["ribs"] = _ribs(folder, figures)
    for form in FORMS:
        skin = folder / form / "skin.json"
        name = f"skin_{form}"
        out[name] = None
        if skin.exists():
            out[name] = page.own_ids(draw.skin_svg(read_json(skin), SKIN_GAIN), name)
        for style in STRIPS:
            path = folder / form / f"{style}.svg"
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            out[f"{style}_{form}"] = page.own_ids(text, f"{style}-{form}") if text else None
    return out
