"""The bands of the validation table, the verdicts on them, and the page of both."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline import page
from pipeline.records import write_json
from pipeline.validation.person import across
from pipeline.validation.strip import LEFT, RIGHT, WIDTH, place, strip
from pipeline.validation.table import (
    LEFT_OUT,
    TABLE,
    Band,
    Verdict,
    counts,
    judge,
    read_bands,
    read_mechanisms,
    share_in,
)
from pipeline.validation.write import band_text, write_physiology
from sim.errors import ParameterError

ROOT = Path(__file__).resolve().parents[2]
BAND = Band(
    set="", area="a", quantity="q", condition="c", sex="male", posture="upright", figure="run.x",
    low=1.0, high=2.0, value=math.nan, unit="cm", citation="s", doi="", verified="yes",
    kind="emergent", note="",
)  # fmt: skip
WHY = {("run.x", "low"): "too stiff", ("run.x", "no"): "other way"}


def judged(value, band=BAND, missing=None):
    figures = {} if value is None else {band.figure: value}
    people = {"male": {"figures": figures, "missing": missing or {}}}
    return judge(band, people, WHY)


@pytest.mark.parametrize(
    ("value", "verdict", "why"),
    [
        (1.0, Verdict.IN, ""),
        (2.0, Verdict.IN, ""),
        (0.999, Verdict.OUT, "too stiff"),
        (2.001, Verdict.OUT, "not explained yet"),
        ("< -30", Verdict.OUT, "too stiff"),
        ("> 25", Verdict.OUT, "not explained yet"),
    ],
)
def test_limits_belong_to_the_band_and_out_has_a_reason(value, verdict, why):
    row = judged(value)
    assert (row.verdict, row.why) == (verdict, why)


def test_one_limit_is_enough():
    below = replace(BAND, low=math.nan)
    assert judged(-5.0, below).verdict is Verdict.IN
    assert judged(2.1, below).verdict is Verdict.OUT
    assert judged(0.5, replace(BAND, high=math.nan)).verdict is Verdict.OUT
    assert band_text(below) == "up to 2"


def test_finding_is_true_or_not():
    finding = replace(BAND, unit="finding", low=math.nan, high=math.nan)
    assert judged(True, finding).verdict is Verdict.IN
    row = judged(False, finding)
    assert (row.verdict, row.shown, row.why) == (Verdict.OUT, "no", "other way")


def test_value_without_a_range_is_shown_and_not_judged():
    row = judged(1.5, replace(BAND, low=math.nan, high=math.nan))
    assert row.verdict is Verdict.NO_RANGE
    assert row.value == 1.5


def test_row_that_cannot_be_stated_says_why():
    row = judged(None, missing={"run": "the simulation diverged"})
    assert row.verdict is Verdict.NOT_THERE
    assert "diverged" in row.why


def test_comparison_with_a_run_that_stopped_is_left_out_and_says_why():
    figures = {"calm_upright.rib_cage_share": 0.55, "calm_supine.rib_cage_share": 0.45}
    assert across(figures) == {}
    whole = {**figures, "vital_capacity_upright.rib_cage_share": 0.6}
    assert across(whole) == {"cross.rib_cage_predominates": True}
    assert across({**whole, "calm_supine.rib_cage_share": 0.6}) == {
        "cross.rib_cage_predominates": False
    }
    row = judged(
        None, replace(BAND, figure="cross.rib_cage_predominates", unit="finding"),
        missing={"vital_capacity_upright": "diverged after 7 s"},
    )  # fmt: skip
    assert row.verdict is Verdict.NOT_THERE
    assert row.why == "vital_capacity_upright: diverged after 7 s"


def test_comparison_of_two_people_needs_both():
    band = replace(BAND, sex="both", figure="cross.share_women", unit="finding")
    share = {"calm_upright.rib_cage_share": 0.5}
    man, woman = ({"figures": f, "missing": {}} for f in (share, {}))
    woman["missing"] = {"calm_upright": "diverged"}
    row = judge(band, {"male": man, "female": woman}, WHY)
    assert (row.verdict, row.why) == (Verdict.NOT_THERE, "calm_upright: diverged")
    woman["figures"] = {"calm_upright.rib_cage_share": 0.6}
    assert judge(band, {"male": man, "female": woman}, WHY).verdict is Verdict.IN


def test_only_judged_rows_count_in_the_share():
    rows = [judged(v) for v in (1.5, 1.6, 3.0, None)]
    assert share_in(rows) == pytest.approx(2 / 3)
    assert counts(rows)["emergent"] == {"in": 2, "out": 1, "no range": 0, "not stated": 1}
    assert math.isnan(share_in([]))


@pytest.mark.parametrize(("low", "high", "kind"), [(2.0, 1.0, "emergent"), (1.0, 2.0, "tunde")])
def test_bad_row_is_refused(low, high, kind):
    with pytest.raises(ParameterError, match=r"validation\.csv: q"):
        replace(BAND, low=low, high=high, kind=kind)


def test_strip_tells_in_and_out_by_shape():
    assert place(1.0, 2.0, 1.5) == pytest.approx(0.5 * (LEFT + RIGHT))
    assert place(1.0, 2.0, 1e9) < WIDTH
    assert "<circle" in strip(1.0, 2.0, 1.5, "")
    out = strip(1.0, 2.0, math.inf, "high")
    assert "<polygon" in out
    assert "above the band" in out


def test_every_number_of_the_suggested_set_has_rows():
    bands = read_bands()
    assert {int(b.set) for b in bands if b.set} == set(range(1, 16))
    assert {b.verified for b in bands} == {"yes", "partial", "no"}
    assert all(b.citation for b in bands)
    assert {figure for figure, _ in read_mechanisms()} <= {b.figure for b in bands}
    assert all(why and "\n" not in why for why in read_mechanisms().values())


def _person(sex):
    """A person who meets every band."""
    figures = {"calm_upright.rib_cage_share": {"male": 0.5, "female": 0.6}[sex]}
    for band in read_bands():
        ends = [x for x in (band.low, band.high) if not math.isnan(x)]
        if band.sex == sex:
            middle = sum(ends) / len(ends) if ends else 1.0
            figures.setdefault(band.figure, True if band.unit == "finding" else middle)
    curve = {"volume": [1.0, 3.0, 6.0], "wall": [-20.0, -5.0, 10.0], "lung": [0.0, 5.0, 30.0]}
    return {
        "sex": sex,
        "stature_m": 1.7,
        "mass_kg": 70.0,
        "figures": figures,
        "missing": {"laugh_upright": "the behaviour 'laugh' is not there <yet>"},
        "rahn": {**curve, "capacity": [1.5, 3.0, 6.0]},
        "diaphragm": {
            "volume": [1.5, 3.0, 6.0],
            "pdi": [160.0, 150.0, 70.0],
            "active_volume": [3.0, 6.0],
            "active_pdi": [150.0, 60.0],
        },
    }


def test_page_is_whole_offline_and_beside_its_table(tmp_path):
    for sex in ("male", "female"):
        write_json(tmp_path / f"{sex}.json", _person(sex))
    paths = write_physiology(tmp_path, tmp_path / "reports")
    rows = page.read_rows(paths[0])
    text = paths[1].read_text("utf-8")
    assert len(rows) == len(read_bands())
    assert re.search(r"Emergent: \d+ of \d+ in band", text)
    assert "&lt;yet&gt;" in text
    assert not re.search(r'(src|href)="(https?:)?//', text)
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids))


@pytest.fixture(scope="module")
def reference():
    """The reference beside the repository, its rows by quantity and population, and its README."""
    folder = ROOT.parent / "shared" / "reference"
    if not folder.is_dir():
        pytest.skip("the reference is not beside the repository")
    with (folder / "physiology.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return rows, (folder / "README.md").read_text("utf-8")


def _numbers(text):
    """Every number of a text, and mean - SD and mean + SD of what is written as mean +- SD."""
    found = {round(float(n), 6) for n in re.findall(r"\d+(?:\.\d+)?", text)}
    for mean, sd in re.findall(r"(\d+(?:\.\d+)?) \+- (\d+(?:\.\d+)?)", text):
        found |= {round(float(mean) + s * float(sd), 6) for s in (-1, 1, -2, 2)}
    return found


def test_bands_agree_with_the_reference(reference):
    rows, readme = reference
    known = {f"{r['quantity']} | {r['population_or_condition']}": r for r in rows}
    lines = dict(re.findall(r"^\| (\d+) \| (.*)$", readme, re.M))
    for row in page.read_rows(TABLE):
        source = known[row["reference"]]
        assert row["citation"] == source["citation"]
        assert row["doi"] == source["doi"]
        assert row["verified"] == source["verified"].split(":")[0].strip()
        limits = [row[k] for k in ("low", "high") if row[k] not in ("", "yes")]
        if row["band_from"] == "row":
            assert (row["low"], row["high"]) == (source["low"], source["high"]), row["quantity"]
        elif row["band_from"] == "value":
            assert limits == [source["value"]]
        elif row["band_from"] == "set":
            line = lines[row["set"]]
            numbers = _numbers(line.replace("-", " ")) | _numbers(line)
            assert {round(float(x), 6) for x in limits} <= numbers, row["quantity"]


def test_bands_of_notes_are_written_there(reference):
    """A mean from the note and its spread: both numbers stand in the note."""
    rows, _ = reference
    known = {f"{r['quantity']} | {r['population_or_condition']}": r for r in rows}
    for row in page.read_rows(TABLE):
        if row["band_from"] != "note" or not row["low"] or not row["high"]:
            continue
        note = known[row["reference"]]["note"]
        numbers = _numbers(note) | _numbers(note.replace("-", " "))
        low, high = float(row["low"]), float(row["high"])
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        printed = {round(low, 6), round(high, 6)} <= numbers
        spread = {round(half, 6), round(half / 2, 6)} & numbers
        assert printed or (round(middle, 6) in numbers and spread), row["quantity"]


def test_no_row_of_the_reference_is_hidden(reference):
    rows, _ = reference
    used = {row["reference"] for row in page.read_rows(TABLE)}
    left = page.read_rows(LEFT_OUT)
    assert sum(int(row["n_rows"]) for row in left) + len(used) == len(rows)
    named = {row["quantity"] for row in left}
    for row in rows:
        key = f"{row['quantity']} | {row['population_or_condition']}"
        if row["area"].startswith(("mechanics", "kinematics")) and key not in used:
            assert row["quantity"] in named
    assert all(row["reason"] for row in left)
