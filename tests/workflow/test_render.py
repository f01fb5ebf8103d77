"""Films and pictures as a person asks for them, drawn with the GL library that is there."""

from __future__ import annotations

from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest
import soundfile

from pipeline.__main__ import main
from pipeline.render.camera import look
from pipeline.render.parts import parts
from pipeline.render.pose import Poses
from sim.errors import InputError
from sim.trajectory import save_motion

av = pytest.importorskip("av", reason="no PyAV: pip install '.[render]'")
pytest.importorskip("moderngl", reason="no moderngl: pip install '.[render]'")

pytestmark = pytest.mark.slow
FRAMED = 25
"""Moments at which the camera looks, as in `pipeline/render/write.py`."""


@pytest.fixture(scope="module", autouse=True)
def gl():
    from pipeline.render.graphics import context

    try:
        context().release()
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def run(small_motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("render") / "small.h5"
    save_motion(path, small_motion, {"style": "calm"})
    return path


def render(run, out, *flags):
    assert main(["render", str(run), "--to", str(out), *flags]) == 0
    return out


def dots(path):
    return np.round(255 * matplotlib.image.imread(path)).astype(int)


def film_of(path):
    with av.open(str(path)) as film:
        pictures = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(video=0)]
        video = film.streams.video[0]
        lasts = {s.type: float(s.duration * s.time_base) for s in film.streams}
        return pictures, float(video.average_rate), lasts


def drawn(picture):
    """Share of a picture that is not like its corner."""
    return float((np.abs(picture[..., :3] - picture[2, 2, :3]).max(axis=2) > 30).mean())


def test_a_film_has_its_size_length_sound_and_motion(run, tmp_path):
    tone = 0.3 * np.sin(2 * np.pi * 330 * np.arange(12000) / 8000)
    soundfile.write(tmp_path / "tone.wav", tone, 8000)
    flags = ("--size", "320x240", "--fps", "12.5", "--sound", str(tmp_path / "tone.wav"))
    out = render(run, tmp_path / "f.mp4", "--from-s", "0.1", "--until-s", "1.3", *flags)
    pictures, rate, lasts = film_of(out)
    assert len(pictures) == 15 and rate == 12.5
    assert {picture.shape for picture in pictures} == {(240, 320, 3)}
    assert lasts["video"] == pytest.approx(1.2) and lasts["audio"] == pytest.approx(1.2, abs=0.03)
    assert all(0.02 < drawn(picture) < 0.9 for picture in pictures)
    assert np.abs(pictures[0] - pictures[-1]).max() > 60
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def spot(picture):
    """Middle of what is drawn, pixels from the left and from the top."""
    rows, columns = np.nonzero(picture[..., :3].max(axis=2) > 10)
    assert len(rows) > 10
    return np.array([columns.mean() + 0.5, rows.mean() + 0.5])


def test_a_marker_moves_in_the_picture_as_it_does_in_the_run(tmp_path, small_motion):
    """A ball alone on black: its middle is where the camera's own formula puts the marker."""
    alone = replace(
        small_motion, marker_names=("STRN",), markers=small_motion.markers[:, :1], measured=None
    )
    path = tmp_path / "one.h5"
    save_motion(path, alone, {"style": "calm"})
    poses, source = Poses(alone), parts(alone, {"markers": 1.0})[0].source
    flags = ("--layers", "markers", "--view", "front", "--size", "400x300", "--pictures", "1")
    frames, seen = (0, 12, 25), []
    for frame in frames:
        at = ("--times-s", str(alone.time[frame]), "--background", "#000000")
        seen.append(spot(dots(render(path, tmp_path / "one.png", *flags, *at))))
    some = np.linspace(0, 50, FRAMED).astype(int)
    drawn_at = [source.at(poses.at(float(alone.time[k]))).places for k in some]
    eye = look("front", np.concatenate(drawn_at), 400 / 300)
    told = eye.pixels(alone.markers[list(frames), 0], (400, 300))
    assert np.abs(np.array(seen) - told).max() < 1.0
    # in the run it rises, and so in the picture
    assert alone.markers[25, 0, 2] - alone.markers[0, 0, 2] > 0.01
    assert seen[0][1] - seen[2][1] > 100


def test_a_strip_has_its_pictures_side_by_side(run, tmp_path):
    out = render(run, tmp_path / "s.png", "--pictures", "3", "--size", "120x160")
    strip = dots(out)
    assert strip.shape == (160, 360, 3)
    panels = np.split(strip, 3, axis=1)
    assert all(0.02 < drawn(panel) < 0.9 for panel in panels)
    assert np.abs(panels[0] - panels[1])[:140].max() > 60


def test_numbered_pictures_see_through_where_nothing_is(run, tmp_path):
    flags = ("--background", "transparent", "--until-s", "0.12", "--size", "160x120")
    out = render(run, tmp_path / "frames", *flags)
    assert sorted(path.name for path in out.iterdir()) == ["00000.png", "00001.png", "00002.png"]
    picture = dots(out / "00000.png")
    assert picture.shape == (120, 160, 4)
    assert picture[2, 2, 3] == 0 and picture[..., 3].max() == 255


def test_layers_presets_and_background_are_seen(run, tmp_path):
    size = ("--pictures", "1", "--size", "200x200", "--background", "#102030")
    shown = {}
    for name, flags in {
        "skeleton": ("--preset", "skeleton"),
        "outside": ("--preset", "outside"),
        "muscles": ("--preset", "muscles"),
        "diaphragm": ("--preset", "diaphragm"),
        "veil": ("--layers", "bone,skin=0.3"),
        "bone": ("--layers", "bone"),
    }.items():
        shown[name] = dots(render(run, tmp_path / f"{name}.png", *flags, *size))
        assert shown[name][2, 2] == pytest.approx([16, 32, 48], abs=1)
        assert drawn(shown[name]) > 0.02
    assert drawn(shown["veil"]) > drawn(shown["bone"])
    pairs = [("skeleton", "outside"), ("outside", "muscles"), ("muscles", "diaphragm")]
    assert all(np.abs(shown[a] - shown[b]).max() > 30 for a, b in pairs)


def test_bones_are_lit_and_not_flat(run, tmp_path):
    flags = ("--layers", "bone", "--size", "300x300", "--background", "#000000")
    bone = dots(render(run, tmp_path / "b.png", *flags, "--pictures", "1"))
    light = bone.max(axis=2)[bone.max(axis=2) > 20]
    dark, bright = np.percentile(light, [2, 98])
    assert bright - dark > 60 and bright < 255


def test_chromium_plays_the_film(run, tmp_path, browser):
    out = render(run, tmp_path / "f.mp4", "--size", "320x240", "--until-s", "1.02")
    page = browser.new_page()
    (tmp_path / "f.html").write_text(f"<video src='{out.name}' muted></video>", encoding="utf-8")
    page.goto((tmp_path / "f.html").as_uri())
    told = page.evaluate(
        "async () => { const v = document.querySelector('video'); await v.play(); v.pause();"
        " return [v.videoWidth, v.videoHeight, v.duration]; }"
    )
    assert told[:2] == [320, 240] and told[2] == pytest.approx(1.0, abs=0.02)
    shot = tmp_path / "video.png"
    page.locator("video").screenshot(path=shot)
    assert drawn(dots(shot)) > 0.02
