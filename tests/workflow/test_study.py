"""Tables: every slip of a person is one line with its place, and spoils only its own row."""

from __future__ import annotations

import pytest

from pipeline.study import read_study
from pipeline.workflow import read_plan
from sim.errors import InputError

GOOD = ("a", "breath", "p1")


def problems(study):
    found = read_study(study.recordings, study.subjects)
    return {entry.name: entry.problem for entry in found.entries}


def test_good_row_has_no_problem_and_keeps_its_text(study):
    path = study.recording_file()
    study.rows(("001", "breath", "p1", path, "1", "2.5"))
    entry = read_study(study.recordings, study.subjects).entry("001")
    assert entry.problem == ""
    assert entry.name == "001"
    assert entry.file.resolve() == study.folder / "data" / "first.c3d"
    assert entry.subject["stature_m"] == "1.65"


def test_byte_order_mark_comments_blank_lines_and_windows_ends_are_read(study):
    path = study.recording_file()
    text = f"recording\tkind\tsubject\tpath\r\n# note\r\n\r\na\tbreath\tp1\t{path}\r\n"
    study.recordings.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert problems(study) == {"a": ""}


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (("a", "laughter", "p1", "FILE"), ["kind is 'laughter'", "laugh"]),
        (("a", "breath", "nobody", "FILE"), ["subject 'nobody' has no row"]),
        (("a", "breath", "", "FILE"), ["subject is empty"]),
        (("a", "breath", "p1", ""), ["path is empty"]),
        (("a", "breath", "p1", "../data/none.c3d"), ["there is no file", "table's folder"]),
        (("a", "breath", "p1", "../data"), ["is not a file"]),
        (("a", "breath", "p1", "FILE", "soon"), ["start_s is 'soon', not a number"]),
        (("a", "breath", "p1", "FILE", "-1"), ["start_s is -1, outside"]),
        (("a", "breath", "p1", "FILE", "nan"), ["start_s is nan, outside"]),
        (("a", "breath", "p1", "FILE", "5", "5"), ["start_s 5 is not before end_s 5"]),
        (("a", "breath", "p1", "FILE", "", "", "map.csv"), ["markers: there is no file"]),
        (("group", "breath", "p1", "FILE"), ["reserved"]),
        (("readme", "breath", "p1", "FILE"), ["reserved"]),
        (("a/b", "breath", "p1", "FILE"), ["letters, digits"]),
        (("../a", "breath", "p1", "FILE"), ["letters, digits"]),
        (("", "breath", "p1", "FILE"), ["letters, digits"]),
    ],
)
def test_bad_row_says_what_is_wrong_in_one_line(study, row, words):
    path = study.recording_file()
    study.rows(tuple(path if cell == "FILE" else cell for cell in row), ("fine", *GOOD[1:], path))
    found = problems(study)
    assert found["fine"] == ""
    problem = found[row[0]]
    assert "\n" not in problem
    for word in words:
        assert word in problem


def test_empty_file_is_a_problem(study):
    study.rows((*GOOD, study.recording_file(content=b"")))
    assert "is empty" in problems(study)["a"]


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        (("p1", "female", "0", "60", "upright"), "stature_m is 0, outside 1.2 to 2.3. Give metres"),
        (("p1", "female", "165", "60", "upright"), "stature_m is 165, outside"),
        (("p1", "female", "1,65", "60", "upright"), "stature_m is '1,65', not a number"),
        (("p1", "female", "1.65", "6", "upright"), "mass_kg is 6, outside"),
        (("p1", "femal", "1.65", "60", "upright"), "Did you mean female?"),
        (("p1", "Male", "1.65", "60", "upright"), "Did you mean male?"),
        (("p1", "female", "1.65", "60", "sitting"), "Write one of: upright, supine"),
        (("p1", "female", "1.65", "60", ""), "posture is empty"),
    ],
)
def test_bad_subject_spoils_its_recordings_only(study, cells, words):
    path = study.recording_file()
    study.people(cells, ("p2", "male", "", "", "supine"))
    study.rows((*GOOD, path), ("fine", "breath", "p2", path))
    found = problems(study)
    assert found["fine"] == ""
    assert words in found["a"]
    assert "subjects.tsv: subject p1" in found["a"]


