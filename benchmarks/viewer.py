"""How fast a page with the 3D viewer is: `python benchmarks/viewer.py PAGE.html`.

Headless Chromium, drawing in software; times are `performance.now` in the page.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
from pathlib import Path

from playwright.sync_api import Page, ViewportSize, sync_playwright

FLAGS = ("--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking")
SIZE: ViewportSize = {"width": 1280, "height": 720}
LOADED_MS = 5000
UPDATES = """(v => { const told = []; for (let k = 0; k < 200; k++) {
  const began = performance.now();
  for (const figure of v.figures) figure.update(k * v.clock.duration / 200);
  told.push(performance.now() - began); } return told; })(pleuraViewer)"""
PICTURES = """(v => { const told = [], gl = v.stage.renderer.getContext(), dot = new Uint8Array(4);
  for (let k = 0; k < 20; k++) { const began = performance.now(); v.stage.render();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, dot); told.push(performance.now() - began);
  } return told; })(pleuraViewer)"""
PRESETS = ("outside", "skeleton", "muscles", "diaphragm at work")


def _row(name: str, times: list[float]) -> str:
    late = statistics.quantiles(times, n=20)[-1]
    return f"| {name} | {statistics.median(times):.1f} | {late:.1f} |"


def _measure(page: Page) -> None:
    print("| ms | median | 95 % |\n|---|---|---|")
    page.evaluate("pleuraViewer.rows.forEach(r => pleuraViewer.setOpacity(r.layer, 0.5))")
    page.evaluate(UPDATES)
    print(_row("pose, every layer shown", page.evaluate(UPDATES)))
    for preset in PRESETS:
        page.evaluate(f"pleuraViewer.preset('{preset}'); pleuraViewer.draw()")
        print(_row(f"picture, {preset}", page.evaluate(PICTURES)))


def main() -> None:
    """Print when pictures came first, then medians and what 95 % are under."""
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0] + ".")
    parser.add_argument("page", type=Path)
    parser.add_argument("--repeats", type=int, default=5, help="times the page is opened")
    options = parser.parse_args()
    address = options.page.resolve().as_uri()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=list(FLAGS)
        )
        first = []
        for _ in range(options.repeats):
            page = browser.new_page(viewport=SIZE)
            page.goto(address)
            page.wait_for_timeout(LOADED_MS)
            first.append(float(page.evaluate("pleuraViewer.firstPicture")))
            page.close()
        told = ", ".join(f"{t / 1e3:.1f}" for t in sorted(first))
        print(f"{options.page.stat().st_size / 1e6:.2f} MB; first picture after {told} s\n")
        page = browser.new_page(viewport=SIZE)
        page.goto(address)
        page.wait_for_timeout(LOADED_MS)
        _measure(page)
        browser.close()


if __name__ == "__main__":
    main()
