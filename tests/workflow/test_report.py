"""Reports: whole without a network, whatever a user wrote escaped, errors always told."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from pipeline.citations import citations, entries
from pipeline.headline import BAD, GOOD, PLAIN
from pipeline.page import cell, digest, inline_svg, number
from pipeline.report import PARTS, write_report
from pipeline.report_tables import breath_facts, rib_table
from pipeline.summary import summarise
from pipeline.tabulate import by_subject, error_rows, group_rows, write_error_table, write_group

ROOT = Path(__file__).resolve().parents[2]
MAX_BYTES = 8_000_000


@pytest.fixture
def report(finished):
    def make(name):
        path = write_report(Path("results") / name, Path("reports") / f"{name}.html")
        return path.read_text(encoding="utf-8")

    return make


class Loaded(HTMLParser):
    """Collects the addresses a browser would load or lead to."""

    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        names = ("src", "srcset", "href", "xlink:href", "data", "action", "poster")
        self.found += [value for name, value in attrs if name in names and value[:1] != "#"]


def fetched(html):
    page = Loaded()
    page.feed(html)
    return page.found + re.findall(r"@import.*|url\((?!#).*?\)", html)


def test_report_tells_the_breath_the_fit_and_the_levels(report):
    html = report("good")
    assert "8 of 9 breaths lasts 4.0 s" in html
    assert "0.40 mm from the measured" in html
    assert "diaphragm 0.20 (0.050 to 0.60)" in html
    assert "No stage failed." in html


@pytest.mark.parametrize("name", ["good", "bad", "never_run"])
def test_every_section_is_there_even_when_nothing_worked(report, name):
    html = report(name)
    for part in PARTS:
        assert f'<section id="{part.id}">' in html
    assert len(html) < MAX_BYTES


def test_unusable_recording_gets_a_report_that_says_why(report):
    html = report("bad")
    assert "could not be used to the end" in html
    assert "Found in the stage “markers”" in html


def test_what_a_user_wrote_is_escaped(report):
    html = report("bad") + report("good")
    assert "<b>C3D</b>" not in html
    assert "&lt;b&gt;C3D&lt;/b&gt;" in html
    assert "<abdomen>" not in html
    assert "&lt;abdomen&gt;" in html


def test_page_fetches_nothing(report):
    html = report("good")
    assert "://" not in html
    assert fetched(html) == []
    scripts = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    assert len(scripts) == html.count("<script") == 1
    assert f"script-src '{digest(scripts[0])}'\">" in html


def test_figures_keep_their_ids_apart_and_carry_no_address(tmp_path):
    head = '<?xml version="1.0"?><!DOCTYPE svg PUBLIC "x" "http://www.w3.org/dtd">'
    body = (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'
        '<metadata>http://purl.org</metadata><path id="p1"/><use xlink:href="#p1"/>'
        '<g clip-path="url(#p1)"/></svg>'
    )
    for name in ("one", "two"):
        (tmp_path / f"{name}.svg").write_text(head + body, encoding="utf-8")
    one, two = (str(inline_svg(tmp_path / f"{name}.svg")) for name in ("one", "two"))
    assert "http" not in one
    assert 'id="one-p1"' in one
    assert 'href="#one-p1"' in one
    assert "url(#two-p1)" in two
    assert inline_svg(tmp_path / "none.svg") is None


def test_error_table_has_a_row_a_recording_and_the_papers_rows(finished):
    rows = error_rows(Path("results"), ["good", "bad"])
    assert [row["recording"] for row in rows[:2]] == ["good", "bad"]
    assert rows[0]["error_p_mm"] == "0.4"
    assert rows[0]["diaphragm"] == "0.2"
    assert rows[1]["error_p_mm"] == ""
    assert "C3D" in rows[1]["status"]
    average = rows[-1]
    assert (average["recording"], average["error_p_mm"], average["error_v_mm_s"]) == (
        "Average",
        "6.8",
        "6.1",
    )
    assert len(rows) == 2 + 5


def test_pages_of_the_study_list_the_unusable_row(finished):
    paths = write_error_table(Path("results"), ["good", "bad"], ["row x"], Path("reports"))
    paths += write_group(Path("results"), ["good", "bad"], ["row x"], Path("reports"))
    for path in paths[1:]:
        html = path.read_text(encoding="utf-8")
        assert "&lt;b&gt;C3D&lt;/b&gt;" in html
        assert "row x" in html
        assert "://" not in html


def test_group_counts_subjects_never_recordings_or_breaths(finished):
    twice = by_subject(Path("results"), ["good", "good", "bad"])
    assert list(twice) == ["p1"]
    rows = {row["group"]: row for row in group_rows({**twice, "p2": {"diaphragm": 0.4}})}
    assert rows["diaphragm"]["n_subjects"] == 2
    assert rows["diaphragm"]["mean"] == pytest.approx(0.3)
    assert rows["abdomen"]["n_subjects"] == 1


def test_figures_of_the_breath_are_told_in_words():
    fit = {
        "tidal_volume_l": 0.512,
        "pleural_pressure_cmh2o": [-6.3, -4.9],
        "rib_rotation_deg": {"rib_L1": {"pump": 0.7, "bucket": 1.02}, "rib_R1": {}},
    }
    facts = dict(breath_facts(fit))
    assert facts["tidal volume (L)"] == 0.512
    assert facts["pleural pressure (cmH2O)"] == "-6.30 to -4.90"
    assert facts["rib cage share"] == ""
    rows = rib_table(fit["rib_rotation_deg"])
    assert rows == [{"rib": "1", "pump": "0.70", "bucket": "1.0"}]


NUMBERS = {
    0.012345: "0.0123",
    1234.5: "1234",
    "14": "14",
    "": "–",
    float("nan"): "–",
    1e-9: "0",
    "a word": "a word",
    -2.345: "-2.35",
}


@pytest.mark.parametrize(("value", "text"), NUMBERS.items())
def test_numbers_have_three_digits_and_gaps_a_dash(value, text):
    assert number(value) == text


def test_cells_keep_what_a_table_prints():
    assert cell("0.040") == "0.040"
    assert cell("0.0400123") == "0.0400"


@pytest.mark.parametrize("name", ["good", "bad", "never_run"])
def test_first_screen_gives_the_result_before_anything_else(report, name):
    html = report(name)
    first = html.split('<section id="summary">')[1].lstrip()
    mark = "plain" if name == "good" else "bad"
    assert first.startswith(f'<p class="result {mark}">')


def test_a_page_carries_its_references_as_text_and_as_bibtex(report):
    html = report("good")
    assert html.count('data-copy="the methods"') == 1
    cited = citations("breath")
    assert {"pleura", "zordan2006", "dilorenzo2009", "mujoco"} <= {one.key for one in cited}
    for one in cited:
        assert f"{{{one.key}," in html


@pytest.mark.parametrize("kind", ["breath", "laugh", "papers", "physiology", "view"])
def test_references_of_the_pages_are_those_of_the_bibliography(kind):
    whole = entries((ROOT / "docs/references.bib").read_text("utf-8"))
    for one in citations(kind):
        assert one.bibtex == whole[one.key]


@pytest.mark.parametrize(("spread", "mark"), [("0.5", GOOD), ("0.3", PLAIN), ("", PLAIN)])
def test_a_fit_is_good_when_it_is_as_near_as_the_breaths_are_to_each_other(spread, mark):
    row = {"scope": "cycles_all", "error_p_mm": "0.4", "error_p_still_mm": "1", "spread_mm": spread}
    records = {"signature": {"status": "failed"}, "fit": {}, "posterior": {}}
    assert summarise(records, [row], [], "").mark == mark
    assert summarise(records, [{**row, "error_p_mm": "1.2"}], [], "").mark == BAD
    assert summarise(records, [row], [], "no file").mark == BAD
