"""The papers' printed figures and the verdicts on them."""

from __future__ import annotations

import csv
import math
from dataclasses import replace

import pytest

from pipeline import page
from pipeline.papers.behaviours import FORMS
from pipeline.papers.cross import cross_figures
from pipeline.papers.table import (
    LEFT_OUT,
    MECHANISMS,
    Printed,
    Verdict,
    counts,
    judge,
    read_mechanisms,
    read_printed,
)
from pipeline.papers.write import csv_rows, grouped, limits
from pipeline.validation.table import FINDING
from sim.errors import ParameterError

ROW = Printed(
    key="calm_papers", section="breaths", paper="dilorenzo2009", place="Fig. 5.2", form="papers",
    quantity="air", figure="papers.calm.air", printed="0.5", low=0.45, high=0.55, unit="L",
    band="within 10 %", note="",
)  # fmt: skip
RECORDS = (*(f"{form}." for form in FORMS), "map.", "ball.", "printed.", "size.")


def test_every_row_of_the_table_can_be_judged():
    rows = read_printed()
    assert len(rows) > 90
    assert len({row.key for row in rows}) == len(rows)
    assert all(row.figure.startswith(RECORDS) for row in rows)
    assert all(row.printed and row.place and row.quantity for row in rows)
    # a band that is not printed says where it comes from
    assert all(row.band for row in rows if row.unit != FINDING)


def test_rows_of_a_form_take_their_value_from_that_form():
    for row in read_printed():
        if row.form and row.figure.split(".")[0] in FORMS:
            assert row.figure.startswith(f"{row.form}."), row.key


def test_what_is_held_against_both_forms_is_held_against_the_published_set_too():
    forms: dict[str, set[str]] = {}
    for row in read_printed():
        if row.figure.split(".")[0] in FORMS:
            forms.setdefault(row.figure.split(".", 1)[1], set()).add(row.form)
    assert all(found == set(FORMS) for found in forms.values())


def test_mechanisms_belong_to_rows_and_sides():
    keys = {row.key for row in read_printed()}
    keys |= {row.key.removesuffix(f"_{row.form}") for row in read_printed()}
    with MECHANISMS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["key"] for row in rows} <= keys
    assert {row["side"] for row in rows} <= {"in", "low", "high", "yes", "no"}
    assert all(row["why"] for row in rows)
    assert len(read_mechanisms()) == len(rows)


@pytest.mark.parametrize(
    ("value", "verdict", "why"),
    [
        (0.5, Verdict.HOLDS, ""),
        (0.45, Verdict.HOLDS, ""),
        (0.6, Verdict.FAILS, "too strong"),
        (0.4, Verdict.FAILS, "not explained yet"),
    ],
)
def test_a_number_is_held_against_its_band(value, verdict, why):
    told = {("calm_papers", "high"): "too strong"}
    judged = judge(ROW, {"papers.calm.air": value}, told)
    assert (judged.verdict, judged.why, judged.value) == (verdict, why, value)


def test_a_mechanism_may_be_meant_for_all_forms():
    told = {("calm", "in"): "levels were chosen"}
    assert judge(ROW, {"papers.calm.air": 0.5}, told).why == "levels were chosen"


@pytest.mark.parametrize(("found", "verdict"), [(True, Verdict.HOLDS), (False, Verdict.FAILS)])
def test_a_statement_is_true_or_not(found, verdict):
    row = replace(ROW, unit=FINDING, low=math.nan, high=math.nan)
    judged = judge(row, {"papers.calm.air": found}, {("calm_papers", "no"): "because"})
    assert judged.verdict is verdict
    assert judged.shown == ("yes" if found else "no")
    assert judged.why == ("" if found else "because")


def test_a_run_that_is_missing_is_said():
    judged = judge(ROW, {}, {})
    assert judged.verdict is Verdict.NOT_THERE
    assert "papers.calm.air" in judged.why


def test_a_band_without_limits_is_refused():
    with pytest.raises(ParameterError, match="neither low nor high"):
        replace(ROW, low=math.nan, high=math.nan)
    with pytest.raises(ParameterError, match="low is above high"):
        replace(ROW, low=1.0, high=0.5)
    with pytest.raises(ParameterError, match="no form 'ours'"):
        replace(ROW, form="ours")


def test_verdicts_are_counted():
    found = counts(["holds", "holds", "in part"])
    assert found == {"holds": 2, "in part": 1, "does not hold": 0, "not run": 0}


def test_limits_are_printed_as_a_person_reads_them():
    nan = math.nan
    assert limits(0.45, 0.55) == "0.45 to 0.55"
    assert limits(nan, 2.0) == "up to 2"
    assert limits(-0.26, nan) == "from −0.26"
    assert limits(2.0, 2.0) == "2"


def test_both_forms_of_a_quantity_stand_together():
    other = replace(ROW, key="calm_calibrated", form="calibrated", figure="calibrated.calm.air")
    rows = [judge(row, {"papers.calm.air": 2.0, "calibrated.calm.air": 0.5}, {})
            for row in (ROW, other, replace(ROW, key="x", quantity="flow"))]  # fmt: skip
    assert [len(group) for group in grouped(rows)] == [2, 1]
    table = csv_rows(rows)
    assert [row["run"] for row in table] == ["as printed", "calibrated", "as printed"]
    assert [row["verdict"] for row in table] == ["does not hold", "holds", "does not hold"]


def test_figures_across_runs_are_left_out_when_one_is_missing():
    made = cross_figures({"panting.tidal_volume_l": 0.3, "calm.tidal_volume_l": 0.5})
    assert made == {"panting_under_calm": True}


def test_what_is_left_out_has_a_reason():
    rows = page.read_rows(LEFT_OUT)
    assert rows and all(row["reason"] for row in rows)
