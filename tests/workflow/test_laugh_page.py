"""The page of a laugh from its sound alone, by one command, in a real browser."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest
from playwright.sync_api import sync_playwright

pytestmark = pytest.mark.slow

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
PLACES = """async (seconds) => {
  const sound = document.querySelector("audio");
  if (sound.readyState === 0) await new Promise((go) => { sound.onloadedmetadata = go; });
  sound.currentTime = seconds;
  await new Promise((go) => { sound.onseeked = go; setTimeout(go, 1000); });
  await new Promise((go) => setTimeout(go, 200));
  const heads = [...document.querySelectorAll(".playhead")];
  return [sound.duration, ...heads.map((head) => parseFloat(head.style.left))];
}"""


@pytest.fixture
def laughing(study, data_samples):
    shutil.copy(data_samples / "laugh1.flac", study.folder / "data" / "ha.flac")
    study.rows(("ha", "laugh", "p1", "../data/ha.flac"))
    config = study.folder / "config" / "config.yaml"
    config.write_text(config.read_text(encoding="utf-8") + LIGHT, encoding="utf-8")
    return study


def test_one_command_from_sound_to_page(laughing) -> None:
    run = laughing.run("snakemake", "reports/ha.html", timeout=600)
    assert run.returncode == 0, run.stdout + run.stderr
    results = laughing.folder / "results" / "ha"
    rows = pd.read_csv(results / "calls.csv").query("kept == 'yes'")
    assert (rows["evaluations"] > 0).all() and rows["rms_normalised"].notna().all()
    for name in ("control.xml", "trajectory.h5", "followed.csv", "follow.json"):
        assert (results / name).stat().st_size > 0
    again = laughing.run("snakemake", "reports/ha.html", timeout=120)
    assert "Nothing to be done" in again.stdout + again.stderr
    _check_page(laughing.folder / "reports" / "ha.html")


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
        early, late = page.evaluate(PLACES, 0.5), page.evaluate(PLACES, 1.5)
        browser.close()
    assert early[0] == pytest.approx(2.316, abs=0.01)
    assert len(early) == 4
    assert all(b > a + 50 for a, b in zip(early[1:], late[1:], strict=True))
    assert said == []
    assert all(url.startswith(("file:", "data:")) for url in asked)
