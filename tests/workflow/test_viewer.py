"""The 3D viewer in a real browser: it draws, moves, fits, and asks for nothing."""

from __future__ import annotations

import io
import shutil
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import soundfile

from pipeline.draw.fit import volume_svg
from pipeline.export import export
from pipeline.headline import Headline
from pipeline.report import write_report
from pipeline.view import MOST_BYTES, SCRIPT, data_address, make_viewer, write_view
from sim.motion import skin_surface
from sim.trajectory import save_motion

pytestmark = pytest.mark.slow

WIDE, PHONE = {"width": 1280, "height": 720}, {"width": 390, "height": 844}
READY = "window.pleuraViewer && window.pleuraViewer.firstPicture"
# Reading pixels back stalls the drawing; the driver says so, and only tests do it.
DRIVER = "GL Driver Message"


@pytest.fixture(scope="module")
def view_page(small_motion, tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    save_motion(folder / "small.h5", small_motion, {"style": "calm", "posture": "upright"})
    return write_view([folder / "small.h5"], folder / "small.html")


class Opened:
    """A page with what it asked for and what it said."""

    def __init__(self, browser, path, **options):
        self.address = path.absolute().as_uri()
        self.page = browser.new_page(**options)
        self.asked, self.said = [], []
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.goto(self.address)

    def ready(self):
        return self.until(READY)

    def until(self, condition, seconds=15.0):
        """Wait; the page's policy forbids the browser's own way of waiting for a text."""
        end = time.monotonic() + seconds
        while not self.run(f"Boolean({condition})"):
            assert time.monotonic() < end, condition
            self.page.wait_for_timeout(50)
        return self

    def run(self, script):
        return self.page.evaluate(script)

    def picture(self):
        """The canvas as it is seen, (height, width, 3) from 0 to 1."""
        self.run("pleuraViewer.draw()")
        shot = self.page.locator("#viewer canvas").screenshot()
        return matplotlib.image.imread(io.BytesIO(shot))[..., :3]

    def complaints(self):
        return [line for line in self.said if DRIVER not in line]


@pytest.fixture
def opened(browser, view_page):
    return Opened(browser, view_page, viewport=WIDE).ready()


def drawn(picture):
    """Share of the picture that is not its background."""
    return float((np.abs(picture - picture[2, 2]).max(axis=2) > 0.1).mean())


@pytest.mark.parametrize("viewport", [WIDE, PHONE], ids=["wide", "phone"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_torso_is_drawn_and_nothing_is_asked_for(browser, view_page, viewport, scheme):
    opened = Opened(browser, view_page, viewport=viewport, color_scheme=scheme).ready()
    assert 0.02 < drawn(opened.picture()) < 0.9
    assert opened.asked == [opened.address]
    assert opened.complaints() == []
    assert opened.run("document.documentElement.scrollWidth") <= viewport["width"]
    assert not opened.page.locator(".still").is_visible()


def test_from_outside_the_human_skin_is_seen_and_moves(browser, dressed_motion, tmp_path):
    save_motion(tmp_path / "dressed.h5", dressed_motion, {"style": "calm"})
    page = write_view([tmp_path / "dressed.h5"], tmp_path / "dressed.html")
    opened = Opened(browser, page, viewport=WIDE).ready()
    opened.page.get_by_role("button", name="Show outside").click()
    where = "Array.from(pleuraViewer.figures[0].skins[0][0].geometry.attributes.position.array)"
    first = opened.run(where)
    opened.run("pleuraViewer.seek(1.0)")
    opened.picture()
    later = opened.run(where)
    truth = skin_surface(dressed_motion).vertices
    away = np.reshape(later, (-1, 3)) - truth[np.argmin(np.abs(dressed_motion.time - 1.02))]
    assert np.linalg.norm(away, axis=1).max() < 5e-4
    assert np.abs(np.subtract(later, first)).max() > 1e-3
    assert "woman of 1.60 m, 60 kg and 30 years" in opened.page.content()
    assert opened.complaints() == []


def test_the_picture_and_its_bar_fit_a_small_screen(opened):
    opened.page.locator("#viewer").scroll_into_view_if_needed()
    box = opened.page.locator("#viewer").bounding_box()
    assert box["height"] < WIDE["height"]


def test_a_slider_takes_its_layer_away(opened):
    before = opened.picture()
    opened.page.locator("input[data-layer=bone]").fill("0")
    after = opened.picture()
    assert drawn(after) < drawn(before)
    opened.page.locator("input[data-layer=bone]").fill("100")
    assert np.allclose(opened.picture(), before, atol=0.02)


def test_what_is_see_through_shows_what_is_inside(opened):
    opened.run("pleuraViewer.rows.forEach(r => pleuraViewer.setOpacity(r.layer, 0))")
    opened.run("pleuraViewer.setOpacity('diaphragm', 1); pleuraViewer.look('front')")
    alone = opened.picture()
    opened.run("pleuraViewer.setOpacity('skin', 1)")
    hidden = opened.picture()
    opened.run("pleuraViewer.setOpacity('skin', 0.3)")
    veiled = opened.picture()
    middle = tuple(n // 2 for n in alone.shape[:2])
    assert np.abs(hidden[middle] - alone[middle]).max() > 0.1
    inside, outside = (np.abs(veiled[middle] - p[middle]).sum() for p in (alone, hidden))
    assert inside > 0.02 and outside > 0.02


@pytest.mark.parametrize("preset", ["outside", "skeleton", "muscles", "diaphragm at work"])
def test_presets_are_told_by_their_button(opened, preset):
    opened.page.get_by_role("button", name=f"Show {preset}").click()
    pressed = opened.page.locator(".choice[aria-pressed=true]")
    assert pressed.all_inner_texts() == [preset]
    assert drawn(opened.picture()) > 0.02


def test_time_moves_the_torso_as_the_trajectory_does(opened, small_motion):
    frame = 20
    at = float(small_motion.time[frame] - small_motion.time[0])
    opened.run(f"pleuraViewer.seek({at}); pleuraViewer.draw()")
    surface = opened.run(
        "pleuraViewer.figures[0].told.surfaces.findIndex(s => s.layer === 'diaphragm')"
    )
    seen = opened.run(
        "((mesh, index) => Array.from(index).flatMap(i => Array.from(mesh.pose.points"
        ".subarray(3 * i, 3 * i + 3))))(pleuraViewer.figures[0],"
        f" pleuraViewer.figures[0].soft[{surface}][1])"
    )
    right = small_motion.soft["diaphragm"].vertices[frame]
    assert np.linalg.norm(np.reshape(seen, (-1, 3)) - right, axis=1).max() < 3e-4
    matrix = np.reshape(
        opened.run("Array.from(pleuraViewer.figures[0].pose.matrices[2].elements)"), (4, 4)
    ).T
    assert np.allclose(matrix[:3, 3], small_motion.position[frame, 2], atol=1e-4)


def test_play_step_and_the_bar_of_time(opened):
    page = opened.page
    page.get_by_role("button", name="Play").click()
    opened.until("pleuraViewer.clock.time > 0.3")
    page.get_by_role("button", name="Pause").click()
    stopped = opened.run("pleuraViewer.clock.time")
    page.get_by_role("button", name="One frame on (→)").click()
    step = opened.run("pleuraViewer.clock.time") - stopped
    assert 0 < step <= 0.0401
    page.get_by_role("slider", name="Time").fill("1.0")
    assert opened.run("pleuraViewer.clock.time") == pytest.approx(1.0)
    opened.until("document.querySelector('.told').textContent.startsWith('1.02 s')")


def test_without_loop_it_stops_at_the_end(opened):
    opened.page.get_by_label("loop").uncheck()
    opened.run("pleuraViewer.seek(1.9); pleuraViewer.clock.play()")
    opened.until("!pleuraViewer.clock.playing")
    assert opened.run("pleuraViewer.clock.time === pleuraViewer.clock.duration")


def test_keys_work_when_the_picture_has_the_focus(opened):
    opened.page.locator("#viewer canvas").focus()
    opened.page.keyboard.press("ArrowRight")
    assert opened.run("pleuraViewer.clock.time") == pytest.approx(0.04, abs=1e-3)
    front = opened.picture()
    opened.page.keyboard.press("3")
    assert opened.run("pleuraViewer.camera") == "back"
    assert np.abs(opened.picture() - front).max() > 0.1
    opened.page.keyboard.press("Space")
    assert opened.run("pleuraViewer.clock.playing")


def test_error_vectors_are_those_of_the_trajectory(opened, small_motion):
    away = small_motion.measured - small_motion.markers
    away = np.linalg.norm(away - away.mean(axis=0), axis=-1).mean(axis=1) * 1e3
    for frame in (5, 30):
        at = float(small_motion.time[frame] - small_motion.time[0])
        opened.run(f"pleuraViewer.seek({at}); pleuraViewer.draw()")
        assert opened.run("pleuraViewer.figures[0].error()") == pytest.approx(away[frame], abs=0.01)


def test_without_webgl_there_is_a_picture_and_a_sentence(view_page):
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or pytest.skip("no chromium: apt-get install chromium")
    with sync_playwright() as playwright:
        flags = ["--no-sandbox", "--disable-gpu", "--disable-3d-apis", "--no-first-run"]
        browser = playwright.chromium.launch(executable_path=chromium, args=flags)
        opened = Opened(browser, view_page, viewport=WIDE)
        assert opened.page.locator("#no-webgl").is_visible()
        assert opened.page.locator(".still img").is_visible()
        size = opened.run("document.querySelector('.still img').naturalWidth")
        assert size > 300
        browser.close()


@pytest.fixture
def report(finished, small_motion):
    good = Path("results") / "good"
    save_motion(good / "trajectory.h5", small_motion, {"recording": "good"})
    volume = small_motion.volumes["lung"]
    drawing = volume_svg(time=small_motion.time, volume=volume, turn=1.0)
    (good / "volume.svg").write_text(drawing, encoding="utf-8")
    return write_report(good, Path("reports") / "good.html")


def test_plots_of_a_report_share_the_cursor(browser, report):
    opened = Opened(browser, report, viewport=WIDE).ready()
    assert opened.asked == [opened.address]
    opened.run("pleuraViewer.seek(1.0); pleuraViewer.draw()")
    place = "(([[l, t, w, h, a, b]]) => l + w * (1.02 - a) / (b - a))"
    told = "JSON.parse(document.querySelector('svg[data-time-axes]').dataset.timeAxes)"
    line = opened.page.locator("line.time-cursor")
    assert float(line.get_attribute("x1")) == pytest.approx(opened.run(f"{place}({told})"), abs=0.1)
    plot = opened.page.locator("svg[data-time-axes]")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    opened.page.mouse.click(box["x"] + 0.3 * box["width"], box["y"] + 0.5 * box["height"])
    assert opened.run("pleuraViewer.clock.time") != pytest.approx(1.0, abs=0.01)
    assert opened.complaints() == []
    assert report.stat().st_size < MOST_BYTES


def test_two_runs_stand_side_by_side_by_name_on_one_clock(browser, small_motion, tmp_path):
    short = replace(small_motion.frames(0, 30), measured=None, elements=None)
    for name, motion in (("one", small_motion), ("two", short)):
        save_motion(tmp_path / f"{name}.h5", motion, {"style": name})
    out = write_view([tmp_path / "one.h5", tmp_path / "two.h5"], tmp_path / "both.html")
    opened = Opened(browser, out, viewport=WIDE).ready()
    opened.run("pleuraViewer.look('front')")
    picture = opened.picture()
    half = picture.shape[1] // 2
    assert drawn(picture[:, :half]) > 0.02 and drawn(picture[:, half:]) > 0.02
    assert opened.page.locator("#viewer .titles span").all_inner_texts() == ["one", "two"]
    opened.run("pleuraViewer.seek(1.0); pleuraViewer.draw()")
    shown = "pleuraViewer.figures.map(f => f.pose.time[f.pose.frame] + f.pose.share * 0.04)"
    assert opened.run(shown) == pytest.approx([1.0, 1.0], abs=1e-3)
    assert opened.page.locator("#viewer .track path").count() == 2
    assert opened.complaints() == []


def test_a_sound_leads_the_clock(browser, small_motion, tmp_path):
    from pipeline import page

    stream = io.BytesIO()
    tone = 0.1 * np.sin(2 * np.pi * 220 * np.arange(16000) / 8000)
    soundfile.write(stream, tone, 8000, format="WAV")
    sound = data_address(stream.getvalue(), "audio/wav")
    viewer = make_viewer({"laugh": small_motion}, place="l.h5", sound=sound, loop=False)
    head = Headline(kind="Run", title="laugh")
    text = page.render(
        "view.html", head=head, viewer=viewer, about_columns=[], about=[], citations=[]
    )
    (tmp_path / "laugh.html").write_text(text, encoding="utf-8")
    opened = Opened(browser, tmp_path / "laugh.html", viewport=WIDE).ready()
    frame = 0.04
    # the moment that is shown less the one that is heard
    shown = "p.time[p.frame] + p.share * (p.time[p.next] - p.time[p.frame])"
    apart = f"(p => {shown})(v.figures[0].pose) - v.clock.sound.currentTime"
    # a sound may begin after a click only
    opened.page.get_by_role("button", name="Play").click()
    opened.run("pleuraViewer.toggle()")
    for at in (0.2, 0.7, 1.2):
        opened.run(f"pleuraViewer.seek({at}); pleuraViewer.toggle()")
        opened.until(f"pleuraViewer.clock.time > {at + 0.1}")
        playing = opened.run(
            f"(v => {{ v.clock.advance(1); v.move(); return {apart}; }})(pleuraViewer)"
        )
        assert abs(playing) < frame
        opened.run("pleuraViewer.toggle()")
        opened.until("!pleuraViewer.moved && !pleuraViewer.clock.sound.seeking")
        assert abs(opened.run(f"(v => {apart})(pleuraViewer)")) < frame
    assert opened.complaints() == []


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    """A folder with the viewer's source and its tools."""
    if not shutil.which("npm"):
        pytest.skip("no npm")
    folder = tmp_path_factory.mktemp("node") / "viewer"
    shutil.copytree(SCRIPT.parent, folder, ignore=shutil.ignore_patterns("node_modules"))
    done = subprocess.run(
        ["npm", "ci", "--no-audit", "--no-fund"], cwd=folder, capture_output=True, check=False
    )
    if done.returncode:
        pytest.skip("npm reaches no packages")
    return folder


def test_the_bundle_is_what_its_source_makes(node):
    (node / SCRIPT.name).unlink()
    subprocess.run(["npm", "run", "build"], cwd=node, capture_output=True, check=True)
    assert (node / SCRIPT.name).read_bytes() == SCRIPT.read_bytes()


def test_the_validator_finds_nothing_wrong_with_a_glb(node, small_motion, tmp_path):
    save_motion(tmp_path / "small.h5", small_motion, {"style": "calm"})
    export(tmp_path / "small.h5", tmp_path / "small.glb")
    script = (
        "import validator from 'gltf-validator'; import { readFileSync } from 'fs';"
        "const told = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[1])));"
        "console.log(told.issues.numErrors, told.issues.numWarnings);"
    )
    done = subprocess.run(
        ["node", "--input-type=module", "-e", script, str(tmp_path / "small.glb")],
        cwd=node,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["0", "0"]
