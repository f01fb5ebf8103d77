"""Run a torso from rest and keep what happened."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sim import engine
from sim.errors import ParameterError, UnstableSimulation
from sim.model.landmarks import skin_places
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.torso import Torso
from sim.physics.one_way import one_way_follow, one_way_start
from sim.physics.surface import enclosed_volume
from sim.physics.types import Floats, Ints
from sim.rest import GRAVITY, Machine, bed, copy_state
from sim.resting import RestingTorso
from sim.tables import Parameters
from sim.tables import parameters as calibrated

BREATH_STEP = 0.004
"""s; halving it changes a tidal volume by less than 1 % (tests/sim/test_breaths.py)."""
REFRESH = 150
"""Steps for which a factorisation serves."""
SPEED_LIMIT = 20.0
LUNGS = ("two_way", "one_way")
LEVELS = ("external_intercostals", "diaphragm", "internal_intercostals", "abdomen")


@dataclass(frozen=True, kw_only=True, slots=True)
class Trajectory:
    """What a run left behind, one row a frame.

    Parameters
    ----------
    time : (n_frames,), s
    qpos : (n_frames, n_q), joint positions of the bones
    soft : (n_frames, n_particles, 3), m
    lung, chest, abdomen : (n_frames,), volumes, m^3
    alveolar, pleural, abdominal : (n_frames,), pressures, Pa
    flow : (n_frames,), m^3/s, positive out
    tension : (n_frames, n_elements), N, or empty
    lung_model : one of `LUNGS`
    """

    time: Floats
    qpos: Floats
    soft: Floats
    lung: Floats
    chest: Floats
    abdomen: Floats
    alveolar: Floats
    pleural: Floats
    abdominal: Floats
    flow: Floats
    tension: Floats
    lung_model: str = LUNGS[0]


def default_lung(torso: Torso) -> str:
    """The lung of the torso's parameter set, one of `LUNGS`."""
    return LUNGS[int(torso.parameters["one_way_lung"])]


class OneWayLung(NamedTuple):
    """Where the papers' lung stands: volume and slack volume, m^3, Boyle's constant, Pa m^3."""

    volume: float
    slack: float
    boyle: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Moment:
    """A torso between two runs: whatever a run needs to go on where another ended.

    Parameters
    ----------
    posture : "upright" or "supine"
    state : places and speeds; never written to
    held, ease : (n_contacts,), face of the rib cage beside each particle of the diaphragm, and
        the share of its push that this contact has
    one_way : the papers' lung, once a run has had it
    """

    posture: str
    state: engine.State
    held: Ints
    ease: Floats
    one_way: OneWayLung | None = None


def rest_moment(resting: RestingTorso, posture: str) -> Moment:
    """The torso at rest."""
    rest = resting.rest(posture)
    held = rest.torso.plant.contacts.start
    return Moment(posture=posture, state=rest.state, held=held, ease=np.ones(len(held)))


def group_activation(levels: Floats, parameters: Parameters | None = None) -> Floats:
    """Activation of every muscle group from the four levels.

    `levels.csv`: a group takes its share of what a level has above a threshold, as accessory
    muscles are recruited late.

    Parameters
    ----------
    levels : (..., 4), in the order of `LEVELS`
    parameters : whose table is read, the calibrated set's unless given

    Returns
    -------
    (..., n_groups), at most 1, in the order of `MUSCLE_GROUPS`
    """
    out = np.zeros((*np.shape(levels)[:-1], len(MUSCLE_GROUPS)))
    p = calibrated() if parameters is None else parameters
    for row in p.rows("levels.csv"):
        above = np.maximum(levels[..., LEVELS.index(row["level"])] - float(row["threshold"]), 0.0)
        out[..., MUSCLE_GROUPS.index(row["group"])] += float(row["share"]) * above
    return np.minimum(out, 1.0)


def simulate(
    resting: RestingTorso,
    activation: Floats,
    *,
    posture: str,
    step: float = BREATH_STEP,
    rate: float = 50.0,
    tension: bool = False,
    larynx: Floats | None = None,
    bend: Floats | None = None,
    lung: str | None = None,
    dump: Path | None = None,
) -> Trajectory:
    """Run from rest; parameters and errors are those of `go_on`."""
    return go_on(
        resting, rest_moment(resting, posture), activation, step=step, rate=rate, tension=tension,
        larynx=larynx, bend=bend, lung=lung, dump=dump,
    )[0]  # fmt: skip


