"""The two cavities: the lung in the chest and the contents of the abdomen press on their walls."""

from __future__ import annotations

import numpy as np

from sim.physics import lung
from sim.physics.compiled import compiled, inner
from sim.physics.plant import Constants, Plant
from sim.physics.surface import press, push, volume_and_normals
from sim.physics.types import Floats
from sim.physics.work import Work


@compiled
def lung_pressures(
    k: Constants, gas: float, chest: float, larynx: float, step: float, out: Floats
) -> tuple[float, float]:
    """Pressures and flow at the end of a step with a given chest volume.

    Parameters
    ----------
    chest : volume of the chest cavity, m^3
    larynx : resistance of the larynx on top of the open airway's, Pa s/m^3
    out : (4,), lung volume, alveolar and pleural pressure, flow out; written

    Returns
    -------
    gas left and the fall of pleural pressure with volume, Pa/m^3
    """
    volume = chest - k.tissue_volume
    cap = lung.flow_cap(volume, k.residual_volume, k.total_capacity, k.peak_flow)
    k1 = k.airway_k1 + larynx
    flow = lung.outflow(gas, volume, step, k.atmosphere, k1, k.airway_k2, cap)
    left = gas - step * k.atmosphere * flow
    alveolar = left / volume - k.atmosphere
    recoil = lung.recoil_pressure(volume, k.lung_limit, k.lung_scale, k.lung_rate)
    stiffness = lung.recoil_stiffness(volume, k.lung_limit, k.lung_scale, k.lung_rate)
    stiffness += lung.alveolar_stiffness(
        gas, volume, flow, step, k.atmosphere, k1, k.airway_k2, cap
    )
    out[0], out[1], out[2], out[3] = volume, alveolar, alveolar - recoil, flow
    return left, stiffness


@inner
def add_cavities(
    plant: Plant,
    work: Work,
    gravity: Floats,
    held_pleural: float,
    gas: float,
    larynx: float,
    step: float,
    out: Floats,
) -> tuple[float, float, float]:
    """Forces of the two cavities.

    Parameters
    ----------
    gravity : (3,), m/s^2
    held_pleural : Pa; if not NaN the pleural pressure is held at it and the lung left out
    gas : pressure times volume of the gas in the lung, Pa m^3
    larynx : its resistance, Pa s/m^3
    out : (7,), volumes of lung, chest, abdomen; alveolar, pleural, abdominal pressure; flow

    Returns
    -------
    gas left; stiffness of the abdomen and of the chest, Pa/m^3
    """
    k, x = plant.constants, work.x
    chest = volume_and_normals(x, plant.chest_faces, work.chest_normal)
    belly = volume_and_normals(x, plant.abdomen_faces, work.abdomen_normal)
    lungs = np.empty(4)
    left, chest_stiffness = lung_pressures(k, gas, chest, larynx, step, lungs)
    if not np.isnan(held_pleural):
        left, chest_stiffness, lungs[2] = gas, 0.0, held_pleural
    pressure = k.bulk_modulus * (k.abdomen_volume / belly - 1.0)
    weight = k.content_density * gravity
    press(x, plant.chest_faces, work.chest_normal, lungs[2], np.zeros(3), work.f)
    origin = pressure - np.dot(weight, plant.reference)
    if k.no_suction:
        push(x, plant.abdomen_faces, work.abdomen_normal, origin, weight, work.f)
    else:
        press(x, plant.abdomen_faces, work.abdomen_normal, origin, weight, work.f)
    out[0], out[1], out[2] = lungs[0], chest, belly
    out[3], out[4], out[5], out[6] = lungs[1], lungs[2], pressure, lungs[3]
    return left, k.bulk_modulus * k.abdomen_volume / belly**2, chest_stiffness
