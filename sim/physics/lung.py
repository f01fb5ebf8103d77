"""Lung recoil, airway and the implicit update of the gas in the lung."""

from __future__ import annotations

import math

from sim.physics.compiled import compiled


@compiled
def recoil_pressure(volume: float, limit: float, scale: float, rate: float) -> float:
    """Elastic recoil of the lung, V = limit - scale * exp(-rate * P).

    Parameters
    ----------
    volume : lung volume, m^3
    limit, scale : m^3
    rate : 1/Pa

    Returns
    -------
    Pa, positive when the lung pulls inwards

    Notes
    -----
    The exponential is followed up to 98 % of the way to `limit` and continued by its tangent.
    """
    gap = limit - volume
    least = 0.02 * scale
    if gap < least:
        return (-math.log(least / scale) + (least - gap) / least) / rate
    return -math.log(gap / scale) / rate


@compiled
def recoil_stiffness(volume: float, limit: float, scale: float, rate: float) -> float:
    """Slope of `recoil_pressure`, Pa/m^3."""
    return 1.0 / (rate * max(limit - volume, 0.02 * scale))


@compiled
def outflow(
    gas: float, volume: float, step: float, atmosphere: float, k1: float, k2: float, cap: float
) -> float:
    """Flow out of the lung at the end of a step, solved in closed form.

    The alveolar pressure after the step, (gas - step * atmosphere * Q) / volume - atmosphere,
    drives the flow through a Rohrer resistance, k1 Q + k2 Q |Q|; both meet in a quadratic.

    Parameters
    ----------
    gas : pressure times volume of the gas, Pa m^3
    volume : lung volume at the end of the step, m^3
    step : s
    atmosphere : Pa
    k1, k2 : Pa s/m^3, Pa s^2/m^6
    cap : largest expiratory flow, m^3/s

    Returns
    -------
    m^3/s, positive out
    """
    drive = gas / volume - atmosphere
    linear = k1 + step * atmosphere / volume
    size = abs(drive)
    if k2 > 0.0:
        flow = 2.0 * size / (linear + math.sqrt(linear * linear + 4.0 * k2 * size))
    else:
        flow = size / linear
    return min(flow, cap) if drive > 0.0 else -flow


@compiled
def alveolar_stiffness(
    gas: float, volume: float, flow: float, step: float, atmosphere: float, k1: float, k2: float,
    cap: float,
) -> float:  # fmt: skip
    """Fall of the alveolar pressure with lung volume within one step, Pa/m^3, positive.

    Where the flow is at its cap it does not answer to the pressure: the gas is shut in.

    Parameters
    ----------
    gas, volume, step, atmosphere, k1, k2, cap : as in `outflow`
    flow : what `outflow` gives, m^3/s
    """
    absolute = (gas - step * atmosphere * flow) / volume
    if flow >= cap:
        return absolute / volume
    resistance = k1 + 2.0 * k2 * abs(flow)
    return resistance * (absolute / volume) / (resistance + step * atmosphere / volume)


@compiled
def flow_cap(volume: float, residual: float, total: float, peak: float) -> float:
    """Expiratory flow that volume allows: nothing at RV, peak flow from 85 % of VC on.

    Parameters
    ----------
    volume, residual, total : lung volume, RV and TLC, m^3
    peak : peak expiratory flow, m^3/s
    """
    share = (volume - residual) / (0.85 * (total - residual))
    return peak * min(1.0, max(share, 1e-3))
