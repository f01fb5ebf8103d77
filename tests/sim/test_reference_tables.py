"""The published tables in sim/data: complete and plausible."""

from __future__ import annotations

import csv
from itertools import pairwise
from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[2] / "sim" / "data"
TABLES = ("spine_limits", "bodies", "hill_papers", "rib_joints", "body_size", "apposition")


def table(name: str) -> list[dict[str, str]]:
    with (DATA / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", TABLES)
def test_every_row_has_its_source(name: str) -> None:
    rows = table(name)
    assert rows
    assert all(row["source"] and None not in row for row in rows)


def test_spine_limits_chain_from_skull_to_ground() -> None:
    rows = table("spine_limits")
    assert rows[0]["upper"] == "Skull"
    assert rows[-1]["lower"] == "Ground"
    assert [row["lower"] for row in rows[:-1]] == [row["upper"] for row in rows[1:]]
    # The dissertation's lumbar flexion L1-L5 to ground, read off its Table 3.1.
    assert sum(float(row["flexion_deg"]) for row in rows[-2:]) == pytest.approx(54.5)


def test_spine_bodies_hang_on_bodies_of_the_table() -> None:
    masses = {row["body"]: float(row["mass_kg"]) for row in table("bodies")}
    spine = [row["upper"] for row in table("spine_limits")]
    assert set(spine) <= set(masses)
    # Sum of Table 8.2's eight spine rows.
    assert sum(masses[body] for body in spine) == pytest.approx(8.74)


def test_hill_rows_are_positive_and_unique() -> None:
    rows = table("hill_papers")
    assert len({row["group"] for row in rows}) == 10
    assert all(float(row[key]) > 0 for row in rows for key in ("k_pe", "b_pe", "v_max", "f_max"))


def test_rib_axes_turn_towards_the_bucket_handle_downwards() -> None:
    angles = [float(row["axis_angle_from_sagittal_deg"]) for row in table("rib_joints")]
    assert len(angles) == 12
    assert all(upper > lower for upper, lower in pairwise(angles))
    # Wilson 1987: about 35 deg, tolerance 30-40, for ribs 3-7.
    assert all(30 <= angle <= 40 for angle in angles[2:7])


@pytest.mark.parametrize(("sex", "mass"), [("male", 85.5), ("female", 67.8)])
def test_regressions_return_the_means_at_the_mean_body(sex: str, mass: float) -> None:
    # ANSUR II mean body mass of the sample, kg.
    rows = {row["quantity"]: row for row in table("body_size") if row["sex"] == sex}
    stature = float(rows["stature"]["mean_m"])
    fitted = [row for row in rows.values() if row["intercept_m"]]
    assert len(fitted) == 11
    for row in fitted:
        value = (
            float(row["intercept_m"])
            + float(row["per_stature"]) * stature
            + float(row["per_mass_m_per_kg"]) * mass
        )
        assert value == pytest.approx(float(row["mean_m"]), abs=0.002), row["quantity"]
