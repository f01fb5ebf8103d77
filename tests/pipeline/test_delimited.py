from __future__ import annotations

import numpy as np
import pytest

from pipeline.c3d import read_c3d
from pipeline.delimited import is_delimited, read_delimited
from sim.errors import InputError

LABELS = ["CLAV", "STRN", "C7"]


@pytest.fixture
def places():
    rng = np.random.default_rng(3)
    return 1e3 * np.array([[0.1, 0, 1.4], [0.2, 0, 1.3], [-0.1, 0, 1.5]]) + rng.normal(
        size=(40, 3, 3)
    )


def read(path):
    return read_delimited(path, assumed_rate=100.0)


def refused(path, *words):
    with pytest.raises(InputError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def write(path, header, rows, separator=","):
    lines = [*header, *(separator.join(str(v) for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_wide_columns_in_any_order(tmp_path, places):
    names = [f"{label} {axis}" for label in LABELS for axis in "XYZ"]
    order = np.random.default_rng(0).permutation(9)
    header = ["# unit: mm", "# rate_hz: 50", ",".join(names[i] for i in order)]
    raw = read(write(tmp_path / "a.csv", header, places.reshape(40, 9)[:, order]))
    assert raw.rate == 50.0
    for i, label in enumerate(LABELS):
        np.testing.assert_allclose(raw.positions[:, raw.labels.index(label)], places[:, i] / 1e3)


def test_units_in_the_names_and_times(tmp_path, places):
    names = [f"{label}_{axis} (cm)" for label in LABELS for axis in "xyz"]
    rows = np.column_stack([2.0 + np.arange(40) / 25.0, places.reshape(40, 9) / 10])
    raw = read(write(tmp_path / "a.tsv", ["time_s\t" + "\t".join(names)], rows, "\t"))
    assert (raw.rate, raw.start) == (pytest.approx(25.0), pytest.approx(2.0))
    np.testing.assert_allclose(raw.positions, places / 1e3)


def test_two_header_rows_as_vicon_writes(tmp_path, places):
    rows = np.column_stack([np.arange(40), np.zeros(40), places.reshape(40, 9)])
    header = [
        "# rate_hz: 100",
        ",,Ann:CLAV,,,Ann:STRN,,,Ann:C7,,",
        "Frame,Sub Frame" + ",X,Y,Z" * 3,
        ",,mm,mm,mm,mm,mm,mm,mm,mm,mm",
    ]
    raw = read(write(tmp_path / "a.csv", header, rows))
    assert raw.labels == tuple(LABELS)
    np.testing.assert_allclose(raw.positions, places / 1e3)


def test_long_table(tmp_path, places):
    rows = [
        (frame, LABELS[m], *places[frame, m])
        for frame in range(40)
        for m in range(3)
        if (frame, m) != (7, 1)
    ]
    header = ["# rate_hz: 100", "# unit: mm", "frame,marker,x,y,z"]
    raw = read(write(tmp_path / "a.csv", header, rows))
    assert np.isnan(raw.positions[7, 1]).all()
    places[7, 1] = np.nan
    np.testing.assert_allclose(raw.positions, places / 1e3)


def test_no_times_no_unit_is_said(tmp_path, places):
    names = [f"{label} {axis}" for label in LABELS for axis in "XYZ"]
    raw = read(write(tmp_path / "a.csv", [",".join(names)], places.reshape(40, 9)))
    assert raw.rate == 100.0
    assert any("100 Hz assumed" in note for note in raw.notes)
    assert any("mm inferred" in note for note in raw.notes)


def test_one_marker_a_file_with_decimal_commas(tmp_path, places):
    for m, label in enumerate(("UCC", "LAC")):
        rows = [
            f"{6 * k};{100 * k};" + ";".join(f"{v:.3f}".replace(".", ",") for v in places[k, m])
            for k in range(40)
        ]
        rows[9] = rows[9].replace(";900;", ";1,8;")
        text = "\r\n".join(['"Frame";"Timestamp";"x";"y";"z"', *rows, "0;0;0;0;0"])
        (tmp_path / f"20120510-{label}-1-N.csv").write_text(text)
    raw = read(tmp_path / "20120510-*.csv")
    assert set(raw.labels) == {"UCC", "LAC"}
    assert raw.rate == pytest.approx(10.0, rel=1e-4)
    assert len(raw.positions) == 40
    found = raw.positions[:, raw.labels.index("UCC")]
    np.testing.assert_allclose(found, places[:, 0] / 1e3, atol=1e-5)
    assert any("time stamps disagree" in note for note in raw.notes)


def test_bad_tables(tmp_path, places):
    refused(tmp_path / "none.csv", "not found")
    refused(tmp_path / "none-*.csv", "no table matches")
    (tmp_path / "empty.csv").write_text("  \n")
    refused(tmp_path / "empty.csv", "empty")
    (tmp_path / "bytes.csv").write_bytes(b"\x02\x50\0\0" * 400)
    refused(tmp_path / "bytes.csv", "not text")
    refused(write(tmp_path / "a.csv", ["a,b,c"], places[:, 0]), "no columns like")
    refused(write(tmp_path / "b.csv", ["CLAV X,CLAV Y,other"], places[:, 0]), "no column for Z")
    refused(
        write(tmp_path / "c.csv", ["# unit: inch", "CLAV X,CLAV Y,CLAV Z"], places[:, 0]), "inch"
    )
    refused(
        write(tmp_path / "d.csv", ["# rate_hz: 0", "CLAV X,CLAV Y,CLAV Z"], places[:, 0]), "rate_hz"
    )
    backwards = np.column_stack([np.arange(40)[::-1], places[:, 0]])
    refused(write(tmp_path / "e.csv", ["time,CLAV X,CLAV Y,CLAV Z"], backwards), "not increase")


def test_what_counts_as_a_table(tmp_path):
    assert is_delimited(tmp_path)
    assert is_delimited(tmp_path / "a.TSV")
    assert is_delimited(tmp_path / "a-*")
    assert not is_delimited(tmp_path / "a.c3d")


def test_real_table_equals_the_c3d(data_real):
    folder = data_real / "chestvolume" / "derived"
    table = read(folder / "sample_data.csv")
    file = read_c3d(folder / "chestvolume_assumed100hz.c3d")
    order = [table.labels.index(label) for label in file.labels]
    np.testing.assert_allclose(table.positions[:, order], file.positions, atol=1e-6)


def test_real_sets_of_one_marker_files(data_real):
    folder = data_real / "extmarker"
    for c3d in sorted((folder / "derived_c3d").glob("*.c3d")):
        raw = read(folder / "original" / f"{c3d.stem.split('_')[0]}-*.csv")
        file = read_c3d(c3d)
        assert raw.labels == file.labels
        assert raw.rate == pytest.approx(10.0, rel=1e-3)
        assert raw.positions.shape == file.positions.shape
        assert np.nanmax(np.abs(raw.positions - file.positions)) < 2e-3
