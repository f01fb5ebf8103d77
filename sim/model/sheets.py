"""Muscular sheets: the diaphragm and the belly wall, their fibres and their passive tissue."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sim.model.cavity import FREE_FROM, Cavity
from sim.model.muscles import MuscleList, TissueList
from sim.model.points import Points
from sim.model.wall_regions import Region, find_region, read_regions
from sim.physics.types import Floats
from sim.tables import Parameters


class SheetBuilder:
    """Fibres and tissue of the diaphragm and the belly wall."""

    def __init__(
        self,
        points: Points,
        muscles: MuscleList,
        tissue: TissueList,
        cavity: Cavity,
        tall: float,
        parameters: Parameters,
    ) -> None:
        """Parameters: `tall` is the height of the subject's bones over the reference man's."""
        self.points, self.muscles, self.tissue = points, muscles, tissue
        self.cavity, self.tall, self.parameters = cavity, tall, parameters
        self.regions = read_regions(parameters)

    def _regions(self, group: str, rows: Sequence[int]) -> list[Region]:
        """Regions of a fibre's elements that goes through these rows of the wall."""
        last = len(self.cavity.wall[0]) - 1
        return [find_region(self.regions, group, 0.5 * (a + b) / last) for a, b in pairwise(rows)]

    def _gap(self, a: int, b: int) -> float:
        return float(np.linalg.norm(self.points.at(a) - self.points.at(b)))

    def diaphragm(self) -> None:
        """Fibres from the rim to the tendon; weak tissue around and across them."""
        grid, p = self.cavity.diaphragm, self.parameters
        n = len(grid)
        modulus = p["diaphragm_modulus"] * p["diaphragm_thickness"]
        time, slack, curve = p["tissue_time"], p["diaphragm_slack"], p["diaphragm_curve"]
        for j, column in enumerate(grid):
            right, left = grid[j - 1], grid[(j + 1) % n]
            widths = []
            for i in range(len(column) - 1):
                spread = [0.5 * self._gap(left[k], right[k]) for k in (i, i + 1)]
                widths.append(0.5 * (spread[0] + spread[1]))
            # One tension runs through a fibre, so its strip has one strength: the mean.
            self.muscles.add_chain("diaphragm", column, [float(np.mean(widths))] * len(widths))
            for i in range(1, len(column) - 1):
                along = 0.5 * sum(self._gap(c[i], c[i + 1]) for c in (column, left))
                self.tissue.add(column[i], left[i], modulus * along / self._gap(column[i], left[i]),
                                slack, time, 1, curve)  # fmt: skip
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

    def mediastinum(self, bodies: dict[int, Floats]) -> None:
        """Hang the central tendon by the pericardium; it is slack at rest and only pulls.

        Parameters
        ----------
        bodies : rigid body to where the pericardium is tied to it, (3,) m
        """
        p, ring = self.parameters, self.cavity.tendon_ring
        left = range(0, len(ring) // 2 + 1, 2)
        chosen = sorted({*left, *(-k % len(ring) for k in left)})
        for body, at in bodies.items():
            anchor = self.points.add(body, at)
            for handle in (ring[k] for k in chosen):
                self.tissue.add(
                    anchor, handle, p["pericardium_stiffness"], p["pericardium_slack"],
                    p["tissue_time"], 0, p["pericardium_curve"],
                )  # fmt: skip

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
                regions = self._regions("rectus", range(len(rows)))
                self.muscles.add_chain("rectus", rows, [width] * (len(rows) - 1), 1.0, regions)
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
            regions = self._regions("transversus", [i] * len(line))
            self.muscles.add_chain("transversus", line, [height] * (len(line) - 1), 1.0, regions)
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
        regions = self._regions(group, [i for _, i in path])
        self.muscles.add_chain(group, line, [width] * (len(line) - 1), 1.0, regions)

    def _membrane(self, grid: list[list[int]], n: int) -> None:
        p = self.parameters
        thick, time = p["belly_thickness"], p["tissue_time"]
        across, along = p["belly_modulus_transverse"] * thick, p["belly_modulus_sagittal"] * thick
        rows, bow = len(grid[0]), p["belly_curve_transverse"]
        for j in range(n):
            right, here, left = grid[j - 1], grid[j], grid[(j + 1) % n]
            share, slack, curve = self._reach(here)
            for i in range(rows - 1):
                wide = 0.5 * (self._gap(here[i], left[i]) + self._gap(here[i], right[i]))
                tall = self._gap(here[i], here[i + 1])
                if min(here[i], here[i + 1]) < 0:
                    self.tissue.add(here[i], here[i + 1], share * along * wide / tall,
                                    slack, time, 0, curve)  # fmt: skip
                if 0 < i and min(here[i], left[i]) < 0:
                    tall = 0.5 * (tall + self._gap(left[i], left[i + 1]))
                    self.tissue.add(here[i], left[i], across * tall / self._gap(here[i], left[i]),
                                    p["belly_slack_transverse"], time, 0, bow)  # fmt: skip
            share, slack, curve = self._reach(here, left)
            for a, b in ((here[:-1], left[1:]), (left[:-1], here[1:])):
                for upper, lower in zip(a, b, strict=True):
                    if min(upper, lower) < 0:
                        self.tissue.add(upper, lower, share * p["belly_shear"] * along,
                                        slack, time, 0, curve)  # fmt: skip

    def _reach(self, *columns: list[int]) -> tuple[float, float, float]:
        """Stiffness of a wall's columns over that of the wall alone, slack length and curve.

        Rectus and external oblique go on over the ribs to their origins. That part is stretched in
        series with the wall below the margin: a thread of the whole length, of which the
        column moves one end, is a thread of the column's length with these three.
        """
        p = self.parameters
        slack, curve = p["belly_slack_sagittal"], p["belly_curve_sagittal"]
        length = np.mean([sum(self._gap(a, b) for a, b in pairwise(c)) for c in columns])
        whole = 1.0 + self.tall * p["wall_reach"] / float(length)
        shorter = 1.0 - whole * (1.0 - slack)
        return 1.0 / whole, shorter, curve * shorter / (whole * slack)
