"""A plant: a torso so simple that its motion is a formula. It stands in for the real one."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

HALF_DEPTH, HALF_BREADTH, HEIGHT = 0.11, 0.15, 0.5
RIB_EDGE = 0.22


def _tube(scale):
    """Elliptic tube along Z, 40 x 30 vertices, triangles outward."""
    n_round, n_up = 40, 30
    angle = np.linspace(0, 2 * np.pi, n_round, endpoint=False)
    up = np.linspace(0, HEIGHT, n_up)
    z, a = np.meshgrid(up, angle, indexing="ij")
    vertices = np.stack([HALF_DEPTH * np.cos(a), HALF_BREADTH * np.sin(a), z], axis=-1)
    faces = []
    for i in range(n_up - 1):
        for j in range(n_round):
            p, q = i * n_round + j, i * n_round + (j + 1) % n_round
            faces += [(p, q, p + n_round), (q, q + n_round, p + n_round)]
    return vertices.reshape(-1, 3) * scale, np.array(faces)


@dataclass
class PlantSimulator:
    """Displacements that grow with the levels and saturate; groups differ in place and time."""

    points: np.ndarray
    inspiration_time: float
    expiration_time: float
    rate: float
    workers: int
    fails_above: float
    bend: tuple = (0.0, 0.0, 0.0)

    def _one(self, levels):
        period = self.inspiration_time + self.expiration_time
        time = np.arange(round(period * self.rate)) / self.rate
        late = np.clip((time - self.inspiration_time) / self.expiration_time, 0, 1)
        early = np.clip(time / self.inspiration_time, 0, 1)
        inhale = np.where(time < self.inspiration_time, early, (1 - late) ** 2)
        exhale = np.where(time < self.inspiration_time, 0, np.sin(np.pi * late) ** 2)
        rib = 1 / (1 + np.exp(-(self.points[:, 2] - RIB_EDGE) / 0.05))
        margin = np.exp(-(((self.points[:, 2] - RIB_EDGE) / 0.06) ** 2))
        out = self.points / [HALF_DEPTH**2, HALF_BREADTH**2, np.inf]
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        up, left = np.eye(3)[2], np.sign(self.points[:, 1])[:, None] * np.eye(3)[1]
        ribs, belly = rib[:, None], (1 - rib)[:, None]
        shapes = [
            0.020 * ribs * (0.6 * out + 0.8 * up),
            0.025 * belly * out + 0.012 * margin[:, None] * left,
            -0.012 * ribs * (0.9 * out + 0.4 * up),
            -0.020 * belly * out + 0.006 * margin[:, None] * up,
        ]
        gain = 1 - np.exp(-2 * np.asarray(levels))
        motion = (
            inhale[:, None, None] * (gain[0] * shapes[0] + gain[1] * shapes[1])
            + exhale[:, None, None] * (gain[2] * shapes[2] + gain[3] * shapes[3])
            + (inhale**2)[:, None, None] * gain[0] * gain[1] * 0.005 * out
            + inhale[:, None, None] * self._bending()
        )
        volume = 2.5e-3 + 1e-3 * (gain[0] + gain[1]) * inhale - 5e-4 * (gain[2] + gain[3]) * exhale
        failed = bool(np.max(levels) > self.fails_above)
        return time, self.points + motion * (np.nan if failed else 1.0), volume, failed

    def _bending(self):
        """Flexion moves points forward, a lateral bend sideways, a twist round, more above."""
        x, y, z = self.points.T
        flexion, lateral, twist = self.bend
        moved = np.stack([flexion * z - twist * y, lateral * z + twist * x, -flexion * x], axis=1)
        return moved * (z / HEIGHT)[:, None]

    def run(self, levels):
        with ThreadPoolExecutor(self.workers) as pool:
            runs = list(pool.map(self._one, levels))
        return SimpleNamespace(
            time=runs[0][0],
            positions=np.stack([run[1] for run in runs]),
            lung_volume=np.stack([run[2] for run in runs]),
            failed=np.array([run[3] for run in runs]),
        )


@dataclass
class PlantModel:
    """The plant behind the protocol of `pipeline.model.BreathModel`."""

    workers: int = 1
    fails_above: float = 2.0
    true_scale: tuple = (1.0, 1.0, 1.0)

    def surface(self, fit_scale, posture):
        vertices, faces = _tube(np.array(fit_scale) * self.true_scale)
        return SimpleNamespace(vertices=vertices, faces=faces)

    def landmarks(self, fit_scale, posture):
        places = {
            "CLAV": (HALF_DEPTH, 0, 0.46),
            "STRN": (HALF_DEPTH, 0, 0.30),
            "NAVEL": (HALF_DEPTH, 0, 0.08),
            "C7": (-HALF_DEPTH, 0, 0.49),
            "T10": (-HALF_DEPTH, 0, 0.28),
        }
        scale = np.array(fit_scale) * self.true_scale
        return {name: np.array(place) * scale for name, place in places.items()}

    def simulator(
        self,
        fit_scale,
        posture,
        points,
        *,
        inspiration_time,
        expiration_time,
        pause_time,
        rate,
        bend=(0.0, 0.0, 0.0),
    ):
        return PlantSimulator(
            points=points,
            inspiration_time=inspiration_time,
            expiration_time=expiration_time,
            rate=rate,
            workers=self.workers,
            fails_above=self.fails_above,
            bend=bend,
        )


def plant_markers(chest_only=False):
    """22 points on the plant's skin: names, positions, indices of the front column."""
    names = ["CLAV", "STRN", "", "", "NAVEL", "C7", "T10"]
    angle = [0, 0, 0, 0, 0, np.pi, np.pi]
    height = [0.46, 0.30, 0.23, 0.15, 0.08, 0.49, 0.28]
    for z in (0.40, 0.28, 0.16):
        for a in (0.5, 1.2, 2.2, -0.5, -1.2):
            names.append("")
            angle.append(a)
            height.append(z)
    angle, height = np.array(angle), np.array(height)
    points = np.column_stack([HALF_DEPTH * np.cos(angle), HALF_BREADTH * np.sin(angle), height])
    chest = height > 0.25 if chest_only else np.ones(len(height), dtype=bool)
    front = tuple(i for i, k in enumerate(np.flatnonzero(chest)) if k < 5)
    return tuple(n for n, k in zip(names, chest, strict=True) if k), points[chest], front


