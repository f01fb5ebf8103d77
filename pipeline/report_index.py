"""reports/index.html: what stands in the folder of reports, read from the pages themselves."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pipeline import page
from pipeline.headline import BAD, GOOD, Headline
from pipeline.records import write_text

NAME = "index.html"
HEAD = 20_000
"""Characters at the beginning of a page that hold what it says of itself."""
ENTRY = re.compile(r'<meta name="pleura-(\w+)" content="([^"]*)">')
TITLE = re.compile(r"<title>(.*?) – Pleura</title>")


@dataclass(frozen=True, kw_only=True, slots=True)
class Built:
    """A page as it tells of itself.

    Parameters
    ----------
    file : its name in the folder; title, kind, result, mark, figure, made : of its `Headline`
    """

    file: str
    title: str
    kind: str
    result: str
    mark: str
    figure: str
    made: str


def built(reports: Path) -> list[Built]:
    """Every page of Pleura in a folder but the index, by kind and name.

    Parameters
    ----------
    reports : the folder; one that is not there holds nothing
    """
    found = []
    for path in sorted(reports.glob("*.html")):
        if path.name == NAME:
            continue
        with path.open(encoding="utf-8", errors="replace") as stream:
            text = stream.read(HEAD)
        about = {key: html.unescape(value) for key, value in ENTRY.findall(text)}
        title = TITLE.search(text)
        if "kind" not in about or title is None:
            continue
        found.append(
            Built(
                file=path.name,
                title=html.unescape(title.group(1)),
                **{key: about.get(key, "") for key in ("kind", "result", "mark", "figure", "made")},
            )
        )
    return sorted(found, key=lambda one: (one.kind, one.file))


def _head(found: Iterable[Built]) -> Headline:
    pages = list(found)
    bad = sum(one.mark == BAD for one in pages)
    if not pages:
        result = "No report has been built yet: snakemake reports/subject1.html makes one."
    else:
        words = "page" if len(pages) == 1 else "pages"
        missed = f", {bad} of them with a result that is not as asked for" if bad else ""
        result = f"{len(pages)} {words}{missed}."
    return Headline(
        kind="Index",
        title="Reports",
        result=result,
        mark=GOOD if pages and not bad else "plain",
    )


def write_index(reports: Path) -> Path:
    """Write the index of a folder of reports.

    Parameters
    ----------
    reports : the folder
    """
    found = built(reports)
    path = reports / NAME
    write_text(path, page.render("index.html", head=_head(found), pages=found))
    return path
