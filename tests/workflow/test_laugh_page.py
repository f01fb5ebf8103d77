"""The page of a laugh from its sound alone, by one command, in a real browser."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import soundfile
from playwright.sync_api import sync_playwright
from scipy import signal

from pipeline.view import MOST_BYTES

pytestmark = pytest.mark.slow

DRIVER = "GL Driver Message"
CHROMIUM = "/usr/bin/chromium"
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
LIGHT = "follow:\n  n_evaluations: 30\n  compared: []\n"
READY = "window.pleuraViewer && window.pleuraViewer.firstPicture"
PLACES = """async (seconds) => {
  const sound = document.querySelector("audio"), viewer = window.pleuraViewer;
  if (sound.readyState === 0) await new Promise((go) => { sound.onloadedmetadata = go; });
  sound.currentTime = seconds;
  await new Promise((go) => { sound.onseeked = go; setTimeout(go, 1000); });
  await new Promise((go) => setTimeout(go, 200));
  viewer.move();
  const lines = [...document.querySelectorAll("line.time-cursor")];
  const places = lines.map((line) => Number(line.getAttribute("x1")));
  return [sound.duration, viewer.clock.time, ...places];
}"""
# where the line has to be, from the file's time alone
WANTED = """(seconds) => [...document.querySelectorAll("svg[data-time-axes]")].flatMap(
  (svg) => JSON.parse(svg.dataset.timeAxes).map(([left, , width, , start, end]) => left + width
    * (Number(document.querySelector("audio").dataset.start) + seconds - start) / (end - start)))"""
CLICK = """() => {
  const svg = document.querySelector("svg[data-time-axes]"), box = svg.getBoundingClientRect();
  return [box.left + 0.5 * box.width, box.top + 0.25 * box.height];
}"""


@pytest.fixture
def laughing(study, data_samples):
    shutil.copy(data_samples / "laugh1.flac", study.folder / "data" / "ha.flac")
    study.rows(("ha", "laugh", "p1", "../data/ha.flac"))
    config = study.folder / "config" / "config.yaml"
    config.write_text(config.read_text(encoding="utf-8") + LIGHT, encoding="utf-8")
    return study


def test_one_command_from_sound_to_page(laughing, keep) -> None:
    run = laughing.run("snakemake", "reports/ha.html", timeout=600)
    assert run.returncode == 0, run.stdout + run.stderr
    results = laughing.folder / "results" / "ha"
    rows = pd.read_csv(results / "calls.csv").query("kept == 'yes'")
    assert (rows["evaluations"] > 0).all() and rows["rms_normalised"].notna().all()
    for name in ("control.xml", "trajectory.h5", "followed.csv", "follow.json"):
        assert (results / name).stat().st_size > 0
    again = laughing.run("snakemake", "reports/ha.html", timeout=120)
    assert "Nothing to be done" in again.stdout + again.stderr
    keep(laughing.folder / "reports" / "ha.html")
    _check_page(laughing.folder / "reports" / "ha.html")
    _check_film(laughing, results, keep)


def _check_film(laughing, results: Path, keep) -> None:
    """The torso and its sound in a film, the sound where the page has it."""
    out = laughing.folder / "ha.mp4"
    words = ("--sound", "data/ha.flac", "--from-s", "0.4", "--until-s", "1.2", "--size", "480x480")
    run = laughing.run("pleura", "render", str(results / "trajectory.h5"), "--to", str(out), *words)
    if "no GL library" in run.stderr or "not installed" in run.stderr:
        return
    assert run.returncode == 0, run.stderr
    heard = [f.to_ndarray() for f in _frames(out, "audio")]
    film = np.concatenate(heard, axis=1)[0]
    samples, rate = soundfile.read(laughing.folder / "data" / "ha.flac")
    starts = json.loads((results / "follow.json").read_text())["control_starts_at_s"]
    first = round((0.4 + starts) * rate)
    part = signal.resample(samples[first : first + round(0.8 * rate)], round(0.8 * 48000))
    lag = np.argmax(signal.correlate(film[: len(part)], part)) - len(part) + 1
    assert abs(lag) / 48000 < 0.005
    pictures = [f.to_ndarray(format="rgb24").astype(int) for f in _frames(out, "video")]
    assert len(pictures) == 24
    assert all(np.abs(picture - picture[2, 2]).max() > 60 for picture in pictures)
    assert np.abs(pictures[0] - pictures[12]).max() > 60
    keep(out, "films")


def _frames(path: Path, kind: str):
    import av

    with av.open(str(path)) as film:
        return list(film.decode(**{kind: 0}))


def _check_page(path: Path) -> None:
    if not shutil.which(CHROMIUM):
        pytest.skip("no chromium: apt-get install chromium")
    asked: list[str] = []
    said: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        page = browser.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda line: said.append(line.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(path.as_uri())
        while not page.evaluate(f"Boolean({READY})"):
            page.wait_for_timeout(50)
        found = {at: page.evaluate(PLACES, at) for at in (0.5, 1.0, 1.5)}
        wanted = {at: page.evaluate(WANTED, at) for at in found}
        page.locator("svg[data-time-axes]").first.scroll_into_view_if_needed()
        page.mouse.click(*page.evaluate(CLICK))
        clicked = page.evaluate(
            "[pleuraViewer.clock.time, document.querySelector('audio').currentTime]"
        )
        said = [line for line in said if DRIVER not in line]
        browser.close()
    for at, (duration, clock, *lines) in found.items():
        assert duration == pytest.approx(found[0.5][0]) and duration >= 2.316
        assert clock == pytest.approx(at, abs=0.01)
        assert len(lines) == 7
        assert lines == pytest.approx(wanted[at], abs=0.5)
    assert clicked[0] == pytest.approx(clicked[1], abs=0.01) and clicked[0] != pytest.approx(1.5)
    assert path.stat().st_size < MOST_BYTES
    assert said == []
    assert all(url.startswith(("file:", "data:")) for url in asked)
