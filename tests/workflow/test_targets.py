"""What may be asked for, and what a run then has to answer for."""

from __future__ import annotations

import pytest

from pipeline import places
from pipeline.workflow import check_targets, read_plan
from sim.errors import InputError


@pytest.fixture
def plan(in_study):
    path = in_study.recording_file()
    in_study.rows(
        ("subject1", "breath", "p1", path),
        ("subject2", "breath", "p1", "gone.c3d"),
        ("group", "breath", "p1", path),
    )
    return read_plan({})


def test_reports_pages_rules_and_files_of_results_are_known(plan):
    targets = ["reports/subject1.html", "./reports/group.html", "all", "results/subject1/fit.json"]
    check_targets(targets, ["all"], plan.study, ["results/{name,subject1|group}/fit.json"])


def test_file_that_no_rule_makes_is_one_line(plan):
    with pytest.raises(InputError, match=r"results/subject1/fit\.npz: nothing of this name"):
        check_targets(
            ["results/subject1/fit.npz"], ["all"], plan.study, ["results/{name}/fit.json"]
        )


def test_mistyped_report_is_answered_with_the_nearest(plan):
    with pytest.raises(InputError, match=r"Did you mean reports/subject1\.html") as caught:
        check_targets(["reports/subjetc1.html"], ["all"], plan.study)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["physiology", "papers"])
def test_a_page_that_no_recording_answers_for(plan, name):
    pages = [f"reports/{name}.html", f"reports/{name}.csv"]
    check_targets(pages, [], plan.study)
    assert plan.asked(pages) == ([], [])
    assert plan.asked([*pages, "reports/subject1.html"]) == (["subject1"], [])
    assert not set(pages) & set(plan.everything)
    with pytest.raises(InputError, match=rf"Did you mean reports/{name}\.html"):
        check_targets([f"reports/{name[:-1]}e{name[-1]}.html"], [], plan.study)


def test_target_like_nothing_lists_what_there_is(plan):
    with pytest.raises(InputError, match=r"There are: reports/subject1\.html"):
        check_targets(["zzz"], [], plan.study)


def test_run_answers_for_the_reports_it_was_asked_for(plan):
    assert plan.asked(["reports/subject1.html"]) == (["subject1"], [])


@pytest.mark.parametrize("targets", [[], ["all"], ["reports/group.html"]])
def test_pages_of_the_study_answer_for_every_row(plan, targets):
    names, lost = plan.asked(targets)
    assert names == ["subject1", "subject2"]
    assert len(lost) == 1
    assert "reserved" in lost[0]


def test_unusable_row_has_no_input_files_so_that_nothing_waits_for_them(plan):
    assert plan.files("subject2") == []
    assert len(plan.files("subject1")) == 1


def test_changed_stature_setting_version_or_torso_changes_the_job(plan, in_study, monkeypatch):
    before = plan.job("subject1", "fit")
    assert read_plan({}).job("subject1", "fit") == before
    assert read_plan({"seed": 5}).job("subject1", "fit") != before
    in_study.people(("p1", "female", "1.66", "60", "upright"))
    assert read_plan({}).job("subject1", "fit") != before
    in_study.people(("p1", "female", "1.65", "60", "upright"))
    assert read_plan({}).job("subject1", "fit") == before
    with monkeypatch.context() as other:
        other.setattr("pipeline.places.version", lambda: "9.9")
        assert read_plan({}).job("subject1", "fit") != before
    assert read_plan({}).job("subject1", "fit") == before
    monkeypatch.setattr("pipeline.places.torso_code", lambda: "another")
    assert read_plan({}).job("subject1", "fit") != before


def test_pages_follow_the_code_that_makes_them(tmp_path):
    for package in ("sim", "pipeline"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "x.csv").write_text("1")
    whole = places.fingerprint(tmp_path)
    torso = places.fingerprint(tmp_path, ("sim",))
    (tmp_path / "pipeline" / "x.csv").write_text("2")
    assert places.fingerprint(tmp_path) != whole
    assert places.fingerprint(tmp_path, ("sim",)) == torso
    (tmp_path / "sim" / "x.csv").write_text("2")
    assert places.fingerprint(tmp_path, ("sim",)) != torso
