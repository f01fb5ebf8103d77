from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.c3d import read_c3d
from pipeline.raw import cut
from sim.errors import InputError


def refused(path, *words):
    with pytest.raises(InputError) as caught:
        read_c3d(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    assert message.endswith(".")
    for word in words:
        assert word in message


def test_metres_whatever_the_unit(tmp_path, torso_tracks, write_c3d):
    labels, tracks = torso_tracks(duration=2.0)
    for unit, factor in (("mm", 1e3), ("cm", 1e2), ("m", 1.0)):
        raw = read_c3d(write_c3d(tmp_path / f"{unit}.c3d", labels, factor * tracks, unit=unit))
        assert raw.labels == tuple(labels)
        np.testing.assert_allclose(raw.positions, tracks, atol=1e-6)


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e3), ("m", 1.0), ("cm", 1e2)])
def test_absent_unit_is_inferred_and_said(tmp_path, torso_tracks, write_c3d, unit, factor):
    labels, tracks = torso_tracks(duration=1.0)
    raw = read_c3d(write_c3d(tmp_path / "a.c3d", labels, factor * tracks, unit=""))
    np.testing.assert_allclose(raw.positions, tracks, atol=1e-6)
    assert any(f"no unit is stated; {unit} inferred" in note for note in raw.notes)


def test_units_that_cannot_be(tmp_path, torso_tracks, write_c3d):
    labels, tracks = torso_tracks(duration=1.0)
    refused(write_c3d(tmp_path / "a.c3d", labels, tracks, unit="furlong"), "furlong", "mm")
    refused(write_c3d(tmp_path / "b.c3d", labels, 1e3 * tracks, unit="m"), "unit 'm'")
    refused(write_c3d(tmp_path / "c.c3d", labels, 1e6 * tracks, unit=""), "none is stated")


def test_every_sign_of_an_unseen_marker(tmp_path, torso_tracks, write_c3d):
    labels, tracks = torso_tracks(duration=1.0)
    residuals = np.zeros(tracks.shape[:2])
    tracks[10:20, 0] = np.nan
    tracks[30:40, 1] = 0.0
    residuals[50:60, 2] = -1.0
    raw = read_c3d(write_c3d(tmp_path / "a.c3d", labels, 1e3 * tracks, residuals=residuals))
    missing = np.isnan(raw.positions).all(axis=2)
    expected = np.zeros_like(missing)
    expected[10:20, 0] = expected[30:40, 1] = expected[50:60, 2] = True
    np.testing.assert_array_equal(missing, expected)


def test_prefixes_duplicates_and_points_that_are_no_markers(tmp_path, torso_tracks, write_c3d):
    _, tracks = torso_tracks(duration=1.0)
    labels = ["Ann:CLAV", "Ann:CLAV", "STRN", "*114", "LHipAngles", "C7"]
    chosen = 1e3 * tracks[:, [0, 1, 2, 3, 4, 8]]
    path = write_c3d(tmp_path / "a.c3d", labels, chosen, parameters={"ANGLES": ["LHipAngles"]})
    raw = read_c3d(path)
    assert raw.labels == ("CLAV", "CLAV#2", "STRN", "C7")
    assert any("CLAV occurs twice" in note for note in raw.notes)
    same = write_c3d(tmp_path / "b.c3d", ["CLAV", "CLAV", "C7"], chosen[:, [0, 0, 5]])
    assert read_c3d(same).labels == ("CLAV", "C7")


def test_vertical_axis_of_the_screen(tmp_path, torso_tracks, write_c3d):
    labels, tracks = torso_tracks(duration=1.0)
    path = write_c3d(
        tmp_path / "a.c3d",
        labels,
        1e3 * tracks,
        parameters={"X_SCREEN": ["+X"], "Y_SCREEN": ["+Y"]},
    )
    assert read_c3d(path).vertical == 1


def test_files_that_are_no_c3d(tmp_path, torso_tracks, write_c3d):
    refused(tmp_path / "none.c3d", "not found")
    empty = tmp_path / "empty.c3d"
    empty.write_bytes(b"")
    refused(empty, "empty")
    text = tmp_path / "text.c3d"
    text.write_text("Frame,CLAV X,CLAV Y,CLAV Z\n" + "1,2,3,4\n" * 200)
    refused(text, "not a C3D file")
    labels, tracks = torso_tracks(duration=2.0)
    whole = write_c3d(tmp_path / "whole.c3d", labels, 1e3 * tracks).read_bytes()
    for share in (0.001, 0.05, 0.3, 0.9):
        part = tmp_path / f"part{share}.c3d"
        part.write_bytes(whole[: int(share * len(whole))])
        refused(part)
    refused(tmp_path / "part0.9.c3d", "cut off", "of 200 frames")


def test_damaged_parameters(tmp_path, torso_tracks, write_c3d):
    """The library follows a wrong link or length out of its memory: stopped before."""
    labels, tracks = torso_tracks(duration=1.0)
    path = write_c3d(tmp_path / "a.c3d", labels, 1e3 * tracks)
    whole = path.read_bytes()
    at = whole.index(b"LABELS")
    for change in (-2, 6, 7, 8, 9, 10):
        part = bytearray(whole)
        part[at + change] = 120
        path.write_bytes(bytes(part))
        refused(path)


def test_no_rate_and_nothing_seen(tmp_path, torso_tracks, write_c3d):
    labels, tracks = torso_tracks(duration=1.0)
    refused(write_c3d(tmp_path / "a.c3d", labels, 1e3 * tracks, rate=0.0), "rate")
    refused(write_c3d(tmp_path / "b.c3d", labels, np.nan * tracks), "none is labelled and seen")


def test_window(tmp_path, torso_tracks, write_c3d):
    labels, tracks = torso_tracks(duration=10.0)
    raw = read_c3d(write_c3d(tmp_path / "a.c3d", labels, 1e3 * tracks))
    part = cut(raw, 2.0, 5.0)
    assert part.start == 2.0
    np.testing.assert_array_equal(part.positions, raw.positions[200:500])
    for start, end, word in (
        (-1.0, None, "start_s"),
        (11.0, None, "start_s"),
        (2.0, 11.0, "end_s"),
        (5.0, 4.0, "end_s"),
    ):
        with pytest.raises(InputError, match=word):
            cut(raw, start, end)


REAL = {
    "c3d_format/kineticstoolkit/kinematics_racing_static.c3d": (700, 35, 69.9),
    "c3d_format/kineticstoolkit/kinematics_tennis_serve.c3d": (1092, 39, 50.0),
    "c3d_format/pycgm/Sample_Static.c3d": (275, 111, 100.0),
    "chestvolume/derived/chestvolume_assumed100hz.c3d": (2309, 30, 100.0),
}


@pytest.mark.parametrize("file", REAL)
def test_real_files(data_real: Path, file):
    n_frames, n_markers, rate = REAL[file]
    raw = read_c3d(data_real / file)
    assert raw.positions.shape == (n_frames, n_markers, 3)
    assert raw.rate == pytest.approx(rate, abs=1e-5)
    assert not any(":" in label or label.startswith("*") for label in raw.labels)
    assert np.nanmax(np.abs(raw.positions)) < 10.0