def go_on(
    resting: RestingTorso,
    moment: Moment,
    activation: Floats,
    *,
    step: float = BREATH_STEP,
    rate: float = 50.0,
    tension: bool = False,
    larynx: Floats | None = None,
    bend: Floats | None = None,
    lung: str | None = None,
    dump: Path | None = None,
) -> tuple[Trajectory, Moment]:
    """Run on from a moment; `moment` itself stays as it is, so that many runs may start from it.

    The step's matrix is made anew at the start, which is all that parts a run in pieces from one in
    a single piece: under a hundredth of a call's pressure and flow (tests/sim/test_go_on.py).

    Parameters
    ----------
    activation : (n_steps, n_groups), in [0, 1]
    rate : frames a second to keep
    larynx : (n_steps,), Pa s/m^3, resistance of the larynx on top of the open airway's
    bend : (n_steps, 8, 3), rad, rotation vectors of the spine's joints from below;
        `sim.model.spine.spine_bend` makes them
    lung : "two_way", or "one_way" as in dilorenzo2009 section 6.3.1: the pleural pressure stays as
        at rest, and lung volume, pressures and flow follow from the chest's volume, frame by
        frame; as the parameter set says (`one_way_lung`) unless given
    dump : file for the state just before a divergence

    Returns
    -------
    the run, its time counted from the moment, and the moment in which it ended

    Raises
    ------
    UnstableSimulation
        if a speed passes 20 m/s or stops being a number
    """
    if lung is None:
        lung = default_lung(resting.torso)
    if lung not in LUNGS:
        raise ParameterError(f"lung is {lung!r}. Use {' or '.join(LUNGS)}.")
    posture = moment.posture
    torso, state = resting.rest(posture).torso, copy_state(moment.state)
    machine = Machine(torso)
    machine.work.held[:] = moment.held
    machine.work.ease[:] = moment.ease
    every = max(1, round(1.0 / (rate * step)))
    n_frames = len(activation) // every
    record = engine.make_record(
        n_frames,
        n_q=machine.model.nq,
        n_particles=torso.n_particles,
        n_elements=len(torso.plant.muscles.a) if tension else 0,
    )
    machine.set_gravity(GRAVITY[posture])
    drive = engine.make_drive(
        activation,
        gravity=GRAVITY[posture],
        locked=bed(torso, posture),
        pleural=torso.parameters["end_expiratory_pleural"] if lung == "one_way" else np.nan,
        larynx=larynx,
        bend=bend,
    )
    schedule = engine.Schedule(
        step=step, refresh_every=REFRESH, record_every=every, drag=0.0, speed_limit=SPEED_LIMIT
    )
    done = engine.run(machine.bones, torso.plant, machine.work, state, schedule, drive, record)
    if done < len(activation):
        raise UnstableSimulation(_diverged(done * step, machine, state), _dump(dump, state))
    s, papers = record.scalars, moment.one_way
    if lung == "one_way":
        s, papers = _one_way(resting, record, every * step, papers)
    trajectory = Trajectory(
        time=np.arange(1, n_frames + 1, dtype=np.float64) * (every * step),
        qpos=record.qpos,
        soft=record.soft,
        lung=s[:, 0],
        chest=s[:, 1],
        abdomen=s[:, 2],
        alveolar=s[:, 3],
        pleural=s[:, 4],
        abdominal=s[:, 5],
        flow=s[:, 6],
        tension=record.tension,
        lung_model=lung,
    )
    after = Moment(
        posture=posture,
        state=state,
        held=machine.work.held.copy(),
        ease=machine.work.ease.copy(),
        one_way=papers,
    )
    return trajectory, after


def _one_way(
    resting: RestingTorso, record: engine.Record, frame: float, papers: OneWayLung | None
) -> tuple[Floats, OneWayLung]:
    """The frames with the papers' lung and the chest that it follows, and where it ends."""
    p, out = resting.torso.parameters, record.scalars.copy()
    found = np.empty((len(out), 4))
    compliance, air = p["one_way_compliance"], p["atmosphere"]
    if resting.cavity is not None:
        everything = np.arange(resting.torso.n_bound + resting.torso.n_particles)
        poses = _replay(resting.torso, record.qpos, record.soft, everything)
        vertices = resting.cavity.places(poses.position, poses.rotation, poses.points)
        out[:, 1] = [enclosed_volume(x, resting.cavity.faces) for x in vertices]
    chest = np.ascontiguousarray(out[:, 1])
    if papers is None:
        papers = OneWayLung(*one_way_start(
            float(chest[0]), p["one_way_share"], compliance, -p["end_expiratory_pleural"], air
        ))  # fmt: skip
    one_way_follow(chest, frame, *papers, compliance, p["one_way_k"], air, found)
    out[:, [0, 3, 4, 6]] = found
    return out, papers._replace(volume=float(found[-1, 0]))


def _diverged(time: float, machine: Machine, state: engine.State) -> str:
    fastest = int(np.argmax(np.nan_to_num(np.abs(state.qvel), nan=np.inf)))
    name = machine.model.body(int(machine.model.dof_bodyid[fastest])).name
    soft = float(np.abs(state.soft_velocity).max())
    return (
        f"the simulation diverged at {time:.3f} s: body {name} at {state.qvel[fastest]:.3g}, "
        f"fastest particle at {soft:.3g} m/s. Lower the activation or the step."
    )


def _dump(path: Path | None, state: engine.State) -> Path | None:
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, **state._asdict())
    return path


@dataclass(frozen=True, kw_only=True, slots=True)
class Poses:
    """Bodies and chosen points of every frame.

    Parameters
    ----------
    position : (n_frames, n_bodies, 3), m
    rotation : (n_frames, n_bodies, 3, 3), body to world
    points : (n_frames, n_chosen, 3), m
    """

    position: Floats
    rotation: Floats
    points: Floats


def replay(resting: RestingTorso, trajectory: Trajectory, chosen: Ints) -> Poses:
    """Places of bodies and points; `chosen` (n,) are point indices."""
    return _replay(resting.torso, trajectory.qpos, trajectory.soft, chosen)


def _replay(torso: Torso, qpos: Floats, soft: Floats, chosen: Ints) -> Poses:
    machine, n = Machine(torso), len(qpos)
    nb = machine.model.nbody
    position, rotation = np.zeros((n, nb, 3)), np.zeros((n, nb, 9))
    points = np.zeros((n, len(chosen), 3))
    engine.replay(
        machine.bones, torso.plant, machine.work, qpos, soft,
        np.asarray(chosen, dtype=np.int64), position, rotation, points,
    )  # fmt: skip
    return Poses(position=position, rotation=rotation.reshape(n, nb, 3, 3), points=points)


def skin_frames(resting: RestingTorso, trajectory: Trajectory) -> Floats:
    """(n_frames, n_vertices, 3), the skin in every frame, m."""
    poses = replay(resting, trajectory, resting.skin.point)
    return skin_places(resting.skin, resting.torso, poses.points, poses.position, poses.rotation)
