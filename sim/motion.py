"""The torso in space, frame by frame: what is written, shown and measured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from sim import engine
from sim.model.anatomy import Placer
from sim.model.bone_shapes import Shape, bone_shapes
from sim.model.landmarks import attach, body_origins, marker_places, skin_places
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Torso
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats, Ints
from sim.resting import RestingTorso
from sim.simulate import Poses, Trajectory, default_lung, replay
from sim.skin.bound import BoundSkin
from sim.skin.dress import dress
from sim.skin.frame import RestPose, bone_marks

FREE = 6
"""Degrees of freedom of a body that nothing carries."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Soft:
    """A surface that changes its shape.

    Parameters
    ----------
    vertices : (n_frames, n_vertices, 3), m
    faces : (n_faces, 3), indices into the vertices, outward
    """

    vertices: Floats
    faces: Ints


@dataclass(frozen=True, kw_only=True, slots=True)
class Elements:
    """Muscle elements.

    Parameters
    ----------
    group : (n_elements,) names
    tension : (n_frames, n_elements), N
    endpoints : (n_frames, n_elements, 2, 3), m
    """

    group: tuple[str, ...]
    tension: Floats
    endpoints: Floats


@dataclass(frozen=True, kw_only=True, slots=True)
class Motion:
    """Bodies, surfaces, markers, volumes and pressures of every frame, in SI units.

    The chest cavity and the abdomen are closed; the last faces of both are those of the
    diaphragm, which in `soft["diaphragm"]` turn out of the abdomen.

    Parameters
    ----------
    time : (n_frames,), s
    bodies : names, the pelvis first
    parents : name of the body that carries each body; empty for one that moves freely
    shapes : bones and cartilages by name, rigid on their bodies
    position : (n_frames, n_bodies, 3), m, origins of the bodies
    quaternion : (n_frames, n_bodies, 4), body to world; w x y z
    soft : "abdomen", "diaphragm", "chest_cavity"; "skin", which is open at the neck
    marker_names : names
    markers : (n_frames, n_markers, 3), m
    measured : the same of a recording that the motion was fitted to, or none
    elements : muscle elements, or none were kept
    volumes : "lung", "chest_cavity", "abdomen", (n_frames,) each, m^3
    pressures : "lung" (alveolar), "pleural", "abdomen" (below the dome), (n_frames,) each, Pa
    tissue_volume : m^3, of the chest cavity that is not gas in the lung; not a number with the
        one-way lung, beside which there is gas
    rest : the upright torso at rest, over which a human skin is laid; or none
    skin : a human skin bound to bones and abdomen; or none
    """

    time: Floats
    bodies: tuple[str, ...]
    parents: tuple[str, ...]
    shapes: dict[str, Shape]
    position: Floats
    quaternion: Floats
    soft: dict[str, Soft]
    marker_names: tuple[str, ...]
    markers: Floats
    measured: Floats | None
    elements: Elements | None
    volumes: dict[str, Floats]
    pressures: dict[str, Floats]
    tissue_volume: float
    rest: RestPose | None = None
    skin: BoundSkin | None = None

    def frames(self, start: int, stop: int, every: int = 1) -> Motion:
        """Frames from `start` to before `stop`, each or each second, third ..., as views."""
        part = slice(start, stop, every)
        elements = self.elements
        if elements is not None:
            elements = replace(
                elements, tension=elements.tension[part], endpoints=elements.endpoints[part]
            )
        return replace(
            self,
            time=self.time[part],
            position=self.position[part],
            quaternion=self.quaternion[part],
            soft={k: replace(s, vertices=s.vertices[part]) for k, s in self.soft.items()},
            markers=self.markers[part],
            measured=None if self.measured is None else self.measured[part],
            elements=elements,
            volumes={k: v[part] for k, v in self.volumes.items()},
            pressures={k: v[part] for k, v in self.pressures.items()},
        )


def volumes_inside(soft: Soft) -> Floats:
    """Volume inside a closed surface in every frame, (n_frames,), m^3."""
    return np.array([enclosed_volume(v, soft.faces) for v in soft.vertices])


def _surface(points: Floats, faces: Ints) -> Soft:
    used, inverse = np.unique(faces, return_inverse=True)
    return Soft(vertices=points[:, used], faces=inverse.reshape(faces.shape).astype(np.int64))


def _surfaces(resting: RestingTorso, poses: Poses, *, bound: bool) -> dict[str, Soft]:
    plant, points, cavity = resting.torso.plant, poses.points, resting.cavity
    chest = _surface(points, plant.chest_faces)
    if bound and cavity is not None:
        vertices = cavity.places(poses.position, poses.rotation, points)
        chest = Soft(vertices=vertices, faces=cavity.faces)
    return {
        "abdomen": _surface(points, plant.abdomen_faces),
        "diaphragm": _surface(points, plant.abdomen_faces[-resting.torso.n_dome :]),
        "chest_cavity": chest,
    }


