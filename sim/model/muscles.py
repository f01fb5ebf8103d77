"""Muscle elements and passive tissue: where they attach and how strong they are.

Strength is cross-section times specific tension: the thickness of the layer
(`sim/data/muscle_layers.csv`) times the width of the strip that an element stands for.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.model.points import Points
from sim.physics.plant import Muscles, Tissue
from sim.physics.types import Ints
from sim.tables import Parameters, read_rows

MUSCLE_GROUPS = (
    "external_intercostals",
    "internal_intercostals",
    "parasternal_intercostals",
    "levatores_costarum",
    "scalenes",
    "diaphragm",
    "rectus",
    "external_oblique",
    "internal_oblique",
    "transversus",
    "erector_spinae",
    "shoulder_elevators",
    "shoulder_depressors",
    "shoulder_retractors",
    "serratus_anterior",
    "subclavius",
)


@dataclass(slots=True)
class MuscleList:
    """Elements under construction; handles are those of `Points`."""

    a: list[int] = field(default_factory=list)
    b: list[int] = field(default_factory=list)
    group: list[int] = field(default_factory=list)
    chain: list[int] = field(default_factory=list)
    width: list[float] = field(default_factory=list)
    share: list[float] = field(default_factory=list)
    n_chains: int = 0

    def add_chain(
        self, group: str, handles: list[int], widths: list[float], share: float = 1.0
    ) -> None:
        """Add one fibre through `handles`.

        Parameters
        ----------
        widths : of the strip that each element stands for, m
        share : neural drive over that of the group
        """
        for i in range(len(handles) - 1):
            self.a.append(handles[i])
            self.b.append(handles[i + 1])
            self.group.append(MUSCLE_GROUPS.index(group))
            self.chain.append(self.n_chains)
            self.width.append(widths[i])
            self.share.append(share)
        self.n_chains += 1


@dataclass(slots=True)
class TissueList:
    """Passive threads under construction."""

    a: list[int] = field(default_factory=list)
    b: list[int] = field(default_factory=list)
    stiffness: list[float] = field(default_factory=list)
    slack: list[float] = field(default_factory=list)
    """rest length over the length when built"""
    damping: list[float] = field(default_factory=list)
    pushes: list[int] = field(default_factory=list)
    curve: list[float] = field(default_factory=list)

    def add(
        self, a: int, b: int, stiffness: float, slack: float, time: float, pushes: int = 0,
        curve: float = 0.0,
    ) -> None:  # fmt: skip
        """Add a thread; `time` is damping over stiffness, s, `curve` as in `Tissue`."""
        self.pushes.append(pushes)
        self.curve.append(curve)
        self.a.append(a)
        self.b.append(b)
        self.stiffness.append(stiffness)
        self.slack.append(slack)
        self.damping.append(stiffness * time)


def layer_thickness() -> dict[str, float]:
    """Thickness of every group's layer, m."""
    return {
        row["group"]: float(row["thickness_mm"]) * 1e-3 for row in read_rows("muscle_layers.csv")
    }


def pack_muscles(points: Points, muscles: MuscleList, slots: dict[tuple[int, int], int],
                 parameters: Parameters) -> Muscles:  # fmt: skip
    """Arrays of the muscle elements in the calibrated Hill law."""
    layers = {row["group"]: row for row in read_rows("muscle_layers.csv")}
    a, b = points.resolve(muscles.a), points.resolve(muscles.b)
    x = points.places()
    length = np.linalg.norm(x[b] - x[a], axis=1)
    group, chain = np.array(muscles.group), np.array(muscles.chain)
    names = [MUSCLE_GROUPS[g] for g in group]
    of_layer = layer_thickness()
    thickness = np.array([of_layer[g] for g in names])
    optimum = np.array([float(layers[g]["frc_over_optimal"]) for g in names])
    passive = np.array([float(layers[g]["passive_share"]) for g in names])
    f_max = thickness * np.array(muscles.width) * parameters["specific_tension"]
    chain_rest = np.bincount(chain, length / optimum).astype(np.float64)
    count = np.bincount(chain).astype(float)
    speed = np.zeros(len(count))
    speed[chain] = [float(layers[g]["v_max_per_s"]) for g in names]
    return Muscles(
        a=a, b=b, group=group.astype(np.int64), chain=chain.astype(np.int64),
        slot=_slots(a, b, slots), share=np.array(muscles.share), rest=length / optimum,
        f_max=f_max,
        k_pe=passive * f_max, b_pe=parameters["passive_damping_time"] * passive * f_max,
        chain_rest=chain_rest, chain_count=count, chain_v_max=speed,
    )  # fmt: skip


def pack_tissue(points: Points, tissue: TissueList, slots: dict[tuple[int, int], int]) -> Tissue:
    """Arrays of the passive threads."""
    a, b = points.resolve(tissue.a), points.resolve(tissue.b)
    x = points.places()
    length = np.linalg.norm(x[b] - x[a], axis=1)
    return Tissue(
        a=a, b=b, slot=_slots(a, b, slots), rest=length * np.array(tissue.slack),
        stiffness=np.array(tissue.stiffness), damping=np.array(tissue.damping),
        pushes=np.array(tissue.pushes, dtype=np.int64), curve=np.array(tissue.curve),
    )  # fmt: skip


def _slots(a: Ints, b: Ints, slots: dict[tuple[int, int], int]) -> Ints:
    pairs = zip(np.minimum(a, b).tolist(), np.maximum(a, b).tolist(), strict=True)
    return np.array([slots.get(pair, -1) for pair in pairs], dtype=np.int64)
