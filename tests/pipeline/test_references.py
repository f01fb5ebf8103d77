"""The bibliography: every key that the project cites is in it, once."""

from __future__ import annotations

import csv
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def keys() -> list[str]:
    return re.findall(r"^@\w+\{(\w+),", (ROOT / "docs/references.bib").read_text("utf-8"), re.M)


def test_each_key_is_there_once_and_the_entries_close() -> None:
    text = (ROOT / "docs/references.bib").read_text("utf-8")
    assert len(keys()) == len(set(keys())) >= 60
    assert text.count("{") == text.count("}")
    assert all(doi.startswith("10.") for doi in re.findall(r"doi = \{([^}]*)\}", text))


def test_cited_keys_exist() -> None:
    with (ROOT / "pipeline/tables/citations.csv").open(encoding="utf-8", newline="") as file:
        cited = {row["key"] for row in csv.DictReader(file)}
    for page in (ROOT / "docs").rglob("*.md"):
        cited |= set(re.findall(r"\[([a-z]+\d{4})\]", page.read_text("utf-8")))
    assert cited
    assert cited <= set(keys()), sorted(cited - set(keys()))
