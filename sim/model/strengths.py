"""How strong muscle elements are: by cross-section, or as the papers' Table 8.1 prints it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.errors import ParameterError
from sim.physics.types import Floats
from sim.tables import Parameters, column


@dataclass(frozen=True, kw_only=True, slots=True)
class Strengths:
    """Hill parameters, (n_elements,) each.

    Parameters
    ----------
    optimum : built length over optimal length
    f_max, k_pe : N
    b_pe : N s
    v_max : 1/s
    """

    optimum: Floats
    f_max: Floats
    k_pe: Floats
    b_pe: Floats
    v_max: Floats


def element_strengths(
    groups: list[str], regions: list[str], width: Floats, sex: str, parameters: Parameters
) -> Strengths:
    """Hill parameters of elements in the way of the parameter set.

    Parameters
    ----------
    groups, regions : of each element; the region is "" outside the abdominal wall
    width : (n_elements,), of the strip that an element stands for, m
    sex : of the subject; women's layers are thinner
    """
    if parameters["hill_table_scale"] > 0.0:
        return _printed(groups, regions, parameters)
    return _by_cross_section(groups, width, sex, parameters)


def layer_width(group: str, area: float, parameters: Parameters) -> float:
    """Width, m, at which a strip of a group's layer has a cross-section, m^2."""
    layers = {row["group"]: row for row in parameters.rows("muscle_layers.csv")}
    return area / (float(layers[group]["thickness_mm"]) * 1e-3)


def _by_cross_section(
    groups: list[str], width: Floats, sex: str, parameters: Parameters
) -> Strengths:
    """Thickness of the layer (`muscle_layers.csv`) times width times specific tension."""
    layers = {row["group"]: row for row in parameters.rows("muscle_layers.csv")}
    rows = [layers[group] for group in groups]
    thickness = column(rows, "thickness_mm") * 1e-3
    if sex == "female":
        thickness *= column(rows, "women_share")
    f_max = thickness * width * parameters["specific_tension"]
    passive = column(rows, "passive_share")
    return Strengths(
        optimum=column(rows, "frc_over_optimal"),
        f_max=f_max,
        k_pe=passive * f_max,
        b_pe=parameters["passive_damping_time"] * passive * f_max,
        v_max=column(rows, "v_max_per_s"),
    )


def _printed(groups: list[str], regions: list[str], parameters: Parameters) -> Strengths:
    """The row of Table 8.1 that `hill_rows.csv` names, every element alike.

    The table has no units: forces, N, are its numbers times `hill_table_scale`.
    """
    printed = {row["group"]: row for row in parameters.rows("hill_papers.csv")}
    names = {(row["group"], row["region"]): row["row"] for row in parameters.rows("hill_rows.csv")}
    keys = list(zip(groups, regions, strict=True))
    for group, region in keys:
        if names.get((group, region)) not in printed:
            place = f"{group} in {region}" if region else group
            raise ParameterError(f"hill_rows.csv: no row of hill_papers.csv for {place}. Add one.")
    rows = [printed[names[key]] for key in keys]
    scale = parameters["hill_table_scale"]
    return Strengths(
        optimum=np.ones(len(rows)),
        f_max=scale * column(rows, "f_max"),
        k_pe=scale * column(rows, "k_pe"),
        b_pe=scale * column(rows, "b_pe"),
        v_max=column(rows, "v_max"),
    )
