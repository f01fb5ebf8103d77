"""What is drawn, from where, and how it is asked for; no picture is drawn here."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import soundfile
from scipy.spatial.transform import Rotation

from pipeline import look
from pipeline.__main__ import main
from pipeline.render import camera, order, sound, write
from pipeline.render.parts import parts
from pipeline.render.pose import Poses
from pipeline.scene import layers
from sim.errors import InputError
from sim.motion import skin_surface
from sim.trajectory import save_motion

FIGURE = Path(look.__file__).parent / "viewer" / "src" / "figure.js"


@pytest.fixture(scope="module")
def poses(small_motion):
    return Poses(small_motion)


@pytest.fixture(scope="module")
def everything(small_motion):
    return {part.layer: part for part in parts(small_motion, {r["layer"]: 1.0 for r in layers()})}


@pytest.fixture(scope="module")
def run(small_motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("render") / "small.h5"
    save_motion(path, small_motion, {"style": "calm"})
    return path


def test_colours_and_sizes_are_those_of_the_page():
    source = FIGURE.read_text(encoding="utf-8")
    ramp = re.search(r"RAMP = \[(.*?)\]", source)[1]
    assert tuple(re.findall(r"#\w{6}", ramp)) == look.RAMP
    fibre = re.search(r"FIBRE = \[(.*?)\]", source)[1]
    assert tuple(float(x) for x in fibre.split(",")) == look.FIBRE
    assert f"MARKER = {look.MARKER}" in source
    assert look.SIMULATED in source


def test_a_moment_of_a_frame_is_that_frame(poses, small_motion):
    for frame in (0, 17, 50):
        moment = poses.at(float(small_motion.time[frame]))
        assert np.allclose(moment.position, small_motion.position[frame])
        turn = Rotation.from_quat(small_motion.quaternion[frame], scalar_first=True)
        assert np.allclose(moment.rotation, turn.as_matrix())
        assert np.allclose(moment.soft["skin"], small_motion.soft["skin"].vertices[frame])
        assert np.allclose(moment.markers, small_motion.markers[frame])


def test_between_frames_it_is_straight_and_outside_them_it_stands(poses, small_motion):
    time = small_motion.time
    moment = poses.at(float(time[10] + 0.25 * (time[11] - time[10])))
    a, b = (small_motion.soft["abdomen"].vertices[k] for k in (10, 11))
    assert np.allclose(moment.soft["abdomen"], 0.75 * a + 0.25 * b)
    for outside, frame in ((-5.0, 0), (99.0, -1)):
        stood = poses.at(outside)
        assert np.allclose(stood.soft["skin"], small_motion.soft["skin"].vertices[frame])


def test_a_run_of_one_frame_stands(small_motion):
    one = Poses(small_motion.frames(3, 4))
    assert np.allclose(one.at(0.0).markers, small_motion.markers[3])


def test_bones_and_surfaces_are_drawn_where_the_run_has_them(poses, everything, small_motion):
    time = float(small_motion.time[20])
    drawn = everything["bone"].source.at(poses.at(time)).places
    turn = Rotation.from_quat(small_motion.quaternion[20, 1], scalar_first=True)
    spine = turn.apply(small_motion.shapes["T1-T4"].vertices) + small_motion.position[20, 1]
    assert np.allclose(drawn[len(small_motion.shapes["pelvis"].vertices) :], spine)
    skin = everything["skin"].source.at(poses.at(time)).places
    assert np.allclose(skin, small_motion.soft["skin"].vertices[20])


@pytest.mark.parametrize("layer", ["bone", "skin", "muscles", "markers"])
def test_faces_and_normals_turn_outward(poses, everything, layer):
    source = everything[layer].source
    made = source.at(poses.at(0.5))
    a, b, c = (made.places[source.faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    near = made.normals[source.faces].mean(axis=1)
    assert ((flat * near).sum(axis=1) > 0).mean() > 0.99
    assert np.allclose(np.linalg.norm(made.normals, axis=1), 1.0)
    assert source.faces.max() < len(made.places)


def test_muscles_grow_and_brighten_with_tension(poses, everything, small_motion):
    source = everything["muscles"].source
    slack, tight = (source.at(poses.at(float(small_motion.time[k]))) for k in (0, 25))
    ends = small_motion.elements.endpoints
    for made, frame, width in ((slack, 0, look.FIBRE[0]), (tight, 25, look.FIBRE[1])):
        ring = made.places[:8]
        assert np.allclose(ring.mean(axis=0), ends[frame, 0, 0])
        assert np.allclose(2 * np.linalg.norm(ring - ring.mean(axis=0), axis=1), width)
    assert np.allclose(slack.colours[0], look.linear(look.RAMP[0]))
    assert np.allclose(tight.colours[0], look.linear(look.RAMP[-1]), atol=1e-3)


@pytest.mark.parametrize("view", list(camera.VIEWS))
@pytest.mark.parametrize("foot", [0.0, 0.1])
def test_everything_is_in_the_picture_and_fills_it(view, foot):
    points = np.random.default_rng(1).normal(size=(300, 3)) * [0.1, 0.15, 0.3] + [0.0, 0.0, 1.0]
    for size in ((1280, 720), (420, 720)):
        seen = camera.look(view, points, size[0] / size[1], foot).pixels(points, size)
        share = np.ptp(seen, axis=0) / size
        assert (seen > 0).all() and (seen < size).all()
        assert (seen[:, 1] < (1 - foot) * size[1]).all()
        assert (share / [1.0, 1.0 - foot]).max() > 0.8


def test_left_is_right_from_the_front_and_up_is_up():
    points = np.array([[0.0, 0.2, 1.0], [0.0, -0.2, 1.0], [0.0, 0.0, 1.4]])
    left, right, top = camera.look("front", points, 1.0).pixels(points, (100, 100))
    assert left[0] > 50 > right[0] and top[1] < left[1]


@pytest.mark.parametrize(
    ("flags", "says"),
    [
        (["--to", "x.gif"], "x.gif: unknown ending. Use .mp4, .png"),
        (["--preset", "inside"], "--preset inside: there is none. Use one of outside, skeleton"),
        (["--layers", "bone,spleen"], "--layers spleen: there is none. Use bone, "),
        (["--layers", "bone=7"], "--layers bone=7: opacity is from 0 to 1"),
        (["--layers", "bone=0"], "--layers bone=0: nothing is shown"),
        (["--layers", "bone", "--preset", "skeleton"], "Give one of them."),
        (["--view", "below"], "--view below: there is none. Use one of three-quarter, front"),
        (["--size", "big"], "--size big: is not a size"),
        (["--size", "101x100"], "a film's sizes are even. Use 102x100."),
        (["--size", "99999x100"], "is not a size"),
        (["--background", "pink"], "--background pink: use a colour"),
        (["--background", "transparent"], "a film of this kind has no transparency"),
        (["--from-s", "1", "--until-s", "1"], "1 to 1 s is no time. There is 0.02 to 2.02 s."),
        (["--from-s", "3"], "3 to 2.02 s is not in the run"),
        (["--until-s", "nan"], "is not in the run"),
        (["--fps", "0"], "--fps 0: use 1 to 240"),
        (["--times-s", "0.1"], "--times-s means nothing for a film"),
        (["--sound-start-s", "1"], "--sound-start-s without --sound"),
        (["--sound", "gone.wav"], "gone.wav: there is no such file"),
        (["--to", "x.png", "--sound", "a.wav"], "--sound means nothing for a picture"),
        (["--to", "x.png", "--times-s", "0.1,9"], "9 s is not in the run"),
        (["--to", "x.png", "--times-s", "soon"], "use seconds as 0,0.5,1"),
        (["--to", "x.png", "--pictures", "0"], "--pictures 0: use 1 to 60"),
        (["--to", "here"], "here: is there already"),
    ],
)
def test_bad_words_are_one_line_and_write_nothing(run, monkeypatch, tmp_path, capsys, flags, says):
    pytest.importorskip("moderngl", reason="no moderngl: pip install '.[render]'")
    monkeypatch.chdir(tmp_path)
    Path("here").mkdir()
    to = [] if "--to" in flags else ["--to", "x.mp4"]
    assert main(["render", str(run), *to, *flags]) == 1
    told = capsys.readouterr().err
    assert says in told and told.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["here"]


def test_a_layer_that_the_run_has_not_is_told(small_motion):
    from dataclasses import replace

    bare = replace(small_motion, elements=None)
    with pytest.raises(InputError, match=r"muscles: the run has none\. It has bone"):
        order.chosen_opacity(order.Words(to=Path("x"), layers="muscles"), bare)


def test_without_a_gl_library_its_packages_are_named(run, monkeypatch, tmp_path, capsys):
    pytest.importorskip("moderngl", reason="no moderngl: pip install '.[render]'")
    # the library's own way of naming another one
    monkeypatch.setenv("GLCONTEXT_LINUX_LIBEGL", "libnone.so")
    out = tmp_path / "x.png"
    assert main(["render", str(run), "--to", str(out)]) == 1
    told = capsys.readouterr().err
    assert "apt-get install libegl1 libgl1 libgl1-mesa-dri" in told and told.count("\n") == 1
    assert not out.exists()


def test_without_its_libraries_the_extra_is_named(run, monkeypatch, capsys):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["render", str(run), "--to", "x.mp4"]) == 1
    told = capsys.readouterr().err
    assert "pip install -c requirements.lock '.[render]'" in told and told.count("\n") == 1


def test_a_preset_is_named_by_its_first_word():
    assert order.FIRST_PRESET in layers()[0]["presets"]


def test_a_sound_is_cut_to_the_film(tmp_path):
    samples = np.zeros((8000, 3))
    samples[4000] = 0.9
    soundfile.write(tmp_path / "s.wav", samples, 8000)
    track = sound.read_track(tmp_path / "s.wav", -0.25)
    assert track.samples.shape == (48000, 1)
    heard = track.cut(-0.5, 1.0)
    assert heard.shape == (72000, 1)
    assert abs(int(np.argmax(heard)) / sound.RATE - 0.75) < 1e-3
    assert np.array_equal(track.cut(5.0, 6.0), np.zeros((48000, 1)))
    (tmp_path / "follow.json").write_text(json.dumps({"control_starts_at_s": 0.4}))
    assert sound.followed_start(tmp_path / "trajectory.h5") == -0.4
    assert sound.followed_start(tmp_path / "other" / "trajectory.h5") == 0.0


@pytest.mark.parametrize("channels", [None, 1, 2])
def test_a_film_has_the_pictures_and_the_sound_it_was_given(tmp_path, channels):
    av = pytest.importorskip("av", reason="no PyAV: pip install '.[render]'")
    from pipeline.render.film import write_film

    colours = [(200, 30, 30), (30, 160, 60), (40, 60, 190)] * 5
    pictures = [np.full((64, 96, 4), (*c, 255), dtype=np.uint8) for c in colours]
    heard = None
    if channels:
        tone = 0.5 * np.sin(2 * np.pi * 440 * np.arange(36000) / 48000)
        heard = np.tile(tone[:, None], (1, channels)).astype(np.float32)
    path = tmp_path / "f.mp4"
    write_film(path, iter(pictures), size=(96, 64), fps=20.0, sound=heard)
    with av.open(str(path)) as film:
        seen = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        assert len(film.streams.audio) == (channels is not None)
        video = film.streams.video[0]
        assert float(video.duration * video.time_base) == pytest.approx(0.75)
    assert len(seen) == 15
    for picture, colour in zip(seen, colours, strict=True):
        assert np.abs(picture[32, 48].astype(int) - colour).max() < 8
    if channels:
        with av.open(str(path)) as film:
            got = np.concatenate([f.to_ndarray() for f in film.decode(audio=0)], axis=1)
        assert got.shape[0] == channels
        assert got.shape[1] / 48000 == pytest.approx(0.75, abs=0.03)
        assert np.sqrt((got**2).mean()) == pytest.approx(0.5 / np.sqrt(2), rel=0.05)


def test_a_film_draws_the_human_skin(dressed_motion, tmp_path, monkeypatch, capsys):
    path = tmp_path / "dressed.h5"
    save_motion(path, dressed_motion, {"style": "calm"})
    drawn = []
    monkeypatch.setitem(
        write.WRITERS, "", lambda trajectory, motion, words: drawn.append(motion) or "drawn"
    )
    assert main(["render", str(path), "--to", str(tmp_path / "frames")]) == 0
    human = skin_surface(dressed_motion)
    assert np.allclose(drawn[0].soft["skin"].vertices, human.vertices, atol=1e-6)
    assert not np.allclose(human.vertices, dressed_motion.soft["skin"].vertices, atol=0.01)
