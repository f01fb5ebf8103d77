"""A stage leaves a record whatever happens, and never an old file beside a new failure."""

from __future__ import annotations

import pytest

from pipeline.job import make_job, read_job
from pipeline.records import read_json
from pipeline.run import run_stage
from pipeline.status import forget_failures, write_unusable
from pipeline.workflow import read_plan
from sim.errors import InputError, TorsoError


@pytest.fixture
def job(in_study):
    in_study.rows(("a", "breath", "p1", in_study.recording_file()))
    plan = read_plan({})

    def make(stage):
        return make_job(plan.study.entry("a"), stage, plan.config)

    return make


def good(job, folder, processes):
    return {"summary": "3 markers"}


def test_good_stage_records_what_ran(job, tmp_path):
    line = run_stage(good, job("markers"), tmp_path, 1)
    record = read_json(tmp_path / "markers.json")
    assert line.startswith("a: markers: 3 markers (")
    assert record["status"] == "ok"
    assert record["run"]["seed"] == job("markers").seed
    assert record["run"]["settings"]["markers"] == job("markers").settings["markers"]


def test_unusable_input_is_recorded_and_passed_on(job, tmp_path):
    def fails(job, folder, processes):
        raise InputError("x.c3d: place: is wrong. Mend it.")

    with pytest.raises(InputError):
        run_stage(fails, job("markers"), tmp_path, 1)
    assert run_stage(good, job("signature"), tmp_path, 1) == ""
    record = read_json(tmp_path / "signature.json")
    assert record["status"] == "unusable"
    assert record["stage"] == "markers"
    assert record["reason"] == "x.c3d: place: is wrong. Mend it."


def test_row_with_a_problem_never_reaches_the_stage(job, tmp_path, in_study):
    in_study.rows(("a", "breath", "p1", "gone.c3d"))
    plan = read_plan({})
    bad = make_job(plan.study.entry("a"), "markers", plan.config)
    with pytest.raises(TorsoError, match="there is no file"):
        run_stage(good, bad, tmp_path, 1)
    assert read_json(tmp_path / "markers.json")["status"] == "unusable"


def test_defect_of_ours_is_one_line_and_keeps_its_traceback(job, tmp_path):
    def breaks(job, folder, processes):
        raise KeyError("levels\nand more")

    with pytest.raises(TorsoError, match="internal error in 'markers'") as caught:
        run_stage(breaks, job("markers"), tmp_path, 1)
    assert "\n" not in str(caught.value)
    assert read_json(tmp_path / "markers.json")["status"] == "failed"
    assert "Traceback" in (tmp_path / "markers_error.txt").read_text(encoding="utf-8")


def test_files_of_an_earlier_run_are_gone_after_a_failure(job, tmp_path):
    (tmp_path / "markers.npz").write_bytes(b"old")

    def fails(job, folder, processes):
        raise InputError("bad.")

    with pytest.raises(InputError):
        run_stage(fails, job("markers"), tmp_path, 1)
    assert not (tmp_path / "markers.npz").exists()


def test_stage_before_which_nothing_ran_says_so(job, tmp_path):
    run_stage(good, job("signature"), tmp_path, 1)
    assert "'markers' has not run" in read_json(tmp_path / "signature.json")["reason"]


def test_job_survives_the_command_line(job):
    assert read_job(job("fit").text) == job("fit")
    with pytest.raises(InputError, match="is not a job"):
        read_job("{}")


def test_what_broke_is_tried_again_what_is_unusable_is_not(job, tmp_path):
    for name, status in (("broken", "failed"), ("bad", "unusable")):
        path = tmp_path / name / "markers.json"
        write_unusable(path, job("markers"), "why", stage="markers", status=status)
    forget_failures(tmp_path, ["broken", "bad", "new"])
    assert not (tmp_path / "broken" / "markers.json").exists()
    assert (tmp_path / "bad" / "markers.json").exists()
