from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline import records
from pipeline.conditioning import decimate, fill_gaps, low_pass, noise_level
from pipeline.flicker import find_flicker, without_flicker
from pipeline.labels import canonical, choose_markers, read_map
from pipeline.markers import MarkerRecording, prepare, read_recording
from pipeline.raw import RawMarkers
from pipeline.trunk import leverage, trunk_motion
from sim.errors import InputError


def raw_of(labels, tracks, **changes):
    values = {
        "source": "made.c3d",
        "labels": tuple(labels),
        "positions": tracks,
        "rate": 100.0,
        "start": 0.0,
        "vertical": -1,
        "notes": (),
    }
    return RawMarkers(**(values | changes))


def refused(raw, settings, word, **changes):
    with pytest.raises(InputError, match=word) as caught:
        prepare(raw, settings, **({"name": "a", "posture": "upright", "mapping": None} | changes))
    assert "\n" not in str(caught.value)


def ready(raw, settings, **changes):
    return prepare(
        raw, settings, **({"name": "a", "posture": "upright", "mapping": None} | changes)
    )


def still(recording):
    """Mean distance from the mean pose, m."""
    positions = recording.positions
    return np.linalg.norm(positions - positions.mean(axis=0), axis=2).mean()


@pytest.mark.parametrize("turn", [(0, 0, 30), (0, 0, 200), (5, -12, 100)])
def test_body_axes_from_any_heading(torso_tracks, marker_settings, turn):
    labels, tracks = torso_tracks(duration=8.0, noise=0.0)
    moved = Rotation.from_euler("xyz", turn, degrees=True).apply(tracks.reshape(-1, 3)) + 3.0
    upright = ready(raw_of(labels, tracks), marker_settings).positions
    turned = ready(raw_of(labels, moved.reshape(tracks.shape)), marker_settings).positions
    np.testing.assert_allclose(turned, upright, atol=1e-6)
    place = upright.mean(axis=0)
    shape = tracks.mean(axis=(0,)) - tracks.mean(axis=(0, 1))
    # the nominal places only serve to find axes: a few degrees are their error
    assert np.abs(place - shape).max() < 0.025


def test_y_up(torso_tracks, marker_settings):
    labels, tracks = torso_tracks(duration=8.0, noise=0.0)
    # Z anterior, X left, Y up
    y_up = tracks[:, :, [1, 2, 0]]
    recording = ready(raw_of(labels, y_up), marker_settings)
    expected = ready(raw_of(labels, tracks), marker_settings)
    np.testing.assert_allclose(recording.positions, expected.positions, atol=1e-6)


def test_trunk_motion_is_removed(torso_tracks, marker_settings):
    labels, tracks = torso_tracks(noise=0.0)
    time = np.arange(len(tracks)) / 100.0
    angles = np.stack([3 * np.sin(time), 2 * np.sin(0.7 * time), 2 * np.cos(0.5 * time)], axis=1)
    sway = 0.02 * np.sin(np.outer(time, [0.9, 0.4, 0.6]))
    turned = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    moving = np.einsum("fij,fmj->fmi", turned, tracks) + sway[:, None]
    rest = ready(raw_of(labels, tracks), marker_settings)
    recording = ready(raw_of(labels, moving), marker_settings)
    assert still(recording) == pytest.approx(still(rest), rel=0.02)
    assert {recording.labels[i] for i in recording.back} == {"C7", "T10", "L1", "LBAK", "RBAK"}
    assert [recording.names[i] for i in recording.sagittal] == ["CLAV", "STRN", "XIPH", "NAVEL"]


def test_missing_back_markers_make_no_jump(torso_tracks):
    labels, tracks = torso_tracks(duration=4.0, noise=0.0)
    back = tracks[:, [labels.index(s) for s in ("C7", "T10", "L1", "LBAK", "RBAK")]].copy()
    back[100:200, 0] = np.nan
    placed = trunk_motion(back).remove(tracks)
    np.testing.assert_allclose(placed, tracks, atol=1e-6)


