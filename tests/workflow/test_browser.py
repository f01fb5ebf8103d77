"""A report in a real browser: opens from disk, loads nothing else, fits a phone."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.draw.fit import markers_time_svg, sagittal_svg
from pipeline.page import environment
from pipeline.report import write_report
from pipeline.tabulate import write_group

pytestmark = pytest.mark.slow


@pytest.fixture
def page_of(finished, plant_motion):
    figures = {"sagittal": sagittal_svg, "markers_time": markers_time_svg}
    for name, draw in figures.items():
        text = draw(**plant_motion[name])
        (Path("results") / "good" / f"{name}.svg").write_text(text, encoding="utf-8")
    for name in ("good", "bad"):
        write_report(Path("results") / name, Path("reports") / f"{name}.html")
    write_group(Path("results"), ["good", "bad"], [], Path("reports"))
    return lambda name: (finished.folder / "reports" / f"{name}.html").as_uri()


@pytest.fixture
def plant_motion():
    import numpy as np

    time = np.linspace(0, 4, 41)
    place = np.array([[0.1, 0.0, 0.3], [0.1, 0.0, 0.1], [-0.1, 0.0, 0.2]])
    motion = place + 0.004 * np.sin(np.pi * time / 4)[:, None, None] * np.array([1.0, 0.0, 0.5])
    shared = {"shown": ("STRN", "NAVEL", "T10"), "front": (0, 1)}
    both = {"measured": motion, "simulated": place + 0.9 * (motion - place)}
    band = {"low": motion - 1e-3, "high": motion + 1e-3, "time": time}
    return {"sagittal": {**shared, **both}, "markers_time": {**shared, **both, **band}}


@pytest.mark.parametrize("name", ["good", "bad", "group"])
@pytest.mark.parametrize("width", [1200, 390])
def test_page_loads_nothing_else_and_never_scrolls_sideways(browser, page_of, name, width):
    page = browser.new_page(viewport={"width": width, "height": 900})
    asked, said = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.goto(page_of(name))
    assert asked == [page_of(name)]
    assert said == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_links_of_the_contents_lead_to_sections(browser, page_of):
    page = browser.new_page()
    page.goto(page_of("good"))
    links = page.eval_on_selector_all("nav a", "all => all.map(a => a.getAttribute('href'))")
    assert len(links) == 13
    for link in links:
        assert page.query_selector(link) is not None


def test_figures_are_drawn_in_the_page(browser, page_of):
    page = browser.new_page(viewport={"width": 1000, "height": 900})
    page.goto(page_of("good"))
    sizes = page.eval_on_selector_all(
        "figure svg", "all => all.map(s => s.getBoundingClientRect().height)"
    )
    assert len(sizes) == 2
    assert min(sizes) > 200


GRID = (
    "<table><thead><tr><th>a</th><th>b</th><th>c</th></tr></thead><tbody>"
    '<tr><td rowspan="2">one \N{MINUS SIGN}1</td><td>2</td><td><svg></svg></td></tr>'
    '<tr><td colspan="2">two  words</td></tr></tbody></table>'
)


def test_a_table_is_copied_with_every_cell_in_its_column(browser, tmp_path):
    from pipeline.headline import Headline

    made = environment().from_string(
        '{% extends "base.html" %}{% block main %}' + GRID + '<p data-copy="it">How.</p>'
        "<details><summary>More</summary><p>inside</p></details>{% endblock %}"
    )
    (tmp_path / "t.html").write_text(
        made.render(head=Headline(kind="T", title="t")), encoding="utf-8"
    )
    page = browser.new_page()
    page.goto((tmp_path / "t.html").as_uri())
    # what reaches the clipboard, whatever the browser allows a page from disk
    page.evaluate(
        "navigator.clipboard.writeText = (text) => { window.got = text; return Promise.resolve(); }"
    )
    page.get_by_role("button", name="Copy this table").click()
    assert page.evaluate("window.got") == "a\tb\tc\none -1\t2\t\none -1\ttwo words\t"
    page.get_by_role("button", name="Copy it").click()
    assert page.evaluate("window.got") == "How."
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator("details p").is_visible()
    page.emulate_media(media="print")
    assert not page.locator("nav, .copy").first.is_visible()
