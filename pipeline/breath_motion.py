"""The steady breath of a fit's best run: the torso in space, its ribs, and the figures of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cost import play
from pipeline.model import TorsoModel
from sim.breaths import BreathSimulator
from sim.errors import InputError, UnstableSimulation
from sim.model.landmarks import marker_places
from sim.motion import Motion, motion, rest_motion
from sim.simulate import BREATH_STEP, Trajectory, simulate, skin_frames
from sim.summary import rib_rotations, summarise

if TYPE_CHECKING:
    from pipeline.fit import FitResult
    from pipeline.signature import BreathSignature

Floats = NDArray[np.float64]

RIBS = tuple(f"L{rib}" for rib in range(1, 11))
"""The sides are mirror images."""
FIGURES = (
    "rib_cage_share",
    "rib_cage_volume_l",
    "abdominal_wall_volume_l",
    "diaphragm_volume_l",
    "diaphragm_excursion_mm",
    "pleural_pressure_cmh2o",
    "abdominal_pressure_cmh2o",
    "abdomen_volume_error",
    "rib_rotation_deg",
    "steady",
    "not_steady_because",
)


@dataclass(frozen=True, kw_only=True, slots=True)
class BreathMotion:
    """One steady breath of the fitted torso, in the torso's axes.

    Parameters
    ----------
    motion : its frames, time from onset; its markers are the recording's
    pump, bucket : (n_frames, 10), degrees from rest, of `RIBS`
    figures : those of `sim.summary.summarise` named in `FIGURES`
    """

    motion: Motion
    pump: Floats
    bucket: Floats
    figures: dict[str, Any]


def _two_breaths(simulator: BreathSimulator, levels: Floats) -> Trajectory:
    """Two breaths from rest with every tension, and a frame more, to hold the last end."""
    activation = simulator.activation(levels)
    more = round(1.0 / (simulator.rate * BREATH_STEP))
    activation = np.concatenate([activation, activation[:more]])
    bend = simulator.spine()
    bend = None if bend is None else np.concatenate([bend, bend[:more]])
    try:
        return simulate(
            simulator.torso,
            activation,
            posture=simulator.posture,
            rate=simulator.rate,
            tension=True,
            bend=bend,
        )
    except UnstableSimulation as error:
        # the same run succeeded in the search: only a damaged record of it gets here
        raise InputError(f"fit: the best run cannot be repeated ({error}). Fit again.") from error


def _rib_angles(breath: Motion, rest: Motion) -> tuple[Floats, Floats]:
    """Pump and bucket rotation since rest, (n_frames, n_ribs) each, degrees."""
    turned = [rib_rotations(breath, rest, frame) for frame in range(len(breath.time))]
    pump, bucket = (
        np.degrees([[ribs[f"rib_{rib}"][axis] for rib in RIBS] for ribs in turned])
        for axis in ("pump", "bucket")
    )
    return np.asarray(pump), np.asarray(bucket)


def best_breath(result: FitResult, model: TorsoModel, rate: float) -> BreathMotion:
    """Run the best levels once more and keep everything.

    Parameters
    ----------
    model : the same torso as the fit's
    rate : Hz, of the fit's frames
    """
    simulator = model.simulator(
        result.fit_scale,
        result.posture,
        result.points,
        inspiration_time=result.inspiration_time,
        expiration_time=result.expiration_time,
        pause_time=result.pause_time,
        rate=rate,
        bend=result.bend,
    )
    trajectory = _two_breaths(simulator, result.levels)
    resting, posture = simulator.torso, result.posture
    rest, moved = rest_motion(resting, posture), motion(resting, trajectory, posture=posture)
    figures = summarise(moved, rest, rate=1 / simulator.period)

    places = marker_places(simulator.attachments, skin_frames(resting, trajectory))
    fitted = replace(moved, marker_names=result.labels, markers=places)
    first, last = np.searchsorted(moved.time, simulator.period * np.array([1, 2]) - BREATH_STEP / 2)
    steady = fitted.frames(int(first), int(last))
    steady = replace(steady, time=steady.time - simulator.period)
    pump, bucket = _rib_angles(steady, rest)
    return BreathMotion(
        motion=steady,
        pump=pump,
        bucket=bucket,
        figures={name: figures[name] for name in FIGURES},
    )


def with_measured(breath: Motion, result: FitResult, signature: BreathSignature) -> Motion:
    """Add where the mean breath was measured, in the torso's axes.

    The simulated markers' scored differences are put on the torso's: trunk motion is taken out of
    both sides of a difference, and what stays is the error that the tables tell.

    Parameters
    ----------
    breath : the kept breath; its markers are the recording's
    """
    period = result.inspiration_time + result.expiration_time
    measured = play(signature.time, signature.mean, period, breath.time)
    simulated = play(result.time, result.positions, period, breath.time)
    difference = (measured - simulated) @ np.asarray(result.rotation).T
    return replace(breath, measured=breath.markers + difference)
