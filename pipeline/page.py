"""What every HTML page shares: templates, figures put inside the page, numbers as text."""

from __future__ import annotations

import base64
import csv
import hashlib
import math
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

TEMPLATES = Path(__file__).parent / "templates"
TABLES = Path(__file__).parent / "tables"
STYLES = ("tokens.css", "page.css", "viewer.css")
SCRIPT = TEMPLATES / "page.js"
SUBJECT_MEAN = "subject_mean"
GROUPS = ("external_intercostals", "diaphragm", "internal_intercostals", "abdomen")

SMALLEST = 1e-6

Rows = list[dict[str, str]]


def number(value: Any, digits: int = 3) -> str:
    """Return `value` with so many significant digits; a dash for what is missing."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int) or (isinstance(value, str) and re.fullmatch(r"-?\d+", value)):
        return str(value)
    try:
        given = float(value)
    except (TypeError, ValueError):
        return "–" if value in (None, "") else str(value)
    if not math.isfinite(given):
        return "–"
    if abs(given) < SMALLEST:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(given))))
    return f"{given:.{min(places, 6)}f}"


def cell(value: Any) -> str:
    """Return `number`, but what a table prints with up to three decimals as it is printed."""
    printed = isinstance(value, str) and re.fullmatch(r"-?\d+\.\d{1,3}", value)
    return str(value) if printed else number(value)


def words(key: str) -> str:
    """Return a key as words: `external_intercostals` → `external intercostals`."""
    return key.replace("_", " ")


def sentence(line: str) -> str:
    """Return a line with a capital and a full stop."""
    text = line.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def read_rows(path: Path) -> Rows:
    """Read a CSV file as text; a file that is not there has no rows."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def flat(content: Any, prefix: str = "") -> Iterable[tuple[str, Any]]:
    """Yield (dotted key, value) of every number, word and short list in nested records."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from flat(value, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(content, list | tuple):
        if all(not isinstance(v, Mapping | list | tuple) for v in content) and len(content) <= 12:
            yield prefix, ", ".join(number(v) for v in content) or "none"
    else:
        yield prefix, content


def messages(content: Any) -> list[str]:
    """Collect every line under a key `warnings` or `notes`, at any depth."""
    found: list[str] = []
    if isinstance(content, Mapping):
        for key, value in content.items():
            if key in ("warnings", "notes") and isinstance(value, list | tuple):
                found += [str(line) for line in value]
            else:
                found += messages(value)
    return list(dict.fromkeys(found))


def inline_svg(path: Path) -> Markup | None:
    """Return a figure to stand inside a page, its ids made unique; None when there is none.

    Parameters
    ----------
    path : an SVG file that a stage wrote
    """
    if not path.exists():
        return None
    return own_ids(path.read_text(encoding="utf-8"), re.sub(r"\W", "-", path.stem))


def own_ids(text: str, mark: str) -> Markup | None:
    """Return the text of a figure to stand inside a page, its ids marked as its own."""
    start = text.find("<svg")
    if start < 0:
        return None
    text = re.sub(r"<metadata>.*?</metadata>", "", text[start:], flags=re.DOTALL)
    text = re.sub(r'\s+xmlns(:\w+)?="[^"]*"', "", text)
    text = re.sub(r'\bid="', f'id="{mark}-', text)
    text = re.sub(r'href="#', f'href="#{mark}-', text)
    text = re.sub(r"url\(#", f"url(#{mark}-", text)
    return Markup(text)


def digest(script: str) -> str:
    """Return the word by which a page's policy allows this script."""
    return f"sha256-{base64.b64encode(hashlib.sha256(script.encode('utf-8')).digest()).decode()}"


@cache
def environment() -> jinja2.Environment:
    """Return the templates; whatever a user wrote is escaped."""
    made = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["number"] = number
    made.filters["cell"] = cell
    made.filters["words"] = words
    made.filters["sentence"] = sentence
    styles = [(TEMPLATES / name).read_text(encoding="utf-8") for name in STYLES]
    made.globals["css"] = Markup("".join(styles))
    script = SCRIPT.read_text(encoding="utf-8")
    made.globals |= {"page_script": Markup(script), "page_digest": digest(script), "sections": ()}
    return made


def render(template: str, **context: Any) -> str:
    """Return a page."""
    return environment().get_template(template).render(**context)
