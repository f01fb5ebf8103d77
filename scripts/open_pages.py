"""Open built pages in a browser and keep pictures: `python scripts/open_pages.py PAGES OUT`.

Each page of the folder is opened from disk in headless Chromium, on a wide screen, light and dark,
and on a phone. Exit code 1 if one is too large, says something on the console, asks for anything,
scrolls sideways, or if its torso is not drawn, does not follow slider and button, or is apart from
its sound.
"""

from __future__ import annotations

import argparse
import io
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from pipeline.view import MOST_BYTES

FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
WIDE, PHONE = {"width": 1280, "height": 720}, {"width": 390, "height": 844}
LOOKS: dict[str, dict[str, Any]] = {
    "light": {"viewport": WIDE, "color_scheme": "light"},
    "dark": {"viewport": WIDE, "color_scheme": "dark"},
    "phone": {"viewport": PHONE, "color_scheme": "light"},
}
DRIVER = "GL Driver Message"
"""Reading pixels back stalls the drawing; the driver says so, and only tests do it."""
INSIDE = ("data:", "blob:")
"""Addresses of what a page holds itself."""
WAITS, STEP_MS = 300, 50
DRAWN = 0.01
"""Least share of the canvas that is not its background."""
FRAME = 0.04
"""s that sound and motion may be apart by."""
APART = """async (seconds) => {
  const sound = document.getElementById("scene-sound"), v = window.pleuraViewer;
  if (sound.readyState === 0) await new Promise((go) => { sound.onloadedmetadata = go; });
  sound.currentTime = seconds * Math.min(sound.duration, v.clock.duration);
  await new Promise((go) => { sound.onseeked = go; setTimeout(go, 1000); });
  await new Promise((go) => setTimeout(go, 200));
  v.move();
  const { told, pose } = v.figures[0], last = pose.time[pose.time.length - 1];
  const shown = pose.time[pose.frame] + pose.share * (pose.time[pose.next] - pose.time[pose.frame]);
  return shown - Math.min(Math.max(sound.currentTime - told.delay, 0), last);
}"""


def _canvas(page: Page) -> Any:
    """The torso as it is seen, (height, width, 3) from 0 to 1."""
    page.evaluate("pleuraViewer.draw()")
    shot = page.locator("#viewer canvas").screenshot()
    return matplotlib.image.imread(io.BytesIO(shot))[..., :3]


def _torso_wrongs(page: Page) -> Iterator[str]:
    """What is wrong with a page's torso: picture, slider, button, sound."""
    before = _canvas(page)
    drawn = float((np.abs(before - before[2, 2]).max(axis=2) > 0.1).mean())
    if drawn < DRAWN:
        yield f"{100 * drawn:.1f} % of the canvas is drawn"
    slider = page.locator("input[data-layer=bone]")
    much = slider.input_value()
    slider.fill("0" if float(much) else "100")
    if np.abs(_canvas(page) - before).max() < 0.1:
        yield "a slider changes nothing"
    slider.fill(much)
    page.get_by_role("button", name="Play", exact=True).first.click()
    for _ in range(WAITS):
        page.wait_for_timeout(STEP_MS)
        if page.evaluate("pleuraViewer.clock.time > 0.2"):
            break
    else:
        yield "it does not play"
    page.evaluate("pleuraViewer.clock.playing && pleuraViewer.toggle()")
    if page.locator("#scene-sound").count():
        for share in (0.2, 0.5, 0.8):
            apart = float(page.evaluate(APART, share))
            if abs(apart) > FRAME:
                yield f"sound and motion are {apart:.3f} s apart"


def _ready(page: Page) -> bool:
    """Wait for the torso; the page's policy forbids the browser's own way of waiting."""
    for _ in range(WAITS):
        if page.evaluate("Boolean(window.pleuraViewer && pleuraViewer.firstPicture)"):
            return True
        page.wait_for_timeout(STEP_MS)
    return False


def _shoot(page: Page, out: Path, name: str, look: str) -> None:
    page.evaluate("scrollTo(0, 0)")
    page.screenshot(path=out / f"{name}_{look}.png")
    if page.locator("#viewer canvas").count():
        page.evaluate(
            "document.querySelector('#viewer canvas').scrollIntoView({ block: 'center' })"
        )
        page.wait_for_timeout(4 * STEP_MS)
        page.screenshot(path=out / f"{name}_{look}_torso.png")
    if look == "light":
        page.screenshot(path=out / f"{name}_whole.png", full_page=True)


def _listen(page: Page) -> tuple[list[str], list[str]]:
    """What a page will have said and asked for."""
    said: list[str] = []
    asked: list[str] = []
    page.on("console", lambda line: said.append(line.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    return said, asked


def _wrongs(browser: Browser, path: Path, out: Path, look: str) -> Iterator[str]:
    """What is wrong with a page in one look."""
    address, settings = path.resolve().as_uri(), LOOKS[look]
    page = browser.new_page(**settings)
    said, asked = _listen(page)
    page.goto(address)
    torso = page.locator("#viewer").count() > 0
    if torso and not _ready(page):
        yield "no torso"
    if int(page.evaluate("document.documentElement.scrollWidth")) > settings["viewport"]["width"]:
        yield "scrolls sideways"
    _shoot(page, out, path.stem, look)
    if torso and look == "light":
        yield from _torso_wrongs(page)
    page.close()
    yield from (f"asks for {url}" for url in asked if not url.startswith((address, *INSIDE)))
    yield from (f"says {line}" for line in said if DRIVER not in line)


def open_page(browser: Browser, path: Path, out: Path) -> list[str]:
    """Open a page in every look, keep pictures of it, and return what is wrong with it.

    Parameters
    ----------
    out : folder of the pictures
    """
    size = path.stat().st_size
    wrongs = [f"{size / 1e6:.1f} MB"] if size > MOST_BYTES else []
    return wrongs + [
        f"{look}: {what}" for look in LOOKS for what in _wrongs(browser, path, out, look)
    ]


def main() -> int:
    """Open every page of a folder."""
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0] + ".")
    parser.add_argument("pages", type=Path, help="a folder of pages")
    parser.add_argument("out", type=Path, help="folder of the pictures")
    options = parser.parse_args()
    pages = sorted(options.pages.glob("*.html"))
    chromium = shutil.which("chromium")
    if not pages or chromium is None:
        print("no pages" if chromium else "no chromium: apt-get install chromium", file=sys.stderr)
        return 1
    options.out.mkdir(parents=True, exist_ok=True)
    bad = 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        for path in pages:
            wrongs = open_page(browser, path, options.out)
            bad += bool(wrongs)
            size = f"{path.name}, {path.stat().st_size / 1e6:.2f} MB"
            print(f"{size}: {'; '.join(wrongs) or 'good'}", flush=True)
        browser.close()
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
