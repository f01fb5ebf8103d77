"""A binding can be written, edited in one vertex or one region, and read back."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from pipeline.binding_file import COLUMNS, read_binding, regions, write_binding
from sim.errors import InputError
from sim.motion import skin_surface


@pytest.fixture
def skin(dressed_motion):
    return dressed_motion.skin


def _write(path, *rows):
    path.write_text("\n".join([",".join(COLUMNS[:4]), *rows]) + "\n")
    return path


def test_what_is_written_comes_back(skin, tmp_path):
    path = tmp_path / "binding.csv"
    rows = write_binding(path, skin)
    with path.open() as stream:
        read = list(csv.DictReader(stream))
    assert len(read) == rows and tuple(read[0]) == COLUMNS
    back = read_binding(path, skin)
    assert np.abs((back.matrix() - skin.matrix()).toarray()).max() < 1e-4
    assert back.about["edited"] == "binding.csv"


def test_one_vertex_is_bound_anew_and_the_rest_stays(skin, tmp_path, dressed_motion):
    path = _write(tmp_path / "one.csv", "5,rib_L5,0.25,", "5,abdomen:3,0.75,")
    back = read_binding(path, skin)
    full, before = back.matrix().toarray(), skin.matrix().toarray()
    assert full[5, skin.rest.bodies.index("rib_L5")] == pytest.approx(0.25)
    assert full[5, len(skin.rest.bodies) + 3] == pytest.approx(0.75)
    others = np.arange(len(full)) != 5
    np.testing.assert_allclose(full[others], before[others])
    moved = skin_surface(replace(dressed_motion, skin=back)).vertices
    kept = skin_surface(dressed_motion).vertices
    np.testing.assert_allclose(moved[:, others], kept[:, others])
    assert np.abs(moved[:, 5] - kept[:, 5]).max() > 1e-4


def test_a_region_is_bound_anew_and_a_named_vertex_goes_before_it(skin, tmp_path):
    region = regions(skin)[0]
    path = _write(tmp_path / "region.csv", "0,rib_L5,1,", f",pelvis,1,{region}")
    full = read_binding(path, skin).matrix().toarray()
    inside = [v for v, name in enumerate(regions(skin)) if name == region and v != 0]
    assert (full[inside, 0] == 1.0).all()
    assert full[0, skin.rest.bodies.index("rib_L5")] == 1.0


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (("5,rib_L5,0.5,",), r"weights of vertex 5 sum to 0\.5000\. Make them sum to 1"),
        (("5,rib_L6,1,",), r"line 2: no bone or point 'rib_L6'\. Near it: rib_L5"),
        (("999,rib_L5,1,",), r"line 2: vertex is '999'\. Use 0 to 119"),
        (("-1,rib_L5,1,",), r"line 2: vertex is '-1'"),
        (("5,rib_L5,one,",), r"line 2: weight is 'one'\. Use a number from 0 to 1"),
        (("5,rib_L5,nan,",), r"line 2: weight is 'nan'"),
        (("5,rib_L5,-1,", "5,pelvis,2,"), r"line 2: weight is '-1'"),
        (("5,rib_L5,0.5,", "5,rib_L5,0.5,"), r"line 3: rib_L5 stands twice for 5"),
        ((",pelvis,1,knee",), r"line 2: neither a vertex nor a region \('knee'\)"),
        (("5",), r"line 2: too few values"),
    ],
)
def test_a_wrong_table_is_told_in_one_line(skin, tmp_path, rows, words):
    path = _write(tmp_path / "wrong.csv", *rows)
    with pytest.raises(InputError, match=words) as found:
        read_binding(path, skin)
    assert "\n" not in str(found.value) and str(path) in str(found.value)


def test_another_table_is_refused(skin, tmp_path):
    path = tmp_path / "other.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="no column vertex, handle, weight"):
        read_binding(path, skin)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot be read as a table"):
        read_binding(path, skin)
    with pytest.raises(InputError, match="cannot be read as a table"):
        read_binding(tmp_path / "missing.csv", skin)
