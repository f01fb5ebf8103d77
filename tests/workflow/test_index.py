"""reports/index.html: every page that was built, by what it says of itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.__main__ import main
from pipeline.report import write_report
from pipeline.report_index import built, write_index
from pipeline.tabulate import write_group
from pipeline.workflow import INDEX, check_targets, read_plan


@pytest.fixture
def reports(finished):
    folder = finished.folder / "reports"
    for name in ("good", "bad"):
        write_report(Path("results") / name, folder / f"{name}.html")
    write_group(Path("results"), ["good", "bad"], [], folder)
    return folder


def test_pages_are_listed_by_kind_with_result_figure_and_date(reports):
    (reports / "of_another_program.html").write_text("<title>x</title>", encoding="utf-8")
    found = {one.file: one for one in built(reports)}
    assert list(found) == ["bad.html", "good.html", "group.html"]
    good, bad = found["good.html"], found["bad.html"]
    assert (good.kind, good.mark, good.title) == ("Breath", "plain", "good")
    assert good.figure == "0.40 mm mean error of the markers"
    assert bad.mark == "bad" and "<b>C3D</b>" in bad.result
    assert len(good.made) == len("2026-01-31T12:00")


def test_page_leads_to_every_page_and_escapes_what_a_user_wrote(reports):
    text = write_index(reports).read_text(encoding="utf-8")
    for one in built(reports):
        assert f'<a href="{one.file}">' in text
    assert "3 pages, 2 of them with a result that is not as asked for." in text
    assert "<b>C3D</b>" not in text
    assert "index.html" not in [one.file for one in built(reports)]


def test_empty_folder_gets_one_clear_line(in_study, capsys):
    assert main(["index"]) == 0
    assert capsys.readouterr().out == "index: reports/index.html\n"
    text = Path(INDEX).read_text(encoding="utf-8")
    assert "No report has been built yet: snakemake reports/subject1.html makes one." in text
    assert "<table" not in text


def test_it_waits_for_what_is_asked_for_with_it_and_for_nothing_else(finished):
    plan = read_plan({})
    assert plan.indexed([INDEX]) == []
    assert plan.indexed([INDEX, "reports/good.html", "results/good/fit.json"]) == [
        "reports/good.html"
    ]
    every = ["bad", "error_table", "good", "group"]
    assert plan.indexed([]) == plan.indexed(["all"]) == [f"reports/{n}.html" for n in every]
    assert plan.asked([INDEX]) == ([], [])
    check_targets([INDEX], [], plan.study)


def test_a_page_that_appears_beside_it_makes_it_anew(reports):
    plan = read_plan({})
    before = plan.others([INDEX])
    assert len(before) == 3
    (reports / "physiology.html").write_text("new", encoding="utf-8")
    assert len(plan.others([INDEX])) == 4
    write_index(reports)
    assert len(plan.others([INDEX])) == 4
