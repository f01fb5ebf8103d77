"""References of a page, as text and as BibTeX, ready to be pasted."""

from __future__ import annotations

import re
from dataclasses import dataclass

from pipeline import page

BIBLIOGRAPHY = page.TABLES / "citations.bib"
"""The entries of docs/references.bib that pages cite."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Citation:
    """A reference.

    Parameters
    ----------
    key : of the bibliography
    text, bibtex : the reference
    """

    key: str
    text: str
    bibtex: str


def entries(text: str) -> dict[str, str]:
    """BibTeX entries by key; an entry ends with a brace at the beginning of a line."""
    found = re.finditer(r"^@\w+\{(\w+),.*?^\}", text, re.DOTALL | re.MULTILINE)
    return {one.group(1): one.group(0) for one in found}


def citations(kind: str) -> list[Citation]:
    """References of a kind of page, in the order of the table.

    Parameters
    ----------
    kind : a word of the column `pages` of citations.csv
    """
    bibtex = entries(BIBLIOGRAPHY.read_text(encoding="utf-8"))
    return [
        Citation(key=row["key"], text=row["text"], bibtex=bibtex[row["key"]])
        for row in page.read_rows(page.TABLES / "citations.csv")
        if kind in row["pages"].split()
    ]
