"""Muscles between the bones of the trunk: intercostals, neck muscles on ribs, erector spinae."""

from __future__ import annotations

import numpy as np

from sim.model.anatomy import SIDES, Anatomy
from sim.model.mesh import along
from sim.model.muscles import MuscleList
from sim.model.points import Points
from sim.model.skeleton import cartilage_line, segment_of
from sim.tables import Parameters

ENDS = ("sternal", "acromial")


class TrunkMuscleBuilder:
    """Strings the intercostals between the ribs, and the muscles between ribs, neck and spine."""

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
        self.drive = {row["group"]: row for row in parameters.rows("drive_map.csv")}

    def build(self) -> None:
        """Add every space of both sides, and what else the parameter set has."""
        has = self.muscles.groups
        for side in (0, 1):
            for upper in range(1, 12):
                self._space(side, upper, "external_intercostals", 1.0, 0.06, 0.97)
                self._space(side, upper, "internal_intercostals", -1.0, 0.22, 1.0)
                if upper <= 6:
                    self._parasternal(side, upper)
                if "levatores_costarum" in has:
                    self._levator(side, upper)
            if "scalenes" in has:
                self._scalenes(side)
            if "sternocleidomastoid" in has:
                self._sternocleidomastoid(side)
            if "erector_spinae" in has:
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
        share, late = self._drive("levatores_costarum", upper, 0.0)
        width = self.parameters["levator_width"]
        self.muscles.add_chain("levatores_costarum", handles, [width], share, late=late)

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

    def _sternocleidomastoid(self, side: int) -> None:
        """From the mastoid process to the front of the manubrium and to the inner clavicle."""
        sign, letter = (1.0 if side == 0 else -1.0), SIDES[side]
        inner, outer = (self.anatomy.girdle[f"clavicle_{end}"][side] for end in ENDS)
        heads = {
            "sternum": self.anatomy.sternum_front[0] + np.array([0.0, sign * 0.01, 0.0]),
            f"girdle_{letter}": 0.75 * inner + 0.25 * outer,
        }
        mastoid = self.anatomy.skull_base + np.array([0.0, sign * 0.05, 0.0])
        for (name, low), head in zip(heads.items(), ("sternal", "clavicular"), strict=True):
            top = self.points.add(self.body["skull"], mastoid)
            handles = [top, self.points.add(self.body[name], low)]
            width = self.parameters[f"sternocleidomastoid_{head}"]
            self.muscles.add_chain("sternocleidomastoid", handles, [width])

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
            share, late = self._drive(group, upper, u)
            self.muscles.add_chain(group, handles, [step * np.sqrt(0.5)], share, late=late)

    def _drive(self, group: str, space: int, along: float) -> tuple[float, float]:
        """Neural drive by interspace and by place along the rib, from `drive_map.csv`.

        Returns
        -------
        share of the group's drive, and what comes on top in a maximal effort: the rest, where the
        table says that the whole group is recruited then and the element has any drive at all
        """
        row = self.drive[group]
        slope = (space - float(row["space_full"])) / (
            float(row["space_none"]) - float(row["space_full"])
        )
        by_space = max(float(row["least"]), min(1.0, 1.0 - slope))
        share = by_space * max(0.0, 1.0 - float(row["ventral_loss"]) * along)
        return share, (1.0 - share) * float(row["recruited"]) if share > 0.0 else 0.0

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
            share, late = self._drive("parasternal_intercostals", upper, 0.0)
            self.muscles.add_chain("parasternal_intercostals", handles, [width], share, late=late)