def test_leverage_of_a_small_cluster():
    square = np.array([[0, 1, 1], [0, -1, 1], [0, 1, -1], [0, -1, -1]], dtype=float)
    front = np.array([[0.2, 0, 0]])
    assert leverage(0.1 * square, front) < 1.0
    assert leverage(0.01 * square, front) > 5.0
    assert leverage(square[:2], front) == np.inf
    assert leverage(np.outer([1.0, 2.0, 3.0], [0, 0, 1.0]), front) == np.inf


def test_short_gaps_are_filled_and_long_ones_stay(torso_tracks, marker_settings):
    labels, tracks = torso_tracks(noise=0.0)
    holes = tracks.copy()
    holes[500:525, 1] = np.nan
    holes[900:1000, 3] = np.nan
    np.testing.assert_allclose(fill_gaps(holes, 30)[500:525, 1], tracks[500:525, 1], atol=1e-5)
    recording = ready(raw_of(labels, holes), marker_settings)
    missing = np.isnan(recording.positions).all(axis=2)
    assert missing.sum() == 100
    assert missing[900:1000, 3].all()
    assert not recording.measured[500:525, 1].any()
    assert any("NAVEL: no data from 9.00 to 10.00 s" in w for w in recording.quality["warnings"])


def test_hidden_markers(torso_tracks, marker_settings):
    labels, tracks = torso_tracks(duration=8.0)
    hidden = tracks.copy()
    hidden[:600, 2] = np.nan
    recording = ready(raw_of(labels, hidden), marker_settings)
    assert "XIPH" not in recording.labels
    hidden[:600] = np.nan
    refused(raw_of(labels, hidden), marker_settings, "hidden")


def test_a_thousand_hertz_and_ten(torso_tracks, marker_settings):
    labels, fast = torso_tracks(rate=1000.0, duration=8.0, noise=0.0)
    hum = 1e-3 * np.sin(2 * np.pi * 300.0 * np.arange(len(fast)) / 1000.0)
    recording = ready(raw_of(labels, fast + hum[:, None, None], rate=1000.0), marker_settings)
    assert recording.rate == 125.0
    clean = ready(raw_of(labels, fast, rate=1000.0), marker_settings)
    assert np.abs(recording.positions - clean.positions)[20:-20].max() < 2e-5
    labels, slow = torso_tracks(rate=10.0, duration=20.0)
    recording = ready(raw_of(labels, slow, rate=10.0), marker_settings)
    assert recording.rate == 10.0
    assert any("faster than 5 Hz cannot be seen" in w for w in recording.quality["warnings"])


def test_filters_keep_holes_and_ends():
    track = np.tile(np.linspace(5.0, 6.0, 1000)[:, None, None], (1, 2, 3))
    track[100:200, 0] = np.nan
    smooth = low_pass(track, 100.0, 5.0)
    np.testing.assert_array_equal(np.isnan(smooth), np.isnan(track))
    np.testing.assert_allclose(smooth[:, 1], track[:, 1], atol=2e-3)
    less = decimate(track, 8)
    assert np.isnan(less[13:25, 0]).all()
    np.testing.assert_allclose(less[:, 1], track[::8, 1], atol=5e-3)


def test_noise_is_estimated():
    rng = np.random.default_rng(0)
    time = np.arange(3000)[:, None, None] / 100.0
    tracks = 5e-3 * np.sin(time) + rng.normal(
        scale=[[[2e-4]], [[5e-4]]], size=(2, 3000, 3)
    ).swapaxes(0, 1)
    np.testing.assert_allclose(noise_level(tracks), [2e-4, 5e-4], rtol=0.05)


def test_flicker_is_found_and_repaired(torso_tracks, marker_settings):
    labels, tracks = torso_tracks(noise=5e-5)
    ghost = tracks.copy()
    for start, stop in ((500, 540), (560, 570), (1200, 1250)):
        ghost[start:stop, 1] += [0.001, 0.002, 0.0]
    found = find_flicker(ghost, 100.0, marker_settings.flicker_m)
    assert list(found) == [1]
    assert np.isnan(without_flicker(ghost, found)[502:538, 1]).all()
    recording = ready(raw_of(labels, ghost), marker_settings)
    clean = ready(raw_of(labels, tracks), marker_settings)
    assert np.abs(recording.positions - clean.positions)[:, 1].max() < 4e-4
    assert recording.quality["flicker"]["STRN"]["jumps"] == 6
    assert find_flicker(tracks, 100.0, marker_settings.flicker_m) == {}


