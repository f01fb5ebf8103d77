"""`pleura`: one line for a person, exit code 1 for what went wrong, never a traceback."""

from __future__ import annotations

import pytest

from pipeline.__main__ import main


def test_new_makes_a_study_that_checks_clean(in_study, capsys):
    in_study.rows(("a", "breath", "p1", in_study.recording_file()))
    assert main(["check"]) == 0
    assert "1 of 1 recordings can be used" in capsys.readouterr().out


def test_new_never_writes_over_a_study(in_study, capsys):
    before = sorted(p.name for p in in_study.folder.rglob("*"))
    assert main(["new", str(in_study.folder)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert sorted(p.name for p in in_study.folder.rglob("*")) == before


def test_check_names_every_bad_row(in_study, capsys):
    in_study.rows(("a", "breath", "p1", "gone.c3d"), ("b", "breath", "p9", "gone.c3d"))
    assert main(["check"]) == 1
    err = capsys.readouterr().err.splitlines()
    assert len(err) == 2


@pytest.mark.parametrize(
    "words",
    [
        ["fit", "nobody"],
        ["markers", "a"],
        ["report", "nobody"],
        ["check", "--recordings", "none.tsv"],
        ["markers", "a", "--job", "{"],
        ["tabulate", "--subjects", "none.tsv"],
    ],
)
def test_error_is_one_line_and_exit_code_1(in_study, capsys, words):
    in_study.rows(("a", "breath", "p1", "gone.c3d"))
    assert main(words) == 1
    err = capsys.readouterr().err
    assert err.startswith("pleura: ")
    assert len(err.splitlines()) == 1


def test_unusable_row_in_the_workflow_is_a_result(in_study, capsys):
    in_study.rows(("a", "breath", "p1", "gone.c3d"))
    assert main(["markers", "a", "--keep-going"]) == 0
    assert "not used" in capsys.readouterr().out
    assert (in_study.folder / "results" / "a" / "markers.json").exists()


def test_text_renamed_to_c3d_is_one_line(in_study, capsys):
    in_study.rows(("a", "breath", "p1", in_study.recording_file(content=b"hello, world\n" * 99)))
    assert main(["markers", "a"]) == 1
    err = capsys.readouterr().err
    assert "first.c3d" in err
    assert len(err.splitlines()) == 1


def test_version_names_the_code_that_runs(capsys):
    assert main(["version"]) == 0
    assert capsys.readouterr().out.startswith("pleura ")


def test_defect_of_ours_is_one_line_too(in_study, capsys, monkeypatch):
    monkeypatch.setattr("pipeline.__main__.places.fingerprint", lambda root: 1 / 0)
    assert main(["version"]) == 1
    err = capsys.readouterr().err
    assert "internal error in test_command_line.py" in err
    assert len(err.splitlines()) == 1
