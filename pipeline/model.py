"""What a fit asks of a torso, and the real torso that answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sim.breaths import BreathSimulator
    from sim.model.torso import Subject
    from sim.resting import RestingTorso

Floats = NDArray[np.float64]

Bend = tuple[float, float, float]
NO_BEND: Bend = (0.0, 0.0, 0.0)
"""Flexion, lateral bend and twist of the whole spine, rad."""
GROUPS = ("external_intercostals", "diaphragm", "internal_intercostals", "abdomen")


class Surface(Protocol):
    """Skin at rest: vertices (n, 3) m, faces (m, 3)."""

    @property
    def vertices(self) -> Floats:
        """Give (n, 3), m."""
        ...

    @property
    def faces(self) -> NDArray[np.int64]:
        """Give (m, 3)."""
        ...


class Runs(Protocol):
    """One steady breath of each run, from its onset.

    time (n_frames,) s; positions (n, n_frames, n_markers, 3) m; lung_volume (n, n_frames) m3;
    failed (n,), where positions are NaN.
    """

    @property
    def time(self) -> Floats:
        """Give (n_frames,), s."""
        ...

    @property
    def positions(self) -> Floats:
        """Give (n, n_frames, n_markers, 3), m."""
        ...

    @property
    def lung_volume(self) -> Floats:
        """Give (n, n_frames), m3."""
        ...

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Give (n,)."""
        ...


class Simulator(Protocol):
    """Runs of one torso with its markers at one timing, the same for any number of workers."""

    def run(self, levels: Floats) -> Runs:
        """Run (n, 4) maximum levels in the order of `GROUPS`."""
        ...


class BreathModel(Protocol):
    """A torso of one subject that can be resized, looked at and run."""

    def surface(self, fit_scale: tuple[float, float, float], posture: str) -> Surface:
        """Skin at rest of the torso of this size."""
        ...

    def landmarks(self, fit_scale: tuple[float, float, float], posture: str) -> dict[str, Floats]:
        """Named points at rest, (3,) m each."""
        ...

    def simulator(
        self,
        fit_scale: tuple[float, float, float],
        posture: str,
        points: Floats,
        *,
        inspiration_time: float,
        expiration_time: float,
        pause_time: float,
        rate: float,
        bend: Bend = NO_BEND,
    ) -> Simulator:
        """Bind points (n, 3) m to the skin and make ready to run; times in s, rate in Hz.

        bend : of the spine at the height of the inspiration, rad
        """
        ...


@dataclass(kw_only=True, slots=True)
class TorsoModel:
    """`BreathModel` of the real torso.

    Parameters
    ----------
    workers : processes or threads for a batch of runs; never changes a number
    """

    subject: Subject
    workers: int
    _built: dict[tuple[float, float, float], RestingTorso] = field(default_factory=dict)

    def _torso(self, fit_scale: tuple[float, float, float]) -> RestingTorso:
        from sim.resting import rest_torso

        # a fit comes back to the same few sizes, and solving a rest costs as much as ten runs
        if fit_scale not in self._built:
            self._built[fit_scale] = rest_torso(self.subject, fit_scale=fit_scale)
        return self._built[fit_scale]

    def surface(self, fit_scale: tuple[float, float, float], posture: str) -> Surface:
        """Skin at rest of the torso of this size."""
        return self._torso(fit_scale).surface(posture)

    def landmarks(self, fit_scale: tuple[float, float, float], posture: str) -> dict[str, Floats]:
        """Named points at rest, (3,) m each."""
        return self._torso(fit_scale).landmarks(posture)

    def simulator(
        self,
        fit_scale: tuple[float, float, float],
        posture: str,
        points: Floats,
        *,
        inspiration_time: float,
        expiration_time: float,
        pause_time: float,
        rate: float,
        bend: Bend = NO_BEND,
    ) -> BreathSimulator:
        """Bind points (n, 3) m to the skin and make ready to run; times in s, rate in Hz."""
        from sim.breaths import BreathSimulator

        torso = self._torso(fit_scale)
        return BreathSimulator(
            torso=torso,
            posture=posture,
            attachments=torso.bind(points, posture),
            inspiration_time=inspiration_time,
            expiration_time=expiration_time,
            pause_time=pause_time,
            rate=rate,
            workers=self.workers,
            bend=bend,
        )
