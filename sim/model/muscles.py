"""Muscle elements and passive tissue: where they attach and how strong they are.

Strength is cross-section times specific tension: the thickness of the layer
(`sim/data/muscle_layers.csv`) times the width of the strip that an element stands for.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.model.anatomy import SIDES, Anatomy
from sim.model.cavity import FREE_FROM, Cavity
from sim.model.mesh import along
from sim.model.points import Points
from sim.model.skeleton import cartilage_line, segment_of
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

    def add(
        self, a: int, b: int, stiffness: float, slack: float, time: float, pushes: int = 0
    ) -> None:
        """Add a thread; `time` is damping over stiffness, s."""
        self.pushes.append(pushes)
        self.a.append(a)
        self.b.append(b)
        self.stiffness.append(stiffness)
        self.slack.append(slack)
        self.damping.append(stiffness * time)


class IntercostalBuilder:
    """Strings the external and internal intercostals between the ribs."""

    def __init__(
        self,
        points: Points,
        muscles: MuscleList,
        body: dict[str, int],
        anatomy: Anatomy,
        parameters: Parameters,
    ) -> None:
        self.points, self.muscles, self.body = points, muscles, body
        self.anatomy, self.parameters = anatomy, parameters
        self.drive = {row["group"]: row for row in read_rows("drive_map.csv")}

    def build(self) -> None:
        """Add every space of both sides."""
        for side in (0, 1):
            for upper in range(1, 12):
                self._space(side, upper, "external_intercostals", 1.0, 0.06, 0.97)
                self._space(side, upper, "internal_intercostals", -1.0, 0.22, 1.0)
                if upper <= 6:
                    self._parasternal(side, upper)
                self._levator(side, upper)
            self._scalenes(side)
            self._erector(side)

    def _levator(self, side: int, upper: int) -> None:
        """From the transverse process of a vertebra to the angle of the rib below."""
        sign = 1.0 if side == 0 else -1.0
        top = self.anatomy.spine[f"T{upper}"] + np.array([-0.025, sign * 0.028, 0.0])
        low = along(self.anatomy.rib[side, upper], np.array([0.14]))[0]
        handles = [
            self.points.add(self.body[segment_of(f"T{upper}")], top),
            self.points.add(self.body[f"rib_{SIDES[side]}{upper + 1}"], low),
        ]
        share = self._drive("levatores_costarum", upper, 0.0)
        width = self.parameters["levator_width"]
        self.muscles.add_chain("levatores_costarum", handles, [width], share)

    def _scalenes(self, side: int) -> None:
        """Lines from the neck to the first two ribs."""
        sign = 1.0 if side == 0 else -1.0
        for level, rib, u in (("C4", 1, 0.6), ("C6", 1, 0.4), ("C5", 1, 0.5), ("C5", 2, 0.35)):
            top = self.anatomy.spine[level] + np.array([0.0, sign * 0.025, 0.0])
            low = along(self.anatomy.rib[side, rib - 1], np.array([u]))[0]
            handles = [
                self.points.add(self.body["C4-C7"], top),
                self.points.add(self.body[f"rib_{SIDES[side]}{rib}"], low),
            ]
            self.muscles.add_chain("scalenes", handles, [self.parameters["scalene_width"]])

    def _erector(self, side: int) -> None:
        """Thoracic part of the erector spinae, over the tips of the spinous processes."""
        sign = 1.0 if side == 0 else -1.0
        handles = []
        for level in ("L2", "T10", "T7", "T3", "C6"):
            tip = self.anatomy.process[level] + np.array([0.0, sign * 0.02, 0.0])
            handles.append(self.points.add(self.body[segment_of(level)], tip))
        widths = [self.parameters["erector_width"]] * (len(handles) - 1)
        self.muscles.add_chain("erector_spinae", handles, widths)

    def _space(
        self, side: int, upper: int, group: str, lean: float, start: float, end: float
    ) -> None:
        """Elements from a rib to the next, the lower end `lean` ventral (1) or dorsal (-1).

        An element leans by as much as the space is high, so that the two layers cross at a
        right angle.
        """
        n = int(self.parameters["intercostals_per_space"])
        above, below = self.anatomy.rib[side, upper - 1], self.anatomy.rib[side, upper]
        lengths = [float(np.linalg.norm(np.diff(r, axis=0), axis=1).sum()) for r in (above, below)]
        fine = along(below, np.linspace(0.0, 1.0, 201))
        for u in np.linspace(start, end, n):
            top = along(above, np.array([u]))[0]
            nearest = int(np.argmin(np.linalg.norm(fine - top, axis=1)))
            height = float(np.linalg.norm(fine[nearest] - top))
            v = nearest / 200.0 + lean * height / lengths[1]
            if not 0.02 <= v <= 1.0:
                continue
            low = along(below, np.array([v]))[0]
            names = [f"rib_{SIDES[side]}{upper + k}" for k in (0, 1)]
            handles = [self.points.add(self.body[names[0]], top)]
            handles.append(self.points.add(self.body[names[1]], low))
            step = (end - start) * lengths[0] / (n - 1)
            share = self._drive(group, upper, u)
            self.muscles.add_chain(group, handles, [step * np.sqrt(0.5)], share)

    def _drive(self, group: str, space: int, along: float) -> float:
        """Neural drive by interspace and by place along the rib, from `drive_map.csv`."""
        row = self.drive[group]
        slope = (space - float(row["space_full"])) / (
            float(row["space_none"]) - float(row["space_full"])
        )
        by_space = max(float(row["least"]), min(1.0, 1.0 - slope))
        return by_space * max(0.0, 1.0 - float(row["ventral_loss"]) * along)

    def _parasternal(self, side: int, upper: int) -> None:
        """Internal fibres between the cartilages: from the sternum down and sideways."""
        n = int(self.parameters["parasternals_per_space"])
        letter = SIDES[side]
        ends = [cartilage_line(self.anatomy, side, upper + k) for k in (0, 1)]
        names = []
        for rib in (upper, upper + 1):
            part = f"cartilage_{letter}{rib}" if rib < 6 else f"cartilage_{letter}6-10"
            names.append("sternum" if rib == 1 else part)
        for u in np.linspace(0.05, 0.7, n):
            top = ends[0][1] + u * (ends[0][0] - ends[0][1])
            low = ends[1][1] + min(u + 0.3, 1.0) * (ends[1][0] - ends[1][1])
            if self.body[names[0]] == self.body[names[1]]:
                continue
            handles = [
                self.points.add(self.body[names[0]], top),
                self.points.add(self.body[names[1]], low),
            ]
            width = 0.65 * float(np.linalg.norm(ends[0][0] - ends[0][1])) / n
            self.muscles.add_chain("parasternal_intercostals", handles, [width])


class SheetBuilder:
    """Fibres and tissue of the diaphragm and the belly wall."""

    def __init__(
        self,
        points: Points,
        muscles: MuscleList,
        tissue: TissueList,
        cavity: Cavity,
        parameters: Parameters,
    ) -> None:
        self.points, self.muscles, self.tissue = points, muscles, tissue
        self.cavity, self.parameters = cavity, parameters

    def _gap(self, a: int, b: int) -> float:
        return float(np.linalg.norm(self.points.at(a) - self.points.at(b)))

    def diaphragm(self) -> None:
        """Fibres from the rim to the tendon; weak tissue around and across them."""
        grid, p = self.cavity.diaphragm, self.parameters
        n = len(grid)
        modulus = p["diaphragm_modulus"] * p["diaphragm_thickness"]
        time, slack = p["tissue_time"], p["diaphragm_slack"]
        for j, column in enumerate(grid):
            left, right = grid[(j + 1) % n], grid[j - 1]
            widths = []
            for i in range(len(column) - 1):
                spread = [0.5 * self._gap(left[k], right[k]) for k in (i, i + 1)]
                widths.append(0.5 * (spread[0] + spread[1]))
            # One tension runs through a fibre, so its strip has one strength: the mean.
            self.muscles.add_chain("diaphragm", column, [float(np.mean(widths))] * len(widths))
            for i in range(1, len(column) - 1):
                along = self._gap(column[i], column[i + 1])
                self.tissue.add(column[i], left[i], modulus * along / self._gap(column[i], left[i]),
                                slack, time, 1)  # fmt: skip
            for i in range(len(column) - 1):
                k = 0.3 * modulus
                self.tissue.add(column[i], left[i + 1], k, slack, time, 1)
                self.tissue.add(left[i], column[i + 1], k, slack, time, 1)

    def crura(self, spine: int) -> None:
        """Tie the midline fibres of the back to the vertebral column, body `spine`."""
        for handle in self.cavity.diaphragm[0][1:-2]:
            anchor = self.points.add(spine, self.points.at(handle) + np.array([-1e-3, 0.0, 0.0]))
            self.tissue.add(anchor, handle, self.parameters["crus_stiffness"], 1.0,
                            self.parameters["tissue_time"], 1)  # fmt: skip

    def wall(self) -> None:
        """Rectus, obliques and transversus in series over the wall, and its passive membrane."""
        grid, half = self.cavity.wall, self.cavity.rim_half
        n = len(grid)
        self._membrane(grid, n)
        for j in range(n):
            k = j if j < half else n - j
            if k >= half - 2:
                rows = grid[j]
                width = 0.5 * sum(self._gap(grid[j][4], grid[(j + s) % n][4]) for s in (-1, 1))
                self.muscles.add_chain("rectus", rows, [width] * (len(rows) - 1))
        for columns in self._flanks(half, n):
            self._flank(grid, columns)

    def _flanks(self, half: int, n: int) -> list[list[int]]:
        """Columns of the lateral wall, back to front, left and right."""
        left = list(range(FREE_FROM - 1, half - 2))
        return [left, [(n - j) % n for j in left]]

    def _flank(self, grid: list[list[int]], columns: list[int]) -> None:
        rows = len(grid[0])
        height = self._gap(grid[columns[4]][0], grid[columns[4]][-1]) / (rows - 1)
        for i in range(1, rows - 1):
            line = [grid[j][i] for j in columns]
            self.muscles.add_chain("transversus", line, [height] * (len(line) - 1))
        for start in range(-(rows - 2), len(columns) - 1):
            down = [(k, k - start) for k in range(len(columns)) if 0 <= k - start < rows]
            up = [(k, rows - 1 - k + start) for k in range(len(columns))]
            up = [(k, i) for k, i in up if 0 <= i < rows]
            for group, path in (("external_oblique", down), ("internal_oblique", up)):
                line = [grid[columns[k]][i] for k, i in path]
                if len(line) >= 3:
                    self._oblique(grid, columns, group, path, line)

    def _oblique(
        self,
        grid: list[list[int]],
        columns: list[int],
        group: str,
        path: list[tuple[int, int]],
        line: list[int],
    ) -> None:
        widths = []
        for (k, i), a, b in zip(path[:-1], line[:-1], line[1:], strict=True):
            across = self._gap(a, grid[columns[k + 1]][i])
            down = self._gap(a, grid[columns[k]][min(i + 1, len(grid[0]) - 1)])
            down = down or self._gap(a, grid[columns[k]][i - 1])
            widths.append(across * down / max(self._gap(a, b), 1e-4))
        width = min(float(np.mean(widths)), self.parameters["widest_strip"])
        self.muscles.add_chain(group, line, [width] * (len(line) - 1))

    def _membrane(self, grid: list[list[int]], n: int) -> None:
        p = self.parameters
        thick, time = p["belly_thickness"], p["tissue_time"]
        across, along = p["belly_modulus_transverse"] * thick, p["belly_modulus_sagittal"] * thick
        rows = len(grid[0])
        for j in range(n):
            here, left = grid[j], grid[(j + 1) % n]
            for i in range(rows - 1):
                wide = self._gap(here[i], left[i])
                tall = self._gap(here[i], here[i + 1])
                if min(here[i], here[i + 1]) < 0:
                    self.tissue.add(here[i], here[i + 1], along * wide / tall,
                                    p["belly_slack_sagittal"], time)  # fmt: skip
                if 0 < i and min(here[i], left[i]) < 0:
                    self.tissue.add(here[i], left[i], across * tall / wide,
                                    p["belly_slack_transverse"], time)  # fmt: skip
                for a, b in ((here[i], left[i + 1]), (left[i], here[i + 1])):
                    if min(a, b) < 0:
                        self.tissue.add(a, b, p["belly_shear"] * along,
                                        p["belly_slack_sagittal"], time)  # fmt: skip


def pack_muscles(points: Points, muscles: MuscleList, slots: dict[tuple[int, int], int],
                 parameters: Parameters) -> Muscles:  # fmt: skip
    """Arrays of the muscle elements in the calibrated Hill law."""
    layers = {row["group"]: row for row in read_rows("muscle_layers.csv")}
    a, b = points.resolve(muscles.a), points.resolve(muscles.b)
    x = points.places()
    length = np.linalg.norm(x[b] - x[a], axis=1)
    group, chain = np.array(muscles.group), np.array(muscles.chain)
    names = [MUSCLE_GROUPS[g] for g in group]
    thickness = np.array([float(layers[g]["thickness_mm"]) * 1e-3 for g in names])
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
        pushes=np.array(tissue.pushes, dtype=np.int64),
    )  # fmt: skip


def _slots(a: Ints, b: Ints, slots: dict[tuple[int, int], int]) -> Ints:
    pairs = zip(np.minimum(a, b).tolist(), np.maximum(a, b).tolist(), strict=True)
    return np.array([slots.get(pair, -1) for pair in pairs], dtype=np.int64)
