"""The page of a retraining: steps to play and a pace to breathe with, in a real browser too."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.__main__ import main
from pipeline.draw.retraining import steps_svg
from pipeline.job import make_job
from pipeline.retraining_report import write_retraining_report
from pipeline.status import read_status, write_ok
from pipeline.view import MOST_BYTES
from pipeline.workflow import check_targets, read_plan
from sim.trajectory import save_motion

PERIODS = (2.0, 4.0)


def row(number, error=0.01):
    return {
        "step": number, "rate_per_min": 60 / PERIODS[number], "inspiration_s": 0.8 * (1 + number),
        "expiration_s": 1.2 * (1 + number), "tidal_volume_l": 0.4 + 0.1 * number,
        "swept_volume_l": 0.4, "asked_swept_volume_l": 0.41, "belly_share": 0.45 + 0.2 * number,
        "asked_belly_share": 0.66, "rib_cage_share": 0.55 - 0.2 * number,
        "alveolar_ventilation_l_min": 4.0, "external_intercostals": 0.07, "diaphragm": 0.03,
        "internal_intercostals": 0.0, "abdomen": 0.0, "error": error, "n_runs": 3, "steady": True,
    }  # fmt: skip


def put(folder, motion, error=0.01):
    """Leave what the stage leaves."""
    plan = read_plan({})
    for number, period in enumerate(PERIODS):
        paced = replace(motion, time=(motion.time - motion.time[0]) * period / 2.04, measured=None)
        save_motion(folder / f"retraining_{number}.h5", paced, {"style": "step"})
    volume = 1e3 * motion.volumes["lung"]
    drawing = steps_svg(curves=[(motion.time, volume), (2 * motion.time, volume)])
    (folder / "retraining.svg").write_text(drawing, encoding="utf-8")
    content = {
        "target": {"rate_per_min": 15.0}, "tolerance": 0.02, "n_runs": 7,
        "steps": [row(0, 0.0), row(1, error)], "warnings": ["step 1 is <odd>"],
    }  # fmt: skip
    job = make_job(plan.study.entry("good"), "retraining", plan.config)
    write_ok(folder / "retraining.json", job, content, 1.0)


@pytest.fixture
def page(finished, small_motion):
    put(Path("results/good"), small_motion)
    return write_retraining_report(Path("results/good"), Path("reports/good_retraining.html"))


def test_result_table_and_pace_are_told(page):
    html = page.read_text(encoding="utf-8")
    assert "From 30 to 15 breaths a minute and from 45 to 65 % of the breath by the belly" in html
    assert '<p class="result good">' in html and "It is no treatment" in html
    assert html.count("<td>own breath</td>") == html.count("<td>step 1</td>") == 2
    assert "step 1 is &lt;odd&gt;" in html.lower() and "<odd>" not in html
    assert len(html) < MOST_BYTES


def test_a_step_that_is_not_reached_marks_the_page(finished, small_motion):
    put(Path("results/good"), small_motion, error=0.3)
    path = write_retraining_report(Path("results/good"), Path("reports/good_retraining.html"))
    assert '<p class="result bad">' in path.read_text(encoding="utf-8")


def test_without_a_fit_the_page_says_why(finished, capsys):
    assert main(["retraining", "bad"]) == 0
    assert read_status(Path("results/bad"), "retraining")["stage"] == "markers"
    assert main(["retraining_report", "bad"]) == 0
    html = Path("reports/bad_retraining.html").read_text(encoding="utf-8")
    assert "There are no steps: first.c3d: is not a &lt;b&gt;C3D" in html


def test_a_laugh_has_no_retraining(in_study):
    path = in_study.recording_file("ha.wav")
    in_study.rows(("ha", "laugh", "p1", path))
    plan = read_plan({})
    job = make_job(plan.study.entry("ha"), "retraining", plan.config)
    assert "is a laugh, whose stages are audio, pressure, calls, follow." in job.problem


def test_it_answers_for_its_recording_alone_and_its_name_is_reserved(finished):
    plan = read_plan({})
    target = "reports/good_retraining.html"
    assert plan.asked([target]) == (["good"], [])
    check_targets([target], [], plan.study, ["reports/{name,good|bad}_retraining.html"])
    finished.rows(("x_retraining", "breath", "p1", "../data/first.c3d"))
    assert "may not end with _retraining" in read_plan({}).lost[0]


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["no-preference", "reduce"])
def test_steps_are_played_one_by_one_and_the_pace_is_told(browser, page, keep, motion):
    keep(page)
    opened = browser.new_page(viewport={"width": 390, "height": 844}, reduced_motion=motion)
    said, asked = [], []
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("request", lambda request: asked.append(request.url))
    opened.goto(page.absolute().as_uri())
    for _ in range(200):
        if opened.evaluate("Boolean(window.pleuraViewer && pleuraViewer.firstPicture)"):
            break
        opened.wait_for_timeout(50)
    seen = "pleuraViewer.figures.filter(f => f.group.visible).map(f => f.told.name)"
    assert opened.evaluate(seen) == ["step 1"]
    assert opened.evaluate("pleuraViewer.clock.duration") == pytest.approx(4.0)
    opened.get_by_label("my own breath beside it").check()
    assert opened.evaluate(seen) == ["own breath", "step 1"]
    # the own breath is shown at the pace of the step: both begin and end together
    opened.evaluate("pleuraViewer.seek(2.0); pleuraViewer.draw()")
    shares = opened.evaluate(
        "pleuraViewer.figures.map(f => f.pose.time[f.pose.frame] / f.pose.duration)"
    )
    assert shares[0] == pytest.approx(shares[1], abs=0.03)
    opened.get_by_role("button", name="Show own breath").click()
    assert opened.evaluate(seen) == ["own breath"]
    assert opened.evaluate("pleuraViewer.clock.duration") == pytest.approx(2.0)
    assert (
        opened.locator("#pace .pace").inner_text() == "30.0 breaths a minute: 0.8 s in, 1.2 s out"
    )
    opened.get_by_role("button", name="Breathe with me").click()
    radius = "Number(document.querySelector('#pace .lung').getAttribute('r'))"
    radii, words = set(), set()
    for _ in range(30):
        radii.add(round(opened.evaluate(radius), 1))
        words.add(opened.locator("#pace [role=status]").text_content())
        opened.wait_for_timeout(80)
    assert (len(radii) > 3) == (motion == "no-preference")
    assert {"Breathe in, 1 second", "Breathe out, 1 second"} <= words
    opened.get_by_role("button", name="Stop").click()
    assert not opened.evaluate("pleuraViewer.clock.playing")
    assert opened.evaluate("document.documentElement.scrollWidth") <= 390
    assert said == [] and asked == [page.absolute().as_uri()]
