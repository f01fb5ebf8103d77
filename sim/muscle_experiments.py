"""The experiments of dilorenzo2009 section 4.3 on one muscle, and the error of the step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.muscle_rig import CONTRACTED, LAWS, RELAXED, Motion, hanging_length, make_muscle, move
from sim.physics.muscle import force_length, force_velocity, passive_shape
from sim.physics.one_muscle import EULER, IMPLICIT, RUNGE_KUTTA, Muscle
from sim.physics.types import Floats
from sim.tables import Parameters, parameters

STEPS = np.array([4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4])
"""s, of the convergence runs."""
FINE = 1.0 / 65536.0
"""s, step of the reference."""
SPAN = 2.0
"""s after activation over which errors of the step are taken."""
SCHEMES = {"linearly implicit": IMPLICIT, "explicit Euler": EULER}


@dataclass(frozen=True, kw_only=True, slots=True)
class Convergence:
    """Error of a scheme against its step.

    Parameters
    ----------
    law, scheme : their names
    step : (n,), s
    error : (n,), largest distance from the reference over the rest length; inf if it diverged
    """

    law: str
    scheme: str
    step: Floats
    error: Floats

    @property
    def order(self) -> float:
        """Slope of log error against log step at the four finest steps."""
        return float(np.polyfit(np.log(self.step[-4:]), np.log(self.error[-4:]), 1)[0])


@dataclass(frozen=True, kw_only=True, slots=True)
class HillCurves:
    """Curves of Fig. 4.2 and what belongs to them.

    Parameters
    ----------
    ratio : (n,), length over optimum; `active` and `passive` are over F_max and k_PE
    rate : (m,), speed over its maximum, positive while lengthening
    printed, lengthening : (m,), force over isometric: as printed, and with the lengthening branch
    """

    ratio: Floats
    active: Floats
    passive: Floats
    rate: Floats
    printed: Floats
    lengthening: Floats


def commands(law: str, numbers: Parameters, step: float) -> Floats:
    """(n_steps,), rest, full activation, rest."""
    time = np.arange(round(numbers["activation_end"] / step)) * step
    half = 0.5 * step  # a switch falls on a step whatever rounding says
    on = (time > numbers["activated_at"] - half) & (time < numbers["deactivated_at"] - half)
    return np.where(on, CONTRACTED[law], RELAXED[law])


def longest(muscle: Muscle) -> float:
    """m, longer than a muscle at rest under its particle ever is."""
    return 1.5 * muscle.rest


def activation_run(law: str, numbers: Parameters, *, eccentric: float = 0.0) -> Motion:
    """Rest, full activation, rest again (Figs. 4.3 to 4.5)."""
    muscle = make_muscle(law, numbers, eccentric=eccentric)
    start = hanging_length(muscle, RELAXED[law], muscle.rest, longest(muscle))
    step = numbers["step"]
    return move(muscle, commands(law, numbers, step), start=start, step=step)


def release_run(law: str, numbers: Parameters, *, loaded: bool) -> Motion:
    """Held at half strength and let go (Figs. 4.6 and 4.7).

    Parameters
    ----------
    loaded : the particle keeps its weight; else it has inertia only
    """
    muscle, step = make_muscle(law, numbers, loaded=loaded), numbers["step"]
    command = np.full(round(numbers["release_end"] / step), numbers["half_strength"])
    return move(muscle, command, start=muscle.rest, step=step, held=numbers["released_at"])


def hill_curves(numbers: Parameters) -> HillCurves:
    """Fig. 4.2, the passive curve, and the lengthening branch of the calibrated set."""
    p = parameters()
    width, curvature, eccentric = p["hill_width"], p["hill_curvature"], p["eccentric_force"]
    ratio, rate = np.linspace(0.4, 1.6, 241), np.linspace(-1.0, 1.0, 201)
    return HillCurves(
        ratio=ratio,
        active=np.array([force_length(r, width) for r in ratio]),
        passive=np.array([passive_shape(r)[0] for r in ratio]),
        rate=rate,
        printed=np.array([force_velocity(v, curvature, 0.0) for v in rate]),
        lengthening=np.array([force_velocity(v, curvature, eccentric) for v in rate]),
    )


def _activated(muscle: Muscle, law: str, start: float, step: float, scheme: int) -> Floats:
    command = np.full(round(SPAN / step), CONTRACTED[law])
    return move(muscle, command, start=start, step=step, scheme=scheme).place


def convergence(law: str, numbers: Parameters, scheme: str) -> Convergence:
    """Errors of a scheme on the activation against a fourth-order reference with fine steps."""
    muscle = make_muscle(law, numbers)
    start = hanging_length(muscle, RELAXED[law], muscle.rest, longest(muscle))
    fine = _activated(muscle, law, start, FINE, RUNGE_KUTTA)
    time = np.arange(len(fine)) * FINE
    errors = []
    for step in STEPS:
        place = _activated(muscle, law, start, step, SCHEMES[scheme])
        gap = place - np.interp(np.arange(len(place)) * step, time, fine)
        errors.append(float(np.nan_to_num(np.abs(gap).max(), nan=np.inf)) / muscle.rest)
    return Convergence(law=law, scheme=scheme, step=STEPS, error=np.array(errors))


def all_convergence(numbers: Parameters) -> list[Convergence]:
    """Both laws, both schemes."""
    return [convergence(law, numbers, scheme) for law in LAWS for scheme in SCHEMES]
