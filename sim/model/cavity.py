"""The two cavities: inner sheet of the rib cage, diaphragm, belly wall, back and floor.

Chest and abdomen share the triangles of the diaphragm, so that what the dome displaces, both
see. The rim runs along the costal margin: from the second lumbar vertebra over the arcuate
ligament and the tips of ribs 12 and 11 to the tenth rib and along the margin to the xiphoid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.model.anatomy import SIDES, Anatomy
from sim.model.dome import apposed_heights, apposed_path, fibre_path, tendon_edge
from sim.model.mesh import along, strip
from sim.model.points import Points
from sim.model.skeleton import margin_point, segment_of
from sim.physics.types import Floats
from sim.tables import Parameters

RIB_STATIONS = np.array([0.06, 0.16, 0.28, 0.4, 0.52, 0.64, 0.76, 0.88, 1.0])
"""Where the sheet meets a rib, as shares of its length."""
MARGIN = (1.0, 0.87, 0.75, 0.6, 0.45, 0.3, 0.15)
"""Rim points on the costal margin, from the tenth rib to beside the xiphoid."""
ROW_END = {8: 0.45, 9: 0.75, 10: 1.0}
"""Where the rows of the false ribs meet the margin."""
PELVIS_STATION = (0.0, 3.0, 5.0, 7.0, 8.5, 10.0, 11.5, 13.0, 14.0, 15.0, 16.0, 17.2, 18.4, 20.0)
"""Where the wall's columns end on the pelvic rim (index of its 40 points)."""
FREE_FROM = 2
"""First column of the wall that is free; those behind are bound to the lumbar spine."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Cavity:
    """Handles of the cavities' points.

    Parameters
    ----------
    sheet_faces, diaphragm_faces, belly_faces : (n, 3), unoriented; `orient` turns them
    diaphragm : (n_columns, n_rows), rim first, tendon edge last
    wall : (n_columns, n_rows), rim first, pelvis last
    rim_half : number of columns from the back midline to the front one, both counted
    tendon_ring : half-way in on the central tendon
    rows : per side, the sheet's row of each rib
    """

    sheet_faces: list[tuple[int, int, int]]
    diaphragm_faces: list[tuple[int, int, int]]
    belly_faces: list[tuple[int, int, int]]
    diaphragm: list[list[int]]
    wall: list[list[int]]
    rim_half: int
    tendon_ring: list[int]
    rows: list[list[list[int]]]


class CavityBuilder:
    """Builds the cavities on a subject's bones; `points` grows as it goes."""

    def __init__(
        self, points: Points, body: dict[str, int], anatomy: Anatomy, parameters: Parameters
    ) -> None:
        self.points, self.body = points, body
        self.anatomy, self.parameters = anatomy, parameters
        self.middle = {
            i: self._bind("sternum", self._sternum_at(anatomy.facet[0, i - 1, 2]))
            for i in range(1, 8)
        }
        self.back = {
            i: self._bind(segment_of(f"T{i}"), anatomy.front[f"T{i}"]) for i in range(1, 13)
        }
        self.xiphoid = self._bind("sternum", anatomy.sternum_back[-1])
        self.lumbar = self._bind("L1-L3", anatomy.front["L1"])

    def _bind(self, body: str, at: Floats) -> int:
        return self.points.add(self.body[body], at)

    def _sternum_at(self, z: float) -> Floats:
        line = self.anatomy.sternum_back
        order = np.argsort(line[:, 2])
        return np.array([np.interp(z, line[order, 2], line[order, 0]), 0.0, z])

    def _rim_half(self, side: int) -> list[int]:
        """Rim of one side, midline points left out, back to front."""
        a, letter = self.anatomy, SIDES[side]
        sign = 1.0 if side == 0 else -1.0
        arcuate = a.front["L1"] + np.array([-0.045 * a.scale[0], sign * 0.045 * a.scale[1], 0.0])
        tips = [a.rib[side, i, -1] for i in (11, 10, 9)]
        half = [
            self._bind("L1-L3", arcuate),
            self._bind(f"rib_{letter}12", tips[0]),
            self._bind(f"rib_{letter}12", 0.5 * (tips[0] + tips[1])),
            self._bind(f"rib_{letter}11", tips[1]),
            self._bind(f"rib_{letter}11", 0.5 * (tips[1] + tips[2])),
        ]
        for t in MARGIN:
            at = margin_point(a, side, t, self.parameters)
            half.append(self._bind(f"cartilage_{letter}6-10", at))
        return half

    def _row(self, side: int, rib: int, rim: list[int]) -> list[int]:
        """Sheet points along one rib, from the spine to the sternum or the margin."""
        a, letter = self.anatomy, SIDES[side]
        line = a.rib[side, rib - 1]
        row = [self.back[rib]]
        row += [self._bind(f"rib_{letter}{rib}", p) for p in along(line, RIB_STATIONS)]
        if rib <= 7:
            tip, facet = line[-1], a.facet[side, rib - 1]
            part = f"cartilage_{letter}{rib}" if rib < 6 else f"cartilage_{letter}6-10"
            part = "sternum" if rib == 1 else part
            row += [self._bind(part, tip + t * (facet - tip)) for t in (0.33, 0.67)]
            row += [self._bind("sternum", facet), self.middle[rib]]
        elif rib <= 9:
            end = rim[5 + MARGIN.index(ROW_END[rib])]
            row += [
                self._bind(f"cartilage_{letter}6-10", 0.5 * (line[-1] + self.points.at(end))),
                end,
            ]
        elif rib == 10:
            row[-1] = rim[5]
        elif rib == 11:
            row[-1] = rim[3]
        else:
            row[-1] = rim[1]
        return row

    def _sheet(
        self, rims: list[list[int]]
    ) -> tuple[list[tuple[int, int, int]], list[list[list[int]]]]:
        faces: list[tuple[int, int, int]] = []
        rows = [[self._row(s, i, rims[s]) for i in range(1, 13)] for s in (0, 1)]
        for side, rim in enumerate(rims):
            border = {
                7: [*rim[9:], self.xiphoid],
                8: rim[7:10],
                9: rim[5:8],
                10: rim[4:6],
                11: rim[2:4],
            }
            for i in range(1, 12):
                lower = list(rows[side][i])
                upper = list(rows[side][i - 1])
                lower += [h for h in border.get(i, []) if h not in lower]
                faces += strip(self.points, upper, lower)
            last = [self.back[12], *rows[side][11][1:]]
            low = [self.lumbar, rim[0], rim[1]]
            faces += strip(self.points, last, low)
        faces += strip(self.points, rows[0][0], rows[1][0])  # fmt: skip
        return faces, rows

    def build(self) -> Cavity:
        """Build sheet, diaphragm, wall, back and floor."""
        rims = [self._rim_half(0), self._rim_half(1)]
        sheet, rows = self._sheet(rims)
        loop = [self.lumbar, *rims[0], self.xiphoid, *rims[1][::-1]]
        half = len(rims[0]) + 2
        diaphragm, dome_faces, ring = self._diaphragm(loop, half, sheet)
        wall, belly = self._wall(loop, half)
        return Cavity(
            sheet_faces=sheet,
            diaphragm_faces=dome_faces,
            belly_faces=belly,
            diaphragm=diaphragm,
            wall=wall,
            rim_half=half,
            tendon_ring=ring,
            rows=rows,
        )

    def _diaphragm(
        self, loop: list[int], half: int, sheet: list[tuple[int, int, int]]
    ) -> tuple[list[list[int]], list[tuple[int, int, int]], list[int]]:
        p, a = self.parameters, self.anatomy
        n = len(loop)
        triangles = np.array([[self.points.at(h) for h in f] for f in sheet])
        n_rows = int(p["diaphragm_rows"])
        edge = tendon_edge(a, p, np.array([self.points.at(h) for h in loop]))
        grid, heights = [], apposed_heights(p) * a.scale[2]
        for j, handle in enumerate(loop):
            k = j if j < half else n - j
            path = apposed_path(triangles, self.points.at(handle), float(heights[k]), p)
            line = fibre_path(path, edge[j], n_rows)
            column = [handle, *[self.points.add_particle(q) for q in line[1:-1]]]
            grid.append([*column, self._bind("central_tendon", edge[j])])
        tendon = [c[-1] for c in grid]
        middle = edge.mean(axis=0)
        # A paraboloid: half-way in, three quarters of its height are reached.
        rise = np.array([0.0, 0.0, p["tendon_rise"] * a.scale[2]])
        ring = [self._bind("central_tendon", 0.5 * (q + middle) + 0.75 * rise) for q in edge[::2]]
        top = self._bind("central_tendon", middle + rise)
        faces = []
        for j in range(n):
            faces += strip(self.points, grid[j], grid[(j + 1) % n])
        # From the back to the front on both sides, so that they are each other's mirror image.
        inner = len(ring) // 2 + 1
        left, right = ring[:inner], [ring[0], *ring[: inner - 1 : -1]]
        faces += strip(self.points, tendon[:half], left)
        faces += strip(self.points, [tendon[0], *tendon[: half - 2 : -1]], right)
        faces.append((tendon[half - 1], left[-1], right[-1]))
        faces += [(ring[k], ring[(k + 1) % len(ring)], top) for k in range(len(ring))]
        return grid, faces, ring

    def _pelvic_line(self, half: int, n: int) -> Floats:
        rim = self.anatomy.pelvis_rim.copy()
        rim[0] = self.anatomy.front["S1"]
        line = []
        for j in range(n):
            k = j if j < half else n - j
            s = PELVIS_STATION[k]
            low = int(np.floor(s))
            at = rim[low] + (s - low) * (rim[min(low + 1, 20)] - rim[low])
            line.append(at if j < half else at * [1.0, -1.0, 1.0])
        return np.array(line)

    def _wall(
        self, loop: list[int], half: int
    ) -> tuple[list[list[int]], list[tuple[int, int, int]]]:
        p, n = self.parameters, len(loop)
        n_rows = int(p["wall_rows"])
        pelvic = self._pelvic_line(half, n)
        centre = np.array(
            [0.02, 0.0, 0.5 * (pelvic[:, 2].mean() + self.points.at(self.xiphoid)[2])]
        )
        grid = []
        for j, handle in enumerate(loop):
            k = j if j < half else n - j
            top, bottom = self.points.at(handle), pelvic[j]
            out = 0.5 * (top + bottom) - centre
            out[2] = 0.0
            out /= np.linalg.norm(out)
            front = max(0.0, out[0])
            bulge = p["belly_bulge_side"] + (p["belly_bulge_front"] - p["belly_bulge_side"]) * front
            t = np.linspace(0.0, 1.0, n_rows + 2)[1:-1]
            line = top + t[:, None] * (bottom - top)
            if k >= FREE_FROM:
                line += np.sin(np.pi * t)[:, None] * bulge * out
                column = [self.points.add_particle(q) for q in line]
            else:
                column = [
                    self._bind(self._lumbar_body(q[2]), self._before_spine(q, k)) for q in line
                ]
            grid.append([handle, *column, self._bind("pelvis", bottom)])
        faces: list[tuple[int, int, int]] = []
        for j in range(n):
            faces += strip(self.points, grid[j], grid[(j + 1) % n])
        return grid, faces + self._floor([c[-1] for c in grid])

    def _lumbar_body(self, z: float) -> str:
        return "L4-L5" if z < self.anatomy.joint["L3"][2] else "L1-L3"

    def _before_spine(self, q: Floats, column: int) -> Floats:
        """Midline points of the back lie on the front of the vertebral bodies."""
        if column > 0:
            return q
        levels = [self.anatomy.front[k] for k in ("S1", "L5", "L4", "L3", "L2", "L1")]
        z = np.array([v[2] for v in levels])
        return np.array([np.interp(q[2], z, np.array([v[0] for v in levels])), 0.0, q[2]])

    def _floor(self, loop: list[int]) -> list[tuple[int, int, int]]:
        rim = np.array([self.points.at(h) for h in loop])
        middle = rim.mean(axis=0) - np.array([0.0, 0.0, self.parameters["pelvis_depth"]])
        ring = [
            self._bind("pelvis", middle + [0.55, 0.55, 0.0] * (q - middle) + [0.0, 0.0, 0.01])
            for q in rim
        ]
        bottom = self._bind("pelvis", middle)
        faces = []
        for k, here in enumerate(loop):
            ahead = (k + 1) % len(loop)
            faces += [(here, loop[ahead], ring[ahead]), (here, ring[ahead], ring[k])]
            faces.append((ring[k], ring[ahead], bottom))
        return faces