def _carried(resting: RestingTorso) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the bodies and of those that carry them."""
    model = resting.torso.skeleton.model
    names = ("pelvis", *(model.body(b).name for b in range(1, model.nbody)))
    free = model.body_dofnum == FREE
    parents = [names[p] for p in model.body_parentid.tolist()]
    return names, tuple("" if b == 0 or free[b] else parents[b] for b in range(model.nbody))


def body_shapes(resting: RestingTorso) -> dict[str, Shape]:
    """Bones and cartilages of a torso."""
    torso = resting.torso
    origins = body_origins(torso)
    at = {name: origins[b] for name, b in torso.skeleton.body.items()}
    return bone_shapes(torso.anatomy, Placer(torso.parameters), at)


def _lung_volume(torso: Torso, trajectory: Trajectory, chest: Floats) -> tuple[Floats, float]:
    """Volume of the lung in every frame, and of the tissue beside it, m^3.

    The one-way lung is what its equations made it; in a pose that was not run, it is at rest.
    """
    if trajectory.lung_model == "one_way":
        rest = torso.parameters["one_way_share"] * chest
        return np.where(np.isnan(trajectory.lung), rest, trajectory.lung), np.nan
    tissue = float(torso.plant.constants.tissue_volume)
    return chest - tissue, tissue


def _elements(resting: RestingTorso, points: Floats, tension: Floats) -> Elements:
    muscles = resting.torso.plant.muscles
    return Elements(
        group=tuple(MUSCLE_GROUPS[g] for g in muscles.group),
        tension=tension,
        endpoints=np.stack([points[:, muscles.a], points[:, muscles.b]], axis=2),
    )


def motion(resting: RestingTorso, trajectory: Trajectory, *, posture: str) -> Motion:
    """Replay a run; volumes are those of the replayed faces.

    Parameters
    ----------
    posture : the one that the run was made in
    """
    torso, n = resting.torso, len(trajectory.time)
    everything = np.arange(torso.n_bound + torso.n_particles)
    poses = replay(resting, trajectory, everything)
    position, matrix, points = poses.position, poses.rotation, poses.points
    soft = _surfaces(resting, poses, bound=trajectory.lung_model == "one_way")
    chest = volumes_inside(soft["chest_cavity"])
    lung, tissue = _lung_volume(torso, trajectory, chest)
    named = resting.landmarks(posture)
    bound = attach(resting.vertices(posture), resting.skin.outside, np.array(list(named.values())))
    skin = skin_places(resting.skin, torso, points[:, resting.skin.point], position, matrix)
    soft["skin"] = Soft(vertices=skin, faces=resting.skin.outside)
    bodies, parents = _carried(resting)
    turned = Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    kept = len(trajectory.tension) == n
    return Motion(
        time=trajectory.time,
        bodies=bodies,
        parents=parents,
        shapes=body_shapes(resting),
        position=position,
        quaternion=turned.reshape(n, -1, 4),
        soft=soft,
        marker_names=tuple(named),
        markers=marker_places(bound, skin),
        measured=None,
        elements=_elements(resting, points, trajectory.tension) if kept else None,
        volumes={
            "lung": lung,
            "chest_cavity": chest,
            "abdomen": volumes_inside(soft["abdomen"]),
        },
        pressures={
            "lung": trajectory.alveolar,
            "pleural": trajectory.pleural,
            "abdomen": trajectory.abdominal,
        },
        tissue_volume=tissue,
        rest=rest_pose(resting),
    )


def _still(resting: RestingTorso, state: engine.State) -> Trajectory:
    """A state as a run of one frame; its pressures are not known (not a number)."""
    nothing = np.full(1, np.nan)
    return Trajectory(
        time=np.zeros(1), qpos=state.qpos[None], soft=state.soft[None], lung=nothing,
        chest=nothing, abdomen=nothing, alveolar=nothing, pleural=nothing, abdominal=nothing,
        flow=nothing, tension=np.zeros((0, 0)), lung_model=default_lung(resting.torso),
    )  # fmt: skip


def rest_pose(resting: RestingTorso) -> RestPose:
    """The upright torso at rest, as a skin sees it."""
    torso = resting.torso
    everything = np.arange(torso.n_bound + torso.n_particles)
    poses = replay(resting, _still(resting, resting.upright.state), everything)
    used = np.unique(torso.plant.abdomen_faces)
    dome = np.unique(torso.plant.abdomen_faces[-torso.n_dome :])
    free = (used >= torso.n_bound) & ~np.isin(used, dome)
    turned = Rotation.from_matrix(poses.rotation[0]).as_quat(scalar_first=True)
    return RestPose(
        subject=torso.subject,
        bodies=_carried(resting)[0],
        position=poses.position[0],
        quaternion=turned,
        abdomen=poses.points[0, used],
        wall=np.flatnonzero(free),
        marks=bone_marks(torso.anatomy),
    )


def belly_faces(motion: Motion) -> Ints:
    """Faces (m, 3) of the abdomen without those of the diaphragm."""
    return motion.soft["abdomen"].faces[: -len(motion.soft["diaphragm"].faces)]


def dressed(motion: Motion, age: float | None = None) -> Motion:
    """A motion with a human skin: its own, or that of its subject.

    One without a rest pose, as older files have none, stays as it is.

    Parameters
    ----------
    age : years, else the usual one
    """
    if motion.skin is not None or motion.rest is None:
        return motion
    return replace(motion, skin=dress(motion.rest, motion.shapes, belly_faces(motion), age=age))


def skin_surface(motion: Motion) -> Soft:
    """The skin in every frame: the human one, or without it the outer tube of the model."""
    if motion.skin is None:
        return motion.soft["skin"]
    places = motion.skin.places(motion.position, motion.quaternion, motion.soft["abdomen"].vertices)
    return Soft(vertices=places, faces=motion.skin.faces)


def skinned(motion: Motion) -> Motion:
    """The same motion with `skin_surface` for its surface `skin`, to be drawn or written."""
    return replace(motion, soft=motion.soft | {"skin": skin_surface(motion)})


def still_motion(resting: RestingTorso, state: engine.State, posture: str) -> Motion:
    """A state as a motion of one frame; its pressures are not known (not a number)."""
    return motion(resting, _still(resting, state), posture=posture)


def rest_motion(resting: RestingTorso, posture: str) -> Motion:
    """The torso at rest as a motion of one frame."""
    return still_motion(resting, resting.rest(posture).state, posture)