def test_supine_three_markers(marker_settings):
    time = np.arange(600) / 10.0
    breath = 0.5 * (1 - np.cos(2 * np.pi * time / 5.0))
    # x toward the head, y to the right, z up
    tracks = np.array([[-0.49, 0.0, 0.07], [-0.40, 0.0, 0.09], [-0.29, 0.0, 0.10]]) + np.stack(
        [
            np.outer(breath, [0, 0, 0.012]),
            np.outer(breath, [0.004, 0, 0.007]),
            np.outer(breath, [0.003, 0, 0.003]),
        ],
        axis=1,
    )
    raw = raw_of(["LAC", "UAC", "UCC"], tracks, rate=10.0)
    recording = ready(raw, marker_settings, posture="supine")
    place = recording.positions.mean(axis=0)
    assert recording.names == ("LABD", "UABD", "STRN")
    assert [recording.labels[i] for i in recording.sagittal] == ["UCC", "UAC", "LAC"]
    np.testing.assert_allclose(np.diff(place[:, 2]), [0.09, 0.11], atol=0.005)
    np.testing.assert_allclose(place[:, 1], 0.0, atol=0.005)
    assert np.ptp(recording.positions[:, 0, 0]) == pytest.approx(0.012, rel=0.05)
    assert recording.back == ()


