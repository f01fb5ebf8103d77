"""The papers' lung: gas between lung and chest wall, nothing acts back on the torso.

dilorenzo2009, Eq. 6.1 to 6.4, with two things the print leaves out: the sign of the pressure drop,
without which the root has no value while air flows in, and an implicit solve, without which the
loop chatters.
"""

from __future__ import annotations

import math

from sim.physics.compiled import compiled
from sim.physics.types import Floats

ROUNDS = 60
"""Halvings of the bracket: to the last digit of a volume."""


@compiled
def pressure_drop(
    volume: float, chest: float, boyle: float, compliance: float, slack: float, atmosphere: float
) -> float:
    """Lung pressure over the atmosphere's, Pa (Eq. 6.1 and 6.2).

    Parameters
    ----------
    volume, chest : of lung and chest cavity, m^3
    boyle : pressure times volume of the gas between them, Pa m^3
    compliance, slack : slope, m^3/Pa, and volume at no pressure, m^3, of the transmural line
    atmosphere : Pa
    """
    return boyle / (chest - volume) + (volume - slack) / compliance - atmosphere


@compiled
def one_way_step(
    volume: float, chest: float, step: float, boyle: float, compliance: float, slack: float,
    k: float, atmosphere: float,
) -> float:  # fmt: skip
    """Lung volume after a step, m^3: V' + h Q(V') = V with Q = sign(dP) sqrt(|dP| / k).

    The left side grows with V', so bisection finds the only root.

    Parameters
    ----------
    volume : before the step, m^3
    chest : of the chest cavity after it, m^3
    k : Pa s^2/m^6 (Eq. 6.4)
    """
    low, high = 1e-9, chest * (1.0 - 1e-9)
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        drop = pressure_drop(middle, chest, boyle, compliance, slack, atmosphere)
        out = math.copysign(math.sqrt(abs(drop) / k), drop)
        if middle + step * out > volume:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@compiled
def one_way_start(
    chest: float, share: float, compliance: float, recoil: float, atmosphere: float
) -> tuple[float, float, float]:
    """Volume of the lung at the start, m^3, slack volume, m^3, and Boyle's constant, Pa m^3.

    Parameters
    ----------
    chest : volume of the chest cavity, m^3
    share : of it that the lung fills
    recoil : transmural pressure, Pa
    """
    volume = share * chest
    return volume, volume - compliance * recoil, (atmosphere - recoil) * (chest - volume)


@compiled
def one_way_follow(
    chest: Floats, step: float, volume: float, slack: float, boyle: float, compliance: float,
    k: float, atmosphere: float, out: Floats,
) -> None:  # fmt: skip
    """Follow a chest whose volume is known.

    Parameters
    ----------
    chest : (n,), volumes of the chest cavity at the end of each step, m^3
    volume : of the lung before the first step, m^3
    slack, boyle : of `one_way_start`
    out : (n, 4), lung volume, m^3, lung and pleural pressure over the atmosphere's, Pa, and flow
        out, m^3/s; written
    """
    for i in range(chest.shape[0]):
        before = volume
        volume = one_way_step(before, chest[i], step, boyle, compliance, slack, k, atmosphere)
        out[i, 0] = volume
        out[i, 1] = pressure_drop(volume, chest[i], boyle, compliance, slack, atmosphere)
        out[i, 2] = boyle / (chest[i] - volume) - atmosphere
        out[i, 3] = (before - volume) / step


@compiled
def one_way_run(
    chest: Floats, step: float, share: float, compliance: float, recoil: float, k: float,
    atmosphere: float, out: Floats,
) -> None:  # fmt: skip
    """Follow a chest from its start, the lung filling a share of it.

    Parameters
    ----------
    chest, out : as in `one_way_follow`
    share, recoil : as in `one_way_start`
    """
    volume, slack, boyle = one_way_start(chest[0], share, compliance, recoil, atmosphere)
    one_way_follow(chest, step, volume, slack, boyle, compliance, k, atmosphere, out)
