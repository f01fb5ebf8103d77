"""Tension of one muscle element: the spring law and the Hill law behind one call.

A chain of elements in series shares the length and the speed of the whole fibre in its active
factors, so that one stretched link cannot run away from its neighbours.
"""

from __future__ import annotations

from sim.physics.compiled import compiled, inner

HILL = 0
SPRING = 1

PASSIVE_SHAPE = 10.0
"""Exponent of the passive curve per unit of strain (dilorenzo2009, ch. 4.2)."""


@compiled
def force_length(ratio: float, width: float) -> float:
    """Active force-length factor in [0, 1] (dilorenzo2009, Fig. 4.2a).

    Parameters
    ----------
    ratio : fibre length over optimal length
    width : half width of the parabola, 0.5 as printed
    """
    return max(0.0, 1.0 - ((ratio - 1.0) / width) ** 2)


@compiled
def force_velocity(rate: float, curvature: float, eccentric: float) -> float:
    """Force-velocity factor; 1 at rest (dilorenzo2009, Fig. 4.2b).

    Parameters
    ----------
    rate : fibre speed over its maximum, positive while lengthening
    curvature : a = b of Hill's hyperbola, 0.25 as printed
    eccentric : force of a lengthening muscle over isometric; 0 means the printed law, which
        uses the absolute speed and so weakens a stretched muscle as well
    """
    speed = abs(rate)
    if rate > 0.0 and eccentric > 0.0:
        # The same slope on both sides of rest keeps the law smooth and its damping positive.
        half = (eccentric - 1.0) * curvature / (1.0 + curvature)
        return 1.0 + (eccentric - 1.0) * speed / (speed + half)
    return max(0.0, (curvature - curvature * speed) / (curvature + speed))


@compiled
def active_factor(
    ratio: float, rate: float, width: float, curvature: float, eccentric: float
) -> float:
    """Product of the force-length and force-velocity factors of a whole fibre."""
    return force_length(ratio, width) * force_velocity(rate, curvature, eccentric)


@compiled
def active_slopes(
    ratio: float, width: float, curvature: float, v_max: float
) -> tuple[float, float]:
    """Bounds on the stiffness and damping of the active part, per unit of its full force.

    The steepest slope of the force-velocity curve stands for its slope: an implicit step is
    stable with a matrix that is too large, never with one too small.

    Parameters
    ----------
    ratio : fibre length over optimal length
    v_max : 1/s

    Returns
    -------
    per unit of strain, and s: per unit of strain rate
    """
    steepest = (1.0 + curvature) / curvature
    stiffness = max(0.0, -2.0 * (ratio - 1.0) / width**2)
    return stiffness, force_length(ratio, width) * steepest / v_max


@inner
def exponential(power: float) -> float:
    """e^power for a power in [-22, 4], to 1e-11 of itself, by series, scaling and squaring.

    No branch, no table and no call, so a loop over elements computes several at a time.
    """
    z = power * (1.0 / 32.0)
    s = 1.0 + z * (1.0 / 13.0)
    for k in range(12, 0, -1):
        s = 1.0 + z * s * (1.0 / k)
    for _ in range(5):
        s *= s
    return s


@compiled
def passive_shape(ratio: float) -> tuple[float, float]:
    """Passive curve e^(10 (l - 1)) / e^5 and its slope.

    Past a strain of one half, where the printed curve ends, it goes on along its tangent: an
    exponential there would outrun any step size.

    Parameters
    ----------
    ratio : element length over optimal length, not negative
    """
    past = max(0.0, ratio - 1.5)
    value = exponential(PASSIVE_SHAPE * (ratio - past - 1.0) - 0.5 * PASSIVE_SHAPE)
    return value * (1.0 + PASSIVE_SHAPE * past), value * PASSIVE_SHAPE


@compiled
def hill_tension(
    drive: float,
    ratio: float,
    strain_rate: float,
    f_max: float,
    k_pe: float,
    b_pe: float,
) -> float:
    """Tension of a Hill element, N, never negative (dilorenzo2009, ch. 4.2).

    Parameters
    ----------
    drive : activation, in [0, 1], times `active_factor` of the fibre
    ratio : element length over its optimal length
    strain_rate : 1/s, positive while lengthening
    f_max : maximal isometric force, N
    k_pe : passive force at a strain of one half, N
    b_pe : passive damping, N s
    """
    passive = k_pe * passive_shape(ratio)[0] + b_pe * strain_rate
    return max(0.0, passive) + drive * f_max


@compiled
def spring_tension(
    activation: float,
    length: float,
    rate: float,
    rest_length: float,
    contraction_ratio: float,
    k_ac: float,
    k_pe: float,
    damping: float,
) -> float:
    """Tension of a spring element, N, never negative (dilorenzo2009, Eq. 4.2).

    Parameters
    ----------
    activation : in [0, 1]
    length, rest_length : m
    rate : m/s, positive while lengthening
    contraction_ratio : rest length that the active spring aims at, over `rest_length`
    k_ac, k_pe : active and passive stiffness, N/m
    damping : N s/m
    """
    active = activation * k_ac * (length - contraction_ratio * rest_length)
    return max(0.0, active + k_pe * (length - rest_length) + damping * rate)
