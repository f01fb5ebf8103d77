"""Sections, strips of pictures, delays of ribs, the map and its checkpoint."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline import configuration
from pipeline.draw.filmstrip import Panel, View, filmstrip_svg
from pipeline.draw.section import sagittal_cuts, sagittal_section
from pipeline.papers import breath_map
from pipeline.papers.breath_map import Checkpoint, breath_controls, grid, map_figures, volumes
from pipeline.papers.ribs import delays
from pipeline.papers.view import outside
from pipeline.settings import PapersSettings

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 2.0)])
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip


def settings(**changes: object) -> PapersSettings:
    values = {**configuration.load(None, {})["papers"], **changes}
    return PapersSettings(**values)


def length(line: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def test_a_box_is_cut_in_a_rectangle():
    (line,) = sagittal_section(CUBE, FACES, 0.3)
    assert line.min(axis=0).tolist() == [0.0, 0.0]
    assert line.max(axis=0).tolist() == [1.0, 2.0]
    gap = float(np.linalg.norm(line[0] - line[-1]))
    assert length(line) + gap == pytest.approx(6.0)


def test_an_open_surface_is_cut_in_an_open_line():
    (line,) = sagittal_section(CUBE, FACES[2:], 0.3)
    assert length(line) == pytest.approx(4.0)
    assert {line[0, 0], line[-1, 0]} == {0.0}


def test_a_plane_beside_the_box_cuts_nothing():
    assert sagittal_section(CUBE, FACES, 2.0) == []


def test_a_vertex_in_the_plane_breaks_nothing():
    lines = sagittal_section(CUBE, FACES, -1.0)
    assert sum(len(line) for line in lines) in (0, 8)


def test_the_floor_and_the_lid_of_the_skin_are_left_out():
    front, floor = [[0.2, 0.4], [0.2, 0.0], [0.15, -0.2]], [[0.05, -0.15]]
    back, lid = [[-0.1, -0.05], [-0.1, 0.3], [-0.05, 0.4], [-0.05, 0.45]], [[0.1, 0.41]]
    line = np.array([*front, *floor, *back, *lid])
    n = len(line)
    # a ribbon on both sides of the midline
    vertices = np.vstack([np.insert(line, 1, y, axis=1) for y in (-0.1, 0.1)])
    k = np.arange(n - 1)
    faces = np.vstack([np.stack([k, k + 1, k + n], 1), np.stack([k + 1, k + n + 1, k + n], 1)])
    kept = [cut.points(vertices) for cut in outside(vertices, faces, np.array([-0.06, 0.0]))]
    assert [part[0].tolist() for part in kept] == [front[0], back[0]]
    assert kept[0][-1] == pytest.approx(front[-1]) and kept[1][:, 1].max() < 0.45


def test_a_cut_goes_with_its_surface():
    (cut,) = sagittal_cuts(CUBE, FACES, 0.3)
    assert cut.points(CUBE + np.array([0.5, 0.0, 0.1])) == pytest.approx(
        cut.points(CUBE) + np.array([0.5, 0.1])
    )


def view(shift: float = 0.0) -> View:
    box = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.4], [0.0, 0.4]]) + np.array([shift, 0.0])
    return View(skin=[box], chest=[box], abdomen=[box], diaphragm=[box[:2]], ribs=[box],
                cartilages=[box[:2]], sternum=box, vertebrae=[box], processes=[box[:2]],
                pelvis=box)  # fmt: skip


def test_pictures_have_one_scale_and_name_their_moments():
    panels = [Panel(view=view(), title="a <b>", line="1.0 s"),
              Panel(view=view(0.05), title="later", line="2.0 s")]  # fmt: skip
    text = filmstrip_svg(panels, still=view())
    assert "a &lt;b&gt;" in text and "2.0 s" in text and "100 mm" in text
    assert text.count("<g transform") == 2
    width, height = (float(w) for w in re.findall(r'viewBox="0 0 (\d+) (\d+)"', text)[0])
    # four columns of 200 mm and more, one row of 400 mm
    assert 4 * 250 < width < 4 * 320 and 400 < height < 600
    assert "M0,0 200,0 200,-400 0,-400" in text


def test_delays_of_ribs_are_found():
    period, late = 4.0, np.array([0.0, 0.05, 0.2, -0.1])
    time = np.linspace(0.0, period, 101)[:-1]
    turn = np.sin(2 * np.pi * (time[:, None] - late) / period) * [1.0, 2.0, -0.5, 1.0]
    assert delays(time, turn, period) == pytest.approx(late, abs=1e-9)


def test_the_map_changes_strength_and_period_of_the_calm_breath_only():
    one = breath_controls(0.4, 2.0)
    levels = {spring.name: spring.curves[0].high for spring in one.springs}
    calm = {s.name: s.curves[0].high for s in breath_map.find_controls("calm").springs}
    assert levels["external_intercostals"] == pytest.approx(0.4)
    assert levels["diaphragm"] / calm["diaphragm"] == pytest.approx(
        0.4 / calm["external_intercostals"]
    )
    assert one.run_cycle(0.0) == 2.0


def test_the_shipped_map_has_300_runs_over_the_printed_periods():
    cells = grid(settings())
    assert len(cells) >= 300
    assert {min(p for _, p in cells), max(p for _, p in cells)} == {0.5, 4.5}


def fake_run(resting, cell, chosen):
    contraction, period = cell
    return {"contraction": f"{contraction:g}", "period_s": f"{period:g}", "breaths": "2",
            "tidal_volume_l": f"{contraction * period:.5f}", "change_l": "0.0"}  # fmt: skip


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(breath_map, "one_run", fake_run)
    monkeypatch.setattr(breath_map, "rest_torso", lambda subject: None)
    return settings(map_contractions=3, map_periods=2, map_batch=2)


def test_a_killed_map_loses_one_batch_at_most(small, tmp_path: Path, monkeypatch):
    calls = []

    def breaks(resting, cell, chosen):
        calls.append(cell)
        if len(calls) == 5:
            raise KeyboardInterrupt
        return fake_run(resting, cell, chosen)

    monkeypatch.setattr(breath_map, "one_run", breaks)
    with pytest.raises(KeyboardInterrupt):
        breath_map.run_map(tmp_path, small, 1)
    assert len(Checkpoint(tmp_path, small).read()) == 4
    assert not (tmp_path / "map.json").exists()
    monkeypatch.setattr(breath_map, "one_run", fake_run)
    breath_map.run_map(tmp_path, small, 1)
    from pipeline.records import read_json

    record = read_json(tmp_path / "map.json")
    assert (record["runs"], record["resumed"]) == (6, 4)
    assert not list(tmp_path.glob("map.partial*"))


def test_runs_of_other_settings_are_not_taken_up(small, tmp_path: Path):
    other = settings(map_contractions=3, map_periods=2, map_batch=2, map_settle_s=5.0)
    Checkpoint(tmp_path, other).write([fake_run(None, (0.1, 1.0), other)])
    assert Checkpoint(tmp_path, small).read() == []
    assert len(Checkpoint(tmp_path, other).read()) == 1


def test_what_the_map_says(small):
    rows = [fake_run(None, cell, small) for cell in grid(small)]
    contractions, periods, tidal = volumes(rows)
    assert tidal == pytest.approx(contractions[:, None] * periods)
    found = map_figures(rows)
    assert found["panting_share"] == pytest.approx(0.5 / 4.5, rel=1e-3)
    assert (found["grows_share"], found["failed"], found["steady_share"]) == (1.0, 0, 1.0)


def test_a_run_that_failed_leaves_its_cell_blank(small):
    rows = [fake_run(None, cell, small) for cell in grid(small)]
    rows[0] |= {"tidal_volume_l": "", "change_l": ""}
    assert np.isnan(volumes(rows)[2]).sum() == 1
    assert map_figures(rows)["failed"] == 1
