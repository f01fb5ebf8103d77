"""The whole target with a small map, killed half-way and taken up again."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from pipeline.papers.table import read_printed

pytestmark = [pytest.mark.slow, pytest.mark.minutes]
SMALL = "papers:\n  map_contractions: 3\n  map_periods: 3\n  map_batch: 2\n"


def test_papers_page_from_nothing(study, keep):
    (Path(study.folder) / "config" / "config.yaml").write_text(SMALL, encoding="utf-8")
    run = study.run("snakemake", "reports/papers.html", timeout=1800)
    assert run.returncode == 0, run.stderr
    reports = Path(study.folder) / "reports"
    keep(reports / "papers.html")
    with (reports / "papers.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > len(read_printed())
    assert {row["verdict"] for row in rows} <= {"holds", "in part", "does not hold"}
    # a map of nine runs is no map of 300
    told = {row["quantity"]: row["verdict"] for row in rows}
    assert told["runs of the map"] == "does not hold"
    missing = [r["quantity"] for r in rows if r["verdict"] != "holds" and "not expl" in r["why"]]
    assert set(missing) <= {
        "runs of the map",
        "share of steps to more contraction that move more air",
    }
    page = (reports / "papers.html").read_text("utf-8")
    assert len(page) < 8_000_000
    assert "http" not in page.replace("http-equiv", "")
    assert page.count("<svg") > 30
    again = study.run("snakemake", "reports/papers.html")
    assert "Nothing to be done" in again.stdout + again.stderr


def test_mistyped_page_is_one_line(study):
    run = study.run("snakemake", "reports/paper.html")
    assert run.returncode == 1
    assert "Did you mean reports/papers.html" in run.stderr
