"""Steady breaths of one torso at one timing, for given maximum levels of the muscles."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.errors import UnstableSimulation
from sim.model.landmarks import Attachments, marker_places
from sim.model.spine import spine_bend
from sim.physics.types import Floats
from sim.resting import RestingTorso
from sim.simulate import BREATH_STEP, Trajectory, group_activation, simulate, skin_frames
from sim.tables import parameters


def sawtooth(
    time: Floats, *, inspiration: float, expiration: float, pause: float
) -> tuple[Floats, Floats]:
    """Inspiratory and expiratory sawtooth of a breath, each from 0 to 1.

    Inspiratory muscles rise to their level, hold it to the end of the inspiration (the chest
    follows its muscles with a delay, so that a ramp up to the very end would move it too late),
    and let go over the first part of the expiration. Expiratory muscles rise through the
    expiration and are at rest in its pause. The shares are parameters: `inspiratory_rise`,
    `inspiratory_release`, `expiratory_fade`.

    Parameters
    ----------
    time : (n,), s since the onset of inspiration; periodic
    inspiration, expiration, pause : s; the pause is the end of the expiration

    Returns
    -------
    (n,), (n,)

    References
    ----------
    dilorenzo2009, section 5.3.2 (piecewise-linear sawtooth, linked timing)
    """
    period = inspiration + expiration
    t = np.mod(time, period)
    out = expiration - pause
    p = parameters()
    rise, rest = p["inspiratory_rise"] * inspiration, p["inspiratory_release"] * out
    inward = np.interp(t, [0.0, rise, inspiration, inspiration + rest, period], [0, 1, 1, 0, 0])
    top = inspiration + (1.0 - p["expiratory_fade"]) * out
    end = inspiration + out
    outward = np.interp(t, [0.0, inspiration, top, end, period + 1e-9], [0, 0, 1, 0, 0])
    return np.asarray(inward), np.asarray(outward)


@dataclass(frozen=True, kw_only=True, slots=True)
class BreathRuns:
    """One steady breath of each run.

    Parameters
    ----------
    time : (n_frames,), s from the onset of inspiration
    positions : (n, n_frames, n_markers, 3), m; not a number where the run failed
    lung_volume : (n, n_frames), m^3
    failed : (n,)
    """

    time: Floats
    positions: Floats
    lung_volume: Floats
    failed: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, slots=True)
class BreathSimulator:
    """Runs breaths of one torso at one timing.

    Parameters
    ----------
    torso : at rest
    posture : "upright" or "supine"
    attachments : markers
    inspiration_time, expiration_time, pause_time : s; the pause is part of the expiration
    rate : frames a second
    workers : threads; they change the speed, never a number
    bend : flexion, lateral bend to the left and twist to the left of the whole spine, rad, at the
        height of the inspiration; it comes and goes with the inspiratory muscles
    """

    torso: RestingTorso
    posture: str
    attachments: Attachments
    inspiration_time: float
    expiration_time: float
    pause_time: float
    rate: float
    workers: int
    bend: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def period(self) -> float:
        """Length of a breath, s."""
        return self.inspiration_time + self.expiration_time

    def activation(self, levels: Floats) -> Floats:
        """Activation of the muscle groups over two breaths.

        Parameters
        ----------
        levels : (4,), maximum levels

        Returns
        -------
        (n_steps, n_groups)
        """
        inward, outward = self._waves()
        shape = np.stack([inward, inward, outward, outward], axis=1)
        return group_activation(shape * levels, self.torso.torso.parameters)

    def spine(self) -> Floats | None:
        """Rotation vectors of the spine's joints over two breaths, (n_steps, 8, 3) rad, if any."""
        if not any(self.bend):
            return None
        inward, _ = self._waves()
        ways = ("flexion", "lateral", "twist")
        return spine_bend(
            **{way: angle * inward for way, angle in zip(ways, self.bend, strict=True)}
        )

    def _waves(self) -> tuple[Floats, Floats]:
        time = np.arange(2 * round(self.period / BREATH_STEP), dtype=np.float64) * BREATH_STEP
        return sawtooth(
            time,
            inspiration=self.inspiration_time,
            expiration=self.expiration_time,
            pause=self.pause_time,
        )

    def trajectory(self, levels: Floats) -> Trajectory:
        """Two breaths from rest, the second of them steady."""
        return simulate(
            self.torso,
            self.activation(levels),
            posture=self.posture,
            rate=self.rate,
            bend=self.spine(),
        )

    def run(self, levels: Floats) -> BreathRuns:
        """Run breaths for many levels.

        Parameters
        ----------
        levels : (n, 4), in [0, 1], in the order of `sim.simulate.LEVELS`
        """
        self.torso.rest(self.posture)
        batch = np.atleast_2d(np.asarray(levels, dtype=float))
        with ThreadPoolExecutor(max_workers=self.workers) as pool:
            found = list(pool.map(self._one, batch))
        time = np.arange(round(self.period * self.rate)) / self.rate
        shape = (len(batch), len(time), len(self.attachments.face), 3)
        positions, volume = np.full(shape, np.nan), np.full(shape[:2], np.nan)
        for k, run in enumerate(found):
            if run is not None:
                positions[k], volume[k] = run
        failed = np.array([run is None for run in found])
        return BreathRuns(time=time, positions=positions, lung_volume=volume, failed=failed)

    def _one(self, levels: Floats) -> tuple[Floats, Floats] | None:
        try:
            trajectory = self.trajectory(levels)
        except UnstableSimulation:
            return None
        n = round(self.period * self.rate)
        markers = marker_places(self.attachments, skin_frames(self.torso, trajectory))
        wanted = self.period + np.arange(n) / self.rate
        flat = markers.reshape(len(markers), -1)
        out = np.stack([np.interp(wanted, trajectory.time, c) for c in flat.T], axis=1)
        volume = np.interp(wanted, trajectory.time, trajectory.lung)
        return out.reshape(n, *markers.shape[1:]), volume
