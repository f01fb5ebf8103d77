"""Size and place of a torso from its own markers."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.nearest import nearest_on_mesh
from pipeline.registration import as_recorded, register
from sim.errors import InputError

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def test_nearest_point_on_a_square_by_hand():
    points = np.array([[0.3, 0.4, 0.7], [2.0, 0.5, 0.0], [-1.0, -1.0, 1.0], [0.5, 3.0, -2.0]])
    near = nearest_on_mesh(points, SQUARE, HALVES)
    expected = [[0.3, 0.4, 0], [1, 0.5, 0], [0, 0, 0], [0.5, 1, 0]]
    assert np.allclose(near.points, expected)
    assert np.allclose(near.normals, [0, 0, 1])


def test_no_vertex_is_nearer_than_the_nearest_point():
    rng = np.random.default_rng(2)
    vertices = rng.normal(size=(30, 3))
    faces = rng.permutation(30).reshape(10, 3)
    points = 2 * rng.normal(size=(25, 3))
    distance = np.linalg.norm(nearest_on_mesh(points, vertices, faces).points - points, axis=1)
    corners = vertices[faces.ravel()]
    to_corners = np.linalg.norm(points[:, None] - corners[None], axis=-1).min(axis=1)
    assert (distance <= to_corners + 1e-12).all()


def lift(points, radius):
    """A marker's centre stands off the plant's skin."""
    out = points / [0.11**2, 0.15**2, np.inf]
    return points + radius * out / np.linalg.norm(out, axis=1, keepdims=True)


def placed(plant, settings, scale, rotation=(0, 0, 0), shift=(0, 0, 0), **options):
    names, points, sagittal = plant.markers()
    markers = lift(points, settings.marker_radius_m / np.mean(scale)) * scale
    turn = Rotation.from_rotvec(rotation)
    markers = turn.inv().apply(markers - shift)
    names = options.get("names", names)
    keep = options.get("keep", slice(None))
    front = tuple(range(len(range(*keep.indices(22))))) if "keep" in options else sagittal
    found = register(plant.Model(), markers[keep], names[keep], front, "upright", settings)
    return markers[keep], found


def test_size_and_place_come_back(plant, fit_settings):
    scale, rotation, shift = (1.06, 0.95, 1.04), (0.02, -0.04, 0.03), (0.4, -1.2, 0.9)
    markers, found = placed(plant, fit_settings, scale, rotation, shift)
    assert np.allclose(found.fit_scale, scale, atol=0.02)
    assert np.linalg.norm(Rotation.from_matrix(found.rotation).as_rotvec() - rotation) < 0.03
    assert np.nanmax(found.residual) < 3e-3
    assert np.abs(found.to_recording(found.points) - markers).max() < 6e-3
    assert found.landmarks == ("CLAV", "STRN", "NAVEL", "C7", "T10")
    assert found.notes == ()


def test_axes_stay_a_rotation_and_the_way_back_is_exact(plant, fit_settings):
    _, found = placed(plant, fit_settings, (1, 1, 1), (0.1, 0.05, -0.1))
    assert np.allclose(found.rotation @ found.rotation.T, np.eye(3))
    there = np.random.default_rng(1).normal(size=(5, 2, 3))
    back = found.to_recording(there) @ found.rotation.T + found.translation
    assert np.allclose(back, there)


def test_three_markers_keep_the_size_of_the_table_and_say_so(plant, fit_settings):
    _, found = placed(plant, fit_settings, (1.1, 1.1, 1.1), names=("",) * 22, keep=slice(1, 4))
    assert found.fit_scale == (1.0, 1.0, 1.0)
    assert len(found.notes) == 2
    assert "size" in found.notes[0]
    # on the front midline of the torso, in the order in which they were
    assert (found.points[:, 0] > 0.1).all()
    assert np.abs(found.points[:, 1]).max() < 5e-3
    assert (np.diff(found.points[:, 2]) < 0).all()


def test_an_unseen_marker_gets_no_residual_and_a_note(plant, fit_settings):
    names, points, sagittal = plant.markers()
    points = lift(points, fit_settings.marker_radius_m)
    points[9] = np.nan
    found = register(plant.Model(), points, names, sagittal, "upright", fit_settings)
    assert np.flatnonzero(np.isnan(found.residual)).tolist() == [9]
    assert np.isfinite(found.points).all()
    assert any("1 markers were not seen" in note for note in found.notes)


def test_no_marker_at_all_is_one_clear_line(plant, fit_settings):
    with pytest.raises(InputError, match="no marker is visible"):
        register(plant.Model(), np.full((3, 3), np.nan), ("",) * 3, (), "supine", fit_settings)


def test_a_torso_that_only_tilts_stands_still_beside_its_back(plant, fit_settings):
    names, points, sagittal = plant.markers()
    markers = lift(points, fit_settings.marker_radius_m)
    found = register(plant.Model(), markers, names, sagittal, "upright", fit_settings)
    turns = Rotation.from_rotvec(np.outer(np.sin(np.linspace(0, 6, 30)), [0, 0.05, 0]))
    tilting = np.stack([turn.apply(points) for turn in turns])
    runs = SimpleNamespace(positions=np.stack([tilting, tilting]), failed=np.array([False, True]))
    back = tuple(i for i, point in enumerate(points) if point[0] < 0)
    alone, failed = as_recorded(runs, found, ())
    relative, _ = as_recorded(runs, found, back)
    assert np.ptp(alone, axis=0).max() > 0.03
    assert np.ptp(relative, axis=0).max() < 1e-5
    assert np.isnan(failed).all()


def test_a_set_without_names_finds_its_waist_from_a_far_start(plant, fit_settings):
    def waisted(points):
        # two waists 0.16 m apart, the upper one narrower: a search from the lower ends there
        z = points[:, 2:]
        waist = 0.2 * np.exp(-(((z - 0.21) / 0.03) ** 2)) + 0.4 * np.exp(
            -(((z - 0.37) / 0.03) ** 2)
        )
        return points * np.hstack([1 - waist, 1 - waist, np.ones_like(z)])

    class Waisted(plant.Model):
        def surface(self, fit_scale, posture):
            tube = super().surface(fit_scale, posture)
            return SimpleNamespace(vertices=waisted(tube.vertices), faces=tube.faces)

    angle, height = np.meshgrid(np.linspace(0, 2 * np.pi, 12), np.linspace(0.31, 0.43, 7))
    ring = [0.11 * np.cos(angle), 0.15 * np.sin(angle), height]
    points = np.stack(ring, axis=-1).reshape(-1, 3)
    markers = waisted(points) * (1 + 0.007 / 0.13 * np.array([1, 1, 0])) - [0.0, 0.0, 0.1]
    found = register(Waisted(), markers, ("",) * len(markers), (), "upright", fit_settings)
    assert found.translation[2] == pytest.approx(0.1, abs=0.02)