def test_labels(tmp_path):
    assert canonical("Sternum") == "STRN"
    assert canonical("ScapulaL2") == "LSCAPULA"
    assert canonical("C7") == "C7"
    assert canonical("LKNE") == ""
    keep, spots, _ = choose_markers("a", ("PELO", "PELA", "PELL", "PELP", "C7"), None)
    assert (keep, spots) == ([4], ["C7"])
    for limbs in (("LKNE", "RTOE", "LFHD"), tuple(f"M{i}" for i in range(5))):
        with pytest.raises(InputError, match="none on the torso"):
            choose_markers("a", limbs, None)
    path = tmp_path / "map.tsv"
    path.write_text("label\tname\nm1\tCLAV\nm2\tMID\nm3\t-\n")
    keep, spots, _ = choose_markers("a", ("m3", "m2", "m1"), read_map(path))
    assert (keep, spots) == ([1, 2], ["MID", "CLAV"])
    with pytest.raises(InputError, match="names none"):
        choose_markers("a", ("x", "y"), read_map(path))
    for text, word in (
        ("a,b\n", "header"),
        ("label\tname\nm1\n", "row 2"),
        ("label\tname\nm1\tC7\nm1\tT10\n", "twice"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=word):
            read_map(path)


def test_refusals(torso_tracks, marker_settings):
    labels, tracks = torso_tracks(duration=8.0)
    refused(raw_of(labels, tracks[:10]), marker_settings, "too few")
    refused(raw_of(labels, tracks), marker_settings, "posture", posture="standing")
    limbs = [f"LIMB{s}" for s in "ABCDEFGHIJKLM"]
    refused(raw_of(limbs, tracks), marker_settings, "none on the torso")


def test_a_recording_survives_its_file(tmp_path, torso_tracks, write_c3d, marker_settings):
    labels, tracks = torso_tracks(duration=8.0)
    path = write_c3d(tmp_path / "a.c3d", labels, 1e3 * tracks)
    recording = read_recording(path, marker_settings, name="a", posture="upright", start_s=1.0)
    records.save(recording, tmp_path / "markers.npz")
    back = records.load(MarkerRecording, tmp_path / "markers.npz")
    for field in dataclasses.fields(MarkerRecording):
        if field.name != "quality":
            np.testing.assert_array_equal(getattr(back, field.name), getattr(recording, field.name))
    assert back.start == 1.0


def one_mode(positions, n):
    moved = (positions - positions.mean(axis=0)).reshape(len(positions), -1)
    u, s, vt = np.linalg.svd(moved, full_matrices=False)
    rest = moved - (u[:, :n] * s[:n]) @ vt[:n]
    return 1e3 * np.linalg.norm(rest.reshape(len(positions), -1, 3), axis=2).mean()


def test_chestvolume_without_a_map(data_real, marker_settings):
    path = data_real / "chestvolume" / "derived" / "chestvolume_assumed100hz.c3d"
    recording = read_recording(path, marker_settings, name="cv", posture="upright")
    labels = recording.labels
    assert [labels[i] for i in recording.sagittal] == ["M01", "M02", "M03"]
    assert {labels[i] for i in recording.back} == {f"M{i}" for i in range(13, 22)}
    place = dict(zip(labels, recording.positions.mean(axis=0), strict=True))
    assert place["M02"][0] > 0.09 and place["M17"][0] < -0.09
    assert place["M08"][1] > 0.09 and place["M26"][1] < -0.09
    assert place["M01"][2] > place["M02"][2] > place["M03"][2]
    for part, not_moving, one, two, four in (
        (slice(0, 1000), 1.09, 0.55, 0.26, 0.16),
        (slice(1000, 2309), 4.78, 1.30, 0.98, 0.50),
    ):
        positions = recording.positions[part]
        moved = 1e3 * np.linalg.norm(positions - positions.mean(axis=0), axis=2).mean()
        assert moved == pytest.approx(not_moving, abs=0.01)
        found = [one_mode(positions, n) for n in (1, 2, 4)]
        np.testing.assert_allclose(found, [one, two, four], atol=0.02)
    quiet = np.ptp(recording.positions[:1000], axis=0)
    for label, forward in (("M01", 2.7), ("M02", 5.9), ("M03", 8.4)):
        assert 1e3 * quiet[labels.index(label), 0] == pytest.approx(forward, abs=0.8)
    assert recording.quality["flicker"]["M28"]["jumps"] > 10


def test_chestvolume_with_a_map_of_regions(data_real, tmp_path, marker_settings):
    lines = ["M01\tMANU", "M02\tXIPH", "M03\tMID", *(f"M{i}\tBACK" for i in range(13, 22))]
    lines += [f"M{i:02d}\tSIDE" for i in (7, 8, 9, 25, 26, 27)]
    path = tmp_path / "map.tsv"
    path.write_text("label\tname\n" + "\n".join(lines) + "\n")
    recording = read_recording(
        data_real / "chestvolume" / "derived" / "sample_data.csv",
        marker_settings,
        name="cv",
        posture="upright",
        marker_map=path,
    )
    labels = recording.labels
    assert len(labels) == 18
    assert [labels[i] for i in recording.sagittal] == ["M01", "M02", "M03"]
    assert recording.names[labels.index("M02")] == "XIPH"
    place = dict(zip(labels, recording.positions.mean(axis=0), strict=True))
    assert place["M02"][0] > place["M17"][0] + 0.15
    assert place["M08"][1] > place["M26"][1] + 0.15
    assert place["M01"][2] > place["M02"][2] > place["M03"][2]


def test_y_up_without_a_screen(data_real, marker_settings):
    path = data_real / "c3d_format" / "kineticstoolkit" / "kinematics_racing_static.c3d"
    recording = read_recording(path, marker_settings, name="r", posture="upright")
    assert any("vertical axis Y" in note for note in recording.quality["notes"])
    place = np.nanmean(recording.positions, axis=0)
    assert place[recording.labels.index("Sternum"), 0] > 0.1
    assert place[recording.labels.index("ScapulaL1"), 1] > 0.05


def test_a_front_column_alone(torso_tracks, marker_settings):
    """Standing, no back: up is the vertical, forward the way the chest goes while it rises."""
    labels, tracks = torso_tracks(duration=12.0)
    turned = Rotation.from_euler("z", 70, degrees=True).apply(tracks[:, :4].reshape(-1, 3))
    raw = raw_of(labels[:4], turned.reshape(len(tracks), 4, 3))
    recording = ready(raw, marker_settings)
    assert recording.back == ()
    assert any("not removed" in w for w in recording.quality["warnings"])
    place = recording.positions.mean(axis=0)
    np.testing.assert_allclose(place[0, 2] - place[3, 2], 0.35, atol=1e-3)
    assert place[3, 0] - place[0, 0] == pytest.approx(0.06, abs=5e-3)
    assert np.ptp(recording.positions[:, 3, 0]) == pytest.approx(0.8 * 6e-3, rel=0.1)
