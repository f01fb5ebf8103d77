"""Muscle elements and passive tissue: where they attach; `strengths` says how strong they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sim.model.points import Points
from sim.model.strengths import element_strengths
from sim.model.wall_regions import Region
from sim.physics.plant import Muscles, Tissue
from sim.physics.types import Ints
from sim.tables import Parameters

MUSCLE_GROUPS = (
    "external_intercostals",
    "internal_intercostals",
    "parasternal_intercostals",
    "levatores_costarum",
    "scalenes",
    "sternocleidomastoid",
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
    """Elements under construction; handles are those of `Points`.

    Parameters
    ----------
    groups : that the parameter set has, those that some level drives (`levels.csv`)
    region : of the wall that an element lies in (`wall_regions.csv`), "" elsewhere
    """

    groups: frozenset[str] = frozenset(MUSCLE_GROUPS)
    a: list[int] = field(default_factory=list)
    b: list[int] = field(default_factory=list)
    group: list[int] = field(default_factory=list)
    chain: list[int] = field(default_factory=list)
    width: list[float] = field(default_factory=list)
    share: list[float] = field(default_factory=list)
    late: list[float] = field(default_factory=list)
    region: list[str] = field(default_factory=list)
    n_chains: int = 0

    def add_chain(
        self,
        group: str,
        handles: list[int],
        widths: list[float],
        share: float = 1.0,
        regions: Sequence[Region] = (),
        late: float = 0.0,
    ) -> None:
        """Add one fibre through `handles`.

        Parameters
        ----------
        widths : of the strip that each element stands for, m
        share : neural drive over that of the group
        regions : of the wall, one an element, whose shares come on top; none elsewhere
        late : what comes on top of `share` in a maximal effort
        """
        for i in range(len(handles) - 1):
            self.a.append(handles[i])
            self.b.append(handles[i + 1])
            self.group.append(MUSCLE_GROUPS.index(group))
            self.chain.append(self.n_chains)
            self.width.append(widths[i])
            self.share.append(share * (regions[i].share if regions else 1.0))
            self.late.append(late)
            self.region.append(regions[i].name if regions else "")
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


def pack_muscles(
    points: Points,
    muscles: MuscleList,
    slots: dict[tuple[int, int], int],
    sex: str,
    parameters: Parameters,
) -> Muscles:
    """Arrays of the muscle elements in the Hill law."""
    a, b = points.resolve(muscles.a), points.resolve(muscles.b)
    x = points.places()
    group, chain = np.array(muscles.group), np.array(muscles.chain)
    if parameters["separate_elements"]:
        chain = np.arange(len(chain))
    names = [MUSCLE_GROUPS[g] for g in group]
    strength = element_strengths(names, muscles.region, np.array(muscles.width), sex, parameters)
    rest = np.linalg.norm(x[b] - x[a], axis=1) / strength.optimum
    count = np.bincount(chain).astype(float)
    speed = np.zeros(len(count))
    speed[chain] = strength.v_max
    return Muscles(
        a=a, b=b, group=group.astype(np.int64), chain=chain.astype(np.int64),
        slot=_slots(a, b, slots), share=np.array(muscles.share),
        late=np.array(muscles.late), rest=rest,
        f_max=strength.f_max, k_pe=strength.k_pe, b_pe=strength.b_pe,
        chain_rest=np.bincount(chain, rest).astype(np.float64), chain_count=count,
        chain_v_max=speed,
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
