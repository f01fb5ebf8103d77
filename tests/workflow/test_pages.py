"""The script that opens every built page sees what is right and what is wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib.image
import pytest

from pipeline.__main__ import main
from pipeline.report import write_report
from pipeline.report_index import write_index
from pipeline.tabulate import write_error_table, write_group
from pipeline.view import write_view
from sim.trajectory import save_motion

pytestmark = pytest.mark.slow


@pytest.fixture
def built(finished, small_motion, keep):
    """Every page that costs nothing to build."""
    good, reports = Path("results/good"), Path("reports")
    save_motion(good / "trajectory.h5", small_motion, {"recording": "good"})
    short = replace(small_motion.frames(0, 30), measured=None)
    save_motion(Path("short.h5"), short, {"style": "short"})
    for name in ("good", "bad"):
        write_report(Path("results") / name, reports / f"{name}.html")
    write_error_table(Path("results"), ["good", "bad"], [], reports)
    write_group(Path("results"), ["good", "bad"], [], reports)
    write_view([good / "trajectory.h5", Path("short.h5")], reports / "beside.html")
    assert main(["retraining_report", "bad"]) == 0
    write_index(reports)
    for path in reports.glob("*.html"):
        keep(path)
    return reports


# `.ci/run` opens all that were kept
def test_pages_are_good_in_every_look(browser, built, open_pages, tmp_path):
    for name in ("beside", "index"):
        assert open_pages.open_page(browser, built / f"{name}.html", tmp_path) == [], name
    for look in ("light", "dark"):
        picture = matplotlib.image.imread(tmp_path / f"beside_{look}_torso.png")
        assert picture.shape[:2] == (720, 1280)
        assert picture.std() > 0.02
    assert (tmp_path / "index_whole.png").exists()


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("<script>console.log('oh')</script>", "phone: says oh"),
        ("<script>missing()</script>", "phone: says missing is not defined"),
        ("<img src='gone.png'>", "gone.png"),
        ("<div style='width: 2000px'>x</div>", "phone: scrolls sideways"),
    ],
)
def test_what_is_wrong_is_told(browser, open_pages, monkeypatch, tmp_path, wrong, told):
    monkeypatch.setattr(open_pages, "LOOKS", {"phone": open_pages.LOOKS["phone"]})
    page = tmp_path / "page.html"
    page.write_text(f"<!doctype html><title>t</title><h1>t</h1>{wrong}", encoding="utf-8")
    assert told in " ".join(open_pages.open_page(browser, page, tmp_path))


def test_a_torso_that_is_not_drawn_is_told(browser, built, open_pages, monkeypatch, tmp_path):
    monkeypatch.setattr(open_pages, "LOOKS", {"light": open_pages.LOOKS["light"]})
    text = (built / "good.html").read_text(encoding="utf-8")
    blank = tmp_path / "blank.html"
    hidden = text.replace("</style>", "#viewer canvas { opacity: 0 }</style>", 1)
    blank.write_text(hidden, encoding="utf-8")
    assert "of the canvas is drawn" in " ".join(open_pages.open_page(browser, blank, tmp_path))
