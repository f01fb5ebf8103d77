"""Named parameter sets: what `papers` changes, and what its printed numbers mean for an element."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from sim.errors import ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.strengths import element_strengths
from sim.physics.muscle import force_velocity, hill_tension
from sim.simulate import LEVELS, group_activation
from sim.tables import DATA, SETS, parameters, read_rows

PAPERS = parameters("papers")


def activated(level: str, set_name: str) -> dict[str, float]:
    one = np.eye(len(LEVELS))[LEVELS.index(level)]
    out = group_activation(one, parameters(set_name))
    return {name: float(a) for name, a in zip(MUSCLE_GROUPS, out, strict=True) if a > 0.0}


def test_an_unknown_set_is_refused_with_the_names_of_those_there_are() -> None:
    with pytest.raises(ParameterError, match=r"no set 'paper'\. There are: calibrated, papers\."):
        parameters("paper")


def test_papers_changes_the_rows_of_its_own_table_and_nothing_else() -> None:
    own = {row["name"] for row in PAPERS.rows("parameters.csv")}
    base = parameters().numbers
    assert {name for name in base if base[name] != PAPERS[name]} <= own
    assert set(PAPERS.numbers) == set(base)
    assert PAPERS["bulk_modulus"] == 200e3
    assert PAPERS["eccentric_force"] == 0.0


@pytest.mark.parametrize(
    "name",
    [
        "bound_cavity",
        "equal_point_masses",
        "no_suction",
        "one_way_lung",
        "printed_masses",
        "separate_elements",
    ],
)
def test_what_is_only_published_is_on_in_papers_alone(name: str) -> None:
    assert (parameters()[name], PAPERS[name]) == (0.0, 1.0)


def test_a_changed_copy_stays_in_its_set() -> None:
    assert PAPERS.replace(bulk_modulus=3e5).name == "papers"


@pytest.mark.parametrize("table", sorted(p.name for p in (DATA / "papers").glob("*.csv")))
def test_tables_of_a_set_have_sources_and_the_columns_of_those_they_replace(table: str) -> None:
    rows = PAPERS.rows(table)
    assert rows and all(row["source"] and None not in row for row in rows)
    if (DATA / table).is_file():
        with (DATA / table).open(newline="") as lines:
            assert list(rows[0]) == next(csv.reader(lines))


def test_papers_drives_the_printed_groups_only() -> None:
    assert activated("external_intercostals", "papers") == {"external_intercostals": 1.0}
    assert activated("internal_intercostals", "papers") == {
        "internal_intercostals": 1.0,
        "parasternal_intercostals": 1.0,
    }
    wall = ("rectus", "external_oblique", "internal_oblique", "transversus")
    assert activated("abdomen", "papers") == dict.fromkeys(wall, 1.0)


def test_calibrated_levels_are_the_default() -> None:
    levels = np.array([0.3, 0.1, 0.2, 0.4])
    np.testing.assert_array_equal(
        group_activation(levels), group_activation(levels, parameters(SETS[0]))
    )


def test_dilorenzo_table_8_1_gives_the_strengths_of_papers() -> None:
    printed = {row["group"]: row for row in read_rows("hill_papers.csv")}
    for row in PAPERS.rows("hill_rows.csv"):
        found = element_strengths([row["group"]], [row["region"]], np.array([0.01]), "male", PAPERS)
        numbers = printed[row["row"]]
        scale = PAPERS["hill_table_scale"]
        assert found.f_max[0] == scale * float(numbers["f_max"])
        assert found.k_pe[0] == scale * float(numbers["k_pe"])
        assert found.b_pe[0] == scale * float(numbers["b_pe"])
        assert found.v_max[0] == float(numbers["v_max"])
        assert found.optimum[0] == 1.0


def test_a_group_without_a_printed_row_is_named() -> None:
    with pytest.raises(ParameterError, match=r"hill_rows\.csv: no row .* for scalenes\. Add one"):
        element_strengths(["scalenes"], [""], np.array([0.01]), "male", PAPERS)


@pytest.mark.parametrize(
    ("group", "region", "highest"),
    [("diaphragm", "", 0.032), ("external_intercostals", "", 0.0067),
     ("external_oblique", "lower_lateral", 0.032)],
)  # fmt: skip
def test_printed_law_pushes_on_while_lengthening_above_a_low_activation(
    group: str, region: str, highest: float
) -> None:
    # Slope of the tension at rest towards lengthening: b_PE against 5 a F_max / v_max.
    s = element_strengths([group], [region], np.array([0.01]), "male", PAPERS)
    h = 1e-6

    def slope(level: float) -> float:
        faster = force_velocity(h / s.v_max[0], PAPERS["hill_curvature"], 0.0)
        ends = [
            hill_tension(level * factor, 1.0, rate, s.f_max[0], s.k_pe[0], s.b_pe[0])
            for factor, rate in ((1.0, 0.0), (faster, h))
        ]
        return float(ends[1] - ends[0]) / h

    assert slope(0.95 * highest) > 0.0 > slope(1.05 * highest)
