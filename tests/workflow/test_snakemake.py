"""The workflow as a person runs it: real Snakemake and rules, stages that cost nothing."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

# A `pleura` whose stages only leave records; `slow` sleeps until it is killed once.
PLEURA = """\
#!{python}
import sys, time
from pathlib import Path
from pipeline import stages
from pipeline.__main__ import main

def fake(job, folder, processes):
    if job.name == "slow" and job.stage == "fit" and not Path("killed").exists():
        Path("started").touch()
        time.sleep(60)
    with open("ran.txt", "a") as log:
        log.write(f"{{job.name}} {{job.stage}}\\n")
    return dict(inspiration_time_s=1.0, expiration_time_s=2.0, n_used=3, n_cycles=4)

for name in ("markers", "signature", "fit", "posterior"):
    stages.STAGES[name] = fake
sys.exit(main())
"""


@pytest.fixture
def workflow(study, tmp_path, monkeypatch):
    command = tmp_path / "bin" / "pleura"
    command.parent.mkdir()
    command.write_text(PLEURA.format(python=sys.executable), encoding="utf-8")
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    study.bin = f"{command.parent}{os.pathsep}{Path(sys.executable).parent}"
    monkeypatch.setenv("PATH", f"{study.bin}{os.pathsep}{os.environ['PATH']}")
    path = study.recording_file()
    study.rows(("good", "breath", "p1", path), ("lost", "breath", "p1", "gone.c3d"))
    return study


def snakemake(study, *words):
    path = f"{study.bin}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["snakemake", *words],
        cwd=study.folder,
        env={**os.environ, "PATH": path},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def told(run):
    """Return what was told on the terminal, without the one line about the profile."""
    lines = (run.stdout + run.stderr).splitlines()
    return [line for line in lines if line and "workflow specific profile" not in line]


def ran(study):
    path = study.folder / "ran.txt"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    path.unlink(missing_ok=True)
    return sorted(lines)


def test_mistyped_report_and_setting_are_one_line_before_any_job(workflow):
    run = snakemake(workflow, "reports/godo.html")
    assert run.returncode == 1
    assert told(run) == [
        "reports/godo.html: nothing of this name can be made. Did you mean reports/good.html?"
    ]
    run = snakemake(workflow, "reports/good.html", "--config", "sede=3")
    assert run.returncode == 1
    assert "sede: is not a setting. Did you mean seed" in "".join(told(run))
    assert len(told(run)) == 1
    assert ran(workflow) == []


@pytest.mark.slow
def test_report_is_made_once_and_again_when_the_stature_changes(workflow):
    run = snakemake(workflow, "reports/good.html")
    assert (run.returncode, len(ran(workflow))) == (0, 4)
    assert (workflow.folder / "reports" / "good.html").exists()
    run = snakemake(workflow, "reports/good.html")
    assert run.returncode == 0
    assert "Nothing to be done" in "".join(told(run))
    assert ran(workflow) == []
    workflow.people(("p1", "female", "1.66", "60", "upright"))
    assert snakemake(workflow, "reports/good.html").returncode == 0
    assert "good fit" in ran(workflow)


@pytest.mark.slow
def test_unusable_row_stops_no_other_and_ends_with_exit_code_1(workflow):
    first = snakemake(workflow)
    again = snakemake(workflow)
    for run in (first, again):
        assert run.returncode == 1
        last = told(run)[-1]
        assert last.startswith("Not used: lost: ")
        assert "there is no file" in last
        assert "Traceback" not in "".join(told(run))
    reports = workflow.folder / "reports"
    pages = ("good.html", "lost.html", "error_table.html", "error_table.csv", "group.html")
    for page in (*pages, "index.html"):
        assert (reports / page).exists()
    listed = (reports / "index.html").read_text(encoding="utf-8")
    assert listed.count('<tr><td><a href="') == 4
    assert "there is no file" in (reports / "group.html").read_text(encoding="utf-8")
    assert "there is no file" in (reports / "lost.html").read_text(encoding="utf-8")
    assert snakemake(workflow, "reports/good.html").returncode == 0


@pytest.mark.slow
def test_file_that_appears_makes_its_row_run(workflow):
    assert snakemake(workflow, "reports/lost.html").returncode == 1
    (workflow.folder / "config" / "gone.c3d").write_bytes(b"here now")
    assert snakemake(workflow, "reports/lost.html").returncode == 0
    assert "lost posterior" in ran(workflow)


@pytest.mark.slow
def test_tables_given_on_the_command_line(workflow):
    mine = workflow.folder / "my.tsv"
    mine.write_text(
        "recording\tkind\tsubject\tpath\n007\tbreath\tp1\tdata/first.c3d\n", encoding="utf-8"
    )
    run = snakemake(workflow, "reports/007.html", "--config", "recordings=my.tsv")
    assert run.returncode == 0, told(run)
    assert (workflow.folder / "reports" / "007.html").exists()


@pytest.mark.slow
def test_killed_run_goes_on_where_it_stopped(workflow):
    path = workflow.recording_file("second.c3d")
    workflow.rows(("slow", "breath", "p1", path))
    run = subprocess.Popen(
        ["snakemake", "reports/slow.html"],
        cwd=workflow.folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    for _ in range(600):
        if (workflow.folder / "started").exists():
            break
        time.sleep(0.1)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    (workflow.folder / "killed").touch()
    locked = snakemake(workflow, "reports/slow.html")
    assert locked.returncode == 1
    assert any("snakemake --unlock" in line for line in told(locked))
    assert snakemake(workflow, "--unlock").returncode == 0
    ran(workflow)
    assert snakemake(workflow, "reports/slow.html").returncode == 0
    assert ran(workflow) == ["slow fit", "slow posterior"]