def plant_recording(
    levels,
    *,
    noise=5e-4,
    n_cycles=9,
    seed=1,
    chest_only=False,
    jitter=0.0,
    level_jitter=0.0,
    bend=(0.0, 0.0, 0.0),
):
    """A recording of the plant at known levels: recording, signature, levels of each breath."""
    from pipeline.markers import MarkerRecording
    from pipeline.signature import BreathSignature

    rng = np.random.default_rng(seed)
    names, points, sagittal = plant_markers(chest_only)
    rate, pieces, events, truth, start = 50.0, [], [], [], 0.0
    for _ in range(n_cycles):
        inspiration, expiration = 1.6 * np.exp(jitter * rng.normal(size=2)) * [1, 1.5]
        n_in, n_out = round(inspiration * rate), round(expiration * rate)
        own = np.clip(np.array(levels) + level_jitter * rng.normal(size=4), 0, 1)
        simulator = PlantSimulator(points, n_in / rate, n_out / rate, rate, 1, 2.0, bend)
        pieces.append(simulator.run(own[None]).positions[0])
        events.append((start, start + n_in / rate, start + (n_in + n_out) / rate))
        truth.append(own)
        start = events[-1][2]
    positions = np.concatenate(pieces)
    positions = positions + noise * rng.normal(size=positions.shape)
    recording = MarkerRecording(
        name="plant",
        labels=tuple(f"M{k}" for k in range(len(names))),
        names=names,
        positions=positions,
        measured=np.ones(positions.shape[:2], dtype=bool),
        rate=rate,
        start=0.0,
        posture="upright",
        sagittal=sagittal,
        back=(),
        quality={"noise_m": noise},
    )
    signature = plant_signature(recording, np.array(events), BreathSignature)
    return recording, signature, np.array(truth)


def plant_signature(recording, events, record):
    """The mean breath of known events; the rest of the record is filled in plainly."""
    from pipeline.cost import cycle_frames, mean_cycle

    inspiration, expiration = np.diff(events, axis=1).mean(axis=0)
    phase = np.linspace(0, 1, 101)
    time = phase * (inspiration + expiration)
    frames = cycle_frames(
        recording.positions,
        np.arange(len(recording.positions)) / recording.rate,
        events,
        np.arange(len(events)),
        inspiration_time=inspiration,
        expiration_time=expiration,
        rate=recording.rate,
    )
    warped = np.stack(list(mean_cycle(frames, time).values()))
    values = {
        "phase": phase,
        "time": time,
        "inspiration_time": float(inspiration),
        "expiration_time": float(expiration),
        "pause_time": 0.2,
        "mean": warped.mean(axis=0),
        "low": np.quantile(warped, 0.05, axis=0),
        "high": np.quantile(warped, 0.95, axis=0),
        "onset": events[:, 0],
        "peak": events[:, 1],
        "end": events[:, 2],
        "used": np.ones(len(events), dtype=bool),
        "why_not": ("",) * len(events),
        "breathing_signal": recording.positions[:, 0, 0],
        "rate": recording.rate,
        "n_used": len(events),
    }
    known = {field.name for field in dataclasses.fields(record)}
    return record(**{name: value for name, value in values.items() if name in known})


@pytest.fixture(scope="session")
def plant():
    """The plant's model and maker of recordings."""
    return SimpleNamespace(
        Model=PlantModel, Simulator=PlantSimulator, markers=plant_markers, record=plant_recording
    )


@pytest.fixture(scope="session")
def fit_settings():
    """The defaults of the fit."""
    return _defaults("fit")


@pytest.fixture(scope="session")
def posterior_settings():
    """The defaults of the posterior."""
    return _defaults("posterior")


def _defaults(name):
    from pipeline import configuration, places

    values = configuration.read_yaml(places.default_config())[name]
    return configuration.section(name, values, "config.yaml")
