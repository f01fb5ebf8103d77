"""The drawn bones lie where the model has its ribs, facets and joints."""

from __future__ import annotations

import numpy as np
import pytest

from sim.model.anatomy import Anatomy, Placer, Subject, build_anatomy
from sim.model.bone_shapes import World, bone_shapes, tube
from sim.physics.surface import enclosed_volume
from sim.tables import parameters

WOMAN = Subject(sex="female", stature=1.63, mass=62.0)


class _Nowhere(dict[str, np.ndarray]):
    """Every body's frame at the world's origin."""

    def __missing__(self, name: str) -> np.ndarray:
        return np.zeros(3)


@pytest.fixture(scope="module", params=[(1.0, 1.0, 1.0), (0.9, 1.1, 1.05)])
def built(request: pytest.FixtureRequest) -> tuple[Anatomy, World]:
    p = parameters()
    anatomy = build_anatomy(WOMAN, p, np.array(request.param))
    return anatomy, bone_shapes(anatomy, Placer(p), _Nowhere())


def test_ribs_surround_their_centrelines(built: tuple[Anatomy, World]) -> None:
    anatomy, shapes = built
    for side, letter in enumerate("LR"):
        for rib in range(12):
            vertices = shapes[f"rib_{letter}{rib + 1}"].vertices
            line = anatomy.rib[side, rib]
            away = np.linalg.norm(line[:, None] - vertices[None], axis=-1).min(axis=1)
            assert away.max() < 0.012


def test_cartilages_join_ribs_and_sternum(built: tuple[Anatomy, World]) -> None:
    anatomy, shapes = built
    for rib in range(7):
        vertices = shapes[f"cartilage_L{rib + 1}"].vertices
        for end in (anatomy.rib[0, rib, -1], anatomy.facet[0, rib]):
            assert np.linalg.norm(vertices - end, axis=1).min() < 1e-9


def test_right_is_left_mirrored(built: tuple[Anatomy, World]) -> None:
    _, shapes = built
    for name, shape in shapes.items():
        if "_L" in name:
            other = shapes[name.replace("_L", "_R")]
            assert np.array_equal(other.vertices, shape.vertices * [1, -1, 1])
            assert other.body == shape.body.replace("_L", "_R")


def test_scapula_and_clavicle_reach_the_landmarks(built: tuple[Anatomy, World]) -> None:
    anatomy, shapes = built
    for name in ("acromion", "inferior_angle"):
        away = np.linalg.norm(shapes["scapula_L"].vertices - anatomy.girdle[name][0], axis=1)
        assert away.min() < 0.006
    for name in ("clavicle_sternal", "clavicle_acromial"):
        away = np.linalg.norm(shapes["clavicle_L"].vertices - anatomy.girdle[name][0], axis=1)
        assert away.min() < 0.012


def test_the_sternum_has_no_cartilage_on_it(built: tuple[Anatomy, World]) -> None:
    _, shapes = built
    assert np.ptp(shapes["sternum"].vertices[:, 1]) < 0.06


def test_a_tube_is_closed_and_turns_outwards() -> None:
    line = np.column_stack([np.linspace(0, 0.2, 30), np.zeros(30), np.zeros(30)])
    vertices, faces = tube(line, 0.01)
    edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    # an octagon of radius 10 mm
    area = 8 * 0.5 * 0.01**2 * np.sin(np.pi / 4)
    assert enclosed_volume(vertices, faces) == pytest.approx(0.2 * area, rel=1e-9)
