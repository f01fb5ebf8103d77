"""The whole target: two people simulated, one page."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from pipeline.validation.table import read_bands

pytestmark = [pytest.mark.slow, pytest.mark.minutes]


def test_physiology_page_from_nothing(study, keep):
    run = study.run("snakemake", "reports/physiology.html", timeout=1800)
    assert run.returncode == 0, run.stderr
    reports = Path(study.folder) / "reports"
    keep(reports / "physiology.html")
    with (reports / "physiology.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(read_bands())
    assert {row["verdict"] for row in rows} <= {"in", "out", "no range", "not stated"}
    assert all(row["why"] for row in rows if row["verdict"] in ("out", "not stated"))
    text = (reports / "physiology.html").read_text("utf-8")
    assert "was not simulated" not in text
    again = study.run("snakemake", "reports/physiology.html")
    assert "Nothing to be done" in again.stdout + again.stderr


def test_mistyped_page_is_one_line(study):
    run = study.run("snakemake", "reports/physiolgy.html")
    assert run.returncode == 1
    assert "Did you mean reports/physiology.html?" in run.stderr
