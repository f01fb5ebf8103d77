"""Fixtures that every part's tests share.

`pipeline` comes before numpy here: it holds the linear algebra to one thread, as in every stage,
and numpy asks for that only once.
"""

from __future__ import annotations

import importlib.util
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import hypothesis
import pytest
import yaml

from pipeline.markers import MarkerRecording, read_recording
from pipeline.settings import (
    AudioSettings,
    CallSettings,
    MarkerSettings,
    PressureSettings,
    SignatureSettings,
)

if TYPE_CHECKING:
    import numpy as np

    from sim.motion import Motion

# No test is timed: a first call compiles.
hypothesis.settings.register_profile("pleura", deadline=None)
hypothesis.settings.load_profile("pleura")

ROOT = Path(__file__).resolve().parents[1]
# a torso of 1.75 m, body axes (X anterior, Y left, Z up), m
TORSO = {
    "CLAV": (0.05, 0.0, 1.38),
    "STRN": (0.09, 0.0, 1.28),
    "XIPH": (0.10, 0.0, 1.21),
    "NAVEL": (0.11, 0.0, 1.03),
    "LUCH": (0.08, 0.08, 1.33),
    "RUCH": (0.08, -0.08, 1.33),
    "LCOS": (0.08, 0.11, 1.16),
    "RCOS": (0.08, -0.11, 1.16),
    "C7": (-0.09, 0.0, 1.47),
    "T10": (-0.13, 0.0, 1.22),
    "L1": (-0.10, 0.0, 1.12),
    "LBAK": (-0.13, 0.09, 1.30),
    "RBAK": (-0.13, -0.09, 1.30),
}
RATE_TO_REPLACE = 123.456
BACK = {"C7", "T10", "L1", "LBAK", "RBAK"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the files that hold a test of minutes: a file runs on one process."""
    long = {item.path for item in items if item.get_closest_marker("minutes")}
    items.sort(key=lambda item: item.path not in long)


@pytest.fixture(scope="session")
def data_real() -> Path:
    """Folder of real recordings next to the repository; they are never part of it."""
    folder = ROOT.parent / "shared" / "data_real"
    if not folder.is_dir():
        pytest.skip("the real recordings are not beside the repository")
    return folder


@pytest.fixture(scope="session")
def data_samples() -> Path:
    """Folder of the synthetic subjects that the repository carries."""
    return ROOT / "data_samples"


def _script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def targets() -> ModuleType:
    """The script that measures the targets of sound."""
    return _script("audio_targets")


@pytest.fixture(scope="session")
def swinging() -> ModuleType:
    """The script that lets a rib swing."""
    return _script("rib_swing")


@pytest.fixture(scope="session")
def planted() -> ModuleType:
    """The script that plants levels and fits them."""
    return _script("planted_truth")


@pytest.fixture(scope="session")
def follow_real() -> ModuleType:
    """The script that lets a torso follow every real sound."""
    return _script("follow_real")


@pytest.fixture(scope="session")
def open_pages() -> ModuleType:
    """The script that opens built pages in a browser."""
    return _script("open_pages")


def _section(name: str) -> dict[str, Any]:
    section: dict[str, Any] = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())[name]
    return section


@pytest.fixture(scope="session")
def audio_settings() -> AudioSettings:
    return AudioSettings(**_section("audio"))


@pytest.fixture(scope="session")
def pressure_settings() -> PressureSettings:
    return PressureSettings(**_section("pressure"))


@pytest.fixture(scope="session")
def call_settings() -> CallSettings:
    return CallSettings(**_section("calls"))


@pytest.fixture(scope="session")
def marker_settings() -> MarkerSettings:
    return MarkerSettings(**_section("markers"))


@pytest.fixture(scope="session")
def signature_settings() -> SignatureSettings:
    return SignatureSettings(**_section("signature"))


@pytest.fixture(scope="session")
def sample_recording(
    data_samples: Path, marker_settings: MarkerSettings
) -> Callable[[str], MarkerRecording]:
    """Read a synthetic subject as the markers stage does; each file once."""

    @cache
    def read(subject: str) -> MarkerRecording:
        path = data_samples / f"{subject}.c3d"
        return read_recording(path, marker_settings, name=subject, posture="upright")

    return read


@pytest.fixture(scope="session")
def torso_tracks() -> Callable[..., tuple[list[str], np.ndarray]]:
    """A breathing torso: labels and (n_frames, n_markers, 3) in m, 15 breaths a minute."""

    import numpy as np

    def make(
        *, rate: float = 100.0, duration: float = 24.0, noise: float = 1e-4, size: float = 6e-3
    ) -> tuple[list[str], np.ndarray]:
        time = np.arange(round(rate * duration)) / rate
        breath = 0.5 * (1 - np.cos(2 * np.pi * time / 4.0))
        rng = np.random.default_rng(1)
        labels = list(TORSO)
        tracks = np.empty((time.size, len(labels), 3))
        for i, label in enumerate(labels):
            way = np.array([0.0 if label in BACK else 0.8, 0.0, 0.0 if label in BACK else 0.6])
            tracks[:, i] = np.array(TORSO[label]) + size * breath[:, None] * way
        return labels, tracks + noise * rng.standard_normal(tracks.shape)

    return make


@pytest.fixture(scope="session")
def write_c3d() -> Callable[..., Path]:
    """Write markers (n_frames, n_markers, 3) as a C3D file in the unit given."""

    import ezc3d
    import numpy as np

    def write(
        path: Path,
        labels: list[str],
        places: np.ndarray,
        *,
        rate: float = 100.0,
        unit: str = "mm",
        residuals: np.ndarray | None = None,
        parameters: dict[str, list[str]] | None = None,
    ) -> Path:
        content = ezc3d.c3d()
        content["parameters"]["POINT"]["LABELS"]["value"] = labels
        # the library dies of a rate of zero: write another and change its bytes
        content["parameters"]["POINT"]["RATE"]["value"] = [rate or RATE_TO_REPLACE]
        content["parameters"]["POINT"]["UNITS"]["value"] = [unit]
        for key, value in (parameters or {}).items():
            content.add_parameter("POINT", key, value)
        n_frames, n_markers, _ = places.shape
        points = np.ones((4, n_markers, n_frames))
        points[:3] = np.moveaxis(places, (0, 1, 2), (2, 1, 0))
        content["data"]["points"] = points
        if residuals is not None:
            content["data"]["meta_points"]["residuals"] = residuals.T[None]
        content.write(str(path))
        if rate == 0:
            mark = struct.pack("<f", RATE_TO_REPLACE)
            path.write_bytes(path.read_bytes().replace(mark, struct.pack("<f", 0.0)))
        return path

    return write


def _box(half: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward faces of a box about the origin."""
    import numpy as np
    from scipy.spatial import ConvexHull

    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    faces = ConvexHull(corners).simplices.astype(np.int64)
    a, b, c = corners[faces].swapaxes(0, 1)
    inward = (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1) < 0
    faces[inward] = faces[inward, ::-1]
    return corners * half, faces


def _ball() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward faces of a unit ball."""
    import numpy as np
    from scipy.spatial import ConvexHull

    k = np.arange(120) + 0.5
    up, round_ = 1 - 2 * k / 120, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - up**2)
    points = np.column_stack([flat * np.cos(round_), flat * np.sin(round_), up])
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = points[faces].swapaxes(0, 1)
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    faces[inward] = faces[inward, ::-1]
    return points, faces


@pytest.fixture(scope="session")
def small_motion() -> Motion:
    """A torso of three boxes and four balls: turning bones, soft parts, fibres, markers."""
    import numpy as np
    from scipy.spatial.transform import Rotation

    from sim.model.bone_shapes import Shape
    from sim.motion import Elements, Motion, Soft

    time = 0.04 * np.arange(51)
    breath = 0.5 * (1 - np.cos(np.pi * time))
    still = np.zeros_like(time)
    turns = [np.column_stack([still, -0.3 * breath * k, 0.1 * breath * k]) for k in (0, 1, 2)]
    turn = np.stack([Rotation.from_rotvec(t).as_matrix() for t in turns], axis=1)
    spine = np.array([0.0, 0.0, 0.2])
    position = np.zeros((51, 3, 3))
    position[:, 1] = spine
    position[:, 2] = spine + turn[:, 1] @ [0.0, 0.1, 0.3]
    quaternion = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    boxes = {"pelvis": (0.08, 0.12, 0.05), "T1-T4": (0.03, 0.03, 0.2), "rib_L5": (0.09, 0.02, 0.01)}
    shapes = {}
    for (name, half), tissue in zip(boxes.items(), ("bone", "bone", "cartilage"), strict=True):
        vertices, faces = _box(half)
        shapes[name] = Shape(body=name, tissue=tissue, vertices=vertices, faces=faces)
    ball, faces = _ball()
    swell = 1 + 0.1 * breath[:, None, None] * (1 + ball[None, :, 2:])
    sizes = {"abdomen": 0.11, "diaphragm": 0.08, "chest_cavity": 0.1, "skin": 0.16}
    soft = {
        name: Soft(vertices=[0.0, 0.0, 0.3] + size * ball * swell, faces=faces)
        for name, size in sizes.items()
    }
    rib = position[:, 2, None] + np.einsum("fij,pj->fpi", turn[:, 2], [[0.05, 0, 0], [0, 0.02, 0]])
    ends = np.stack([rib, soft["diaphragm"].vertices[:, :2]], axis=2)
    markers = soft["skin"].vertices[:, [3, 60, 110]]
    measured = markers + 0.002 * np.sin(time)[:, None, None] + 0.004
    volume = 2e-3 + 5e-4 * breath
    return Motion(
        time=time + 0.02,
        bodies=tuple(boxes),
        parents=("", "pelvis", "T1-T4"),
        shapes=shapes,
        position=position,
        quaternion=quaternion.reshape(51, 3, 4),
        soft=soft,
        marker_names=("STRN", "</script><b>", "T10"),
        markers=markers,
        measured=measured,
        elements=Elements(
            group=("diaphragm", "rectus"),
            tension=5.0 * breath[:, None] * [1.0, 0.2],
            endpoints=ends,
        ),
        volumes={"lung": volume, "chest_cavity": volume + 1e-3, "abdomen": volume},
        pressures={"lung": -50 * breath, "pleural": -500 - 200 * breath, "abdomen": 500 + still},
        tissue_volume=1e-3,
    )


@pytest.fixture(scope="session")
def dressed_motion(small_motion: Motion) -> Motion:
    """The small torso in a ball of skin that is bound to its boxes and its abdomen."""
    import numpy as np

    from sim.model.anatomy import Subject
    from sim.skin.binding import SMOOTH
    from sim.skin.dress import bind
    from sim.skin.frame import RestPose

    abdomen = small_motion.soft["abdomen"]
    rest = RestPose(
        subject=Subject(sex="female", stature=1.6, mass=60.0),
        bodies=small_motion.bodies,
        position=small_motion.position[0],
        quaternion=small_motion.quaternion[0],
        abdomen=abdomen.vertices[0],
        wall=np.arange(0, abdomen.vertices.shape[1], 2),
        marks={"shoulder": np.array([0.0, 0.2, 0.4]), "elbow": np.array([0.0, 0.2, 0.1])},
    )
    ball, faces = _ball()
    about: dict[str, str | float] = {"made_from": "human", "method": SMOOTH, "age_years": 30.0}
    skin = bind(
        [0.0, 0.0, 0.3] + 0.3 * ball, faces, rest, small_motion.shapes, abdomen.faces, SMOOTH,
        about,
    )  # fmt: skip
    return replace(small_motion, rest=rest, skin=skin)
