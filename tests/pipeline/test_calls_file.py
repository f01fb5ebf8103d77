"""calls.csv by hand, and the TextGrid."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.calls_file import (
    FOUND,
    TABLE,
    Call,
    edit_digest,
    is_edited,
    read_calls,
    write_calls,
    write_text_grid,
)
from sim.errors import InputError


def call(number: int, start: float, kept: bool = True) -> Call:
    return Call(
        call=number,
        start=start,
        peak_time=round(start + 0.1, 3),
        end=round(start + 0.2, 3),
        peak=1.0,
        bout=1 if kept else 0,
        voiced=True,
        kept=kept,
        why_not="" if kept else 'like a "ha ha"',
    )


CALLS = [call(1, 0.0), call(2, 0.2), call(3, 1.0, kept=False)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_calls(tmp_path / TABLE, CALLS)
    write_calls(tmp_path / FOUND, CALLS)
    return tmp_path


def edit(folder: Path, old: str, new: str) -> None:
    text = (folder / TABLE).read_text()
    assert old in text
    (folder / TABLE).write_text(text.replace(old, new))


def test_round_trip(folder: Path) -> None:
    assert read_calls(folder / TABLE) == CALLS
    assert not is_edited(folder)
    assert edit_digest(folder) == ""


def test_columns_of_the_fit_are_no_edit(folder: Path) -> None:
    write_calls(folder / TABLE, CALLS, [{"rms_normalised": 0.1, "seconds": 3}] * 3)
    assert not is_edited(folder)
    assert (folder / TABLE).read_text().splitlines()[0].endswith(",rms_normalised,seconds")


def test_an_edit_is_seen_and_read(folder: Path) -> None:
    edit(folder, "2,0.200,0.300,0.400,1.000,1,yes,yes,", "2,0.200,,0.450,,,yes,no,")
    assert is_edited(folder)
    assert len(edit_digest(folder)) == 12
    second = read_calls(folder / TABLE)[1]
    assert (second.end, second.kept, second.why_not) == (0.45, False, "left out by hand")


def test_a_table_from_a_spreadsheet(folder: Path) -> None:
    text = (folder / TABLE).read_text().replace(".", "DOT").replace(",", ";").replace("DOT", ",")
    (folder / TABLE).write_text("\ufeff" + text.replace("\n", "\r\n"))
    assert [one.start for one in read_calls(folder / TABLE)] == [0.0, 0.2, 1.0]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("0.400", "soon", "row 2: end_s is 'soon'"),
        ("0.400", "0.100", "row 2: end_s 0.1 is not after"),
        ("1,yes,yes,\n2", "1,yes,perhaps,\n2", "row 1: kept is 'perhaps'"),
        ("2,0.200", "2,0.050", "call 2: starts at"),
        ("kept", "keep", "column kept"),
    ],
)
def test_a_slip_is_named(folder: Path, old: str, new: str, words: str) -> None:
    edit(folder, old, new)
    with pytest.raises(InputError) as caught:
        read_calls(folder / TABLE)
    assert words in str(caught.value)
    assert edit_digest(folder)


def test_text_grid_tiers_are_whole(tmp_path: Path) -> None:
    path = tmp_path / "calls.TextGrid"
    write_text_grid(path, CALLS, [(0.5, 0.9)], 0.0, 2.0)
    text = path.read_text()
    tiers = text.split("item [")[2:]
    assert [re.search(r'name = "(.*)"', tier)[1] for tier in tiers] == [
        "bouts",
        "calls",
        "inhalations",
        "left out",
    ]
    for tier in tiers:
        body = tier.split("intervals [", 1)[1]
        starts = [float(x) for x in re.findall(r"xmin = ([\d.]+)", body)]
        ends = [float(x) for x in re.findall(r"xmax = ([\d.]+)", body)]
        assert starts[0] == 0.0 and ends[-1] == 2.0
        assert starts[1:] == ends[:-1]
    assert '"like a ""ha ha"""' in text