def test_two_rows_of_one_name_are_both_refused(study):
    path = study.recording_file()
    study.rows((*GOOD, path), (*GOOD, path))
    found = read_study(study.recordings, study.subjects)
    assert found.names == ("a",)
    assert all("2 rows have this name" in entry.problem for entry in found.entries)


def test_two_rows_of_one_subject_are_refused(study):
    row = ("p1", "male", "1.8", "80", "upright")
    study.people(row, row)
    study.rows((*GOOD, study.recording_file()))
    assert "has 2 rows" in problems(study)["a"]


def test_reserved_name_gets_no_report(study):
    path = study.recording_file()
    study.rows(("error_table", "breath", "p1", path), (*GOOD, path))
    assert read_study(study.recordings, study.subjects).names == ("a",)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (("recording", "kind", "subject", "path", "strat_s"), "Did you mean start_s"),
        (("recording", "kind", "subject"), "column 'path': is missing"),
        (("recording", "kind", "subject", "path", "path"), "stands there 2 times"),
        (("recording,kind,subject,path",), "separated by commas"),
    ],
)
def test_table_with_wrong_columns_is_refused(study, header, words):
    study.rows(header=header)
    with pytest.raises(InputError, match=words):
        read_study(study.recordings, study.subjects)


def test_row_with_a_tab_too_many_is_refused(study):
    study.rows((*GOOD, "x", "", "", "", "more"))
    with pytest.raises(InputError, match="8 cells for 7 columns"):
        read_study(study.recordings, study.subjects)


def test_missing_empty_and_binary_tables_are_one_line(study):
    study.subjects.write_bytes(b"")
    with pytest.raises(InputError, match="is empty"):
        read_study(study.recordings, study.subjects)
    study.subjects.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        read_study(study.recordings, study.subjects)
    study.subjects.unlink()
    with pytest.raises(InputError, match="there is no such table"):
        read_study(study.recordings, study.subjects)


def test_an_edited_table_of_calls_makes_another_job(study, monkeypatch):
    sound = study.recording_file("ha.flac")
    study.rows(("ha", "laugh", "p1", sound), ("calm", "breath", "p1", sound))
    monkeypatch.chdir(study.folder)
    plan = read_plan({})
    assert plan.study.names_of("laugh") == ("ha",)
    assert plan.study.names_of("breath") == ("calm",)
    assert plan.records("ha")[-1] == "results/ha/follow.json"
    assert plan.records("calm")[-1] == "results/calm/posterior.json"
    folder = study.folder / "results" / "ha"
    folder.mkdir(parents=True)
    before = plan.job("ha", "calls")
    rows = "call,start_s,peak_s,end_s,peak,bout,voiced,kept,why_not\n1,0.1,0.2,0.3,1,1,yes,yes,\n"
    for name in ("calls.csv", "calls.found.csv"):
        (folder / name).write_text(rows, encoding="utf-8")
    assert plan.job("ha", "calls") == before
    (folder / "calls.csv").write_text(rows.replace("yes,yes", "yes,no"), encoding="utf-8")
    edited = plan.job("ha", "calls")
    assert edited != before
    assert plan.job("ha", "calls") == edited
    assert plan.job("ha", "pressure") == read_plan({}).job("ha", "pressure")


def test_a_calibration_table_brings_its_files(study, monkeypatch):
    sound = study.recording_file("ha.flac")
    study.recording_file("a.csv")
    table = study.folder / "data" / "calibration.tsv"
    table.write_text("subject\taudio\tpressure\na\tha.flac\ta.csv\n", encoding="utf-8")
    study.rows(("ha", "laugh", "p1", sound, "", "", "../data/calibration.tsv"))
    monkeypatch.chdir(study.folder)
    names = [path.rsplit("/", 1)[-1] for path in read_plan({}).files("ha")]
    assert names == ["ha.flac", "calibration.tsv", "ha.flac", "a.csv"]
