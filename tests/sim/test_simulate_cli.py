"""`pleura simulate`: what it refuses in one line, and the breaths it must reach."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from sim.cli import main, read_task, run_task
from sim.resting import RestingTorso
from sim.trajectory import load_motion
from sim.writing import write_summary

PROMISED = {
    "style", "duration_s", "breaths_per_min", "tidal_volume_l", "minute_ventilation_l_min",
    "rib_rotation_deg", "sternum_excursion_mm", "abdomen_excursion_mm", "diaphragm_excursion_mm",
    "rib_cage_share", "diaphragm_volume_l", "pleural_pressure_cmh2o", "abdominal_pressure_cmh2o",
    "abdomen_volume_error", "realtime_factor", "n_rigid_bodies", "n_particles",
    "n_muscle_elements", "end_expiratory_drift_ml", "seed", "version",
    "form", "step_s", "burst_rate_hz", "volume_fall_l", "volume_fall_share", "closed_glottis_s",
    "peak_gastric_pressure_cmh2o", "peak_alveolar_pressure_cmh2o", "peak_flow_l_s",
}  # fmt: skip


@pytest.fixture
def subjects(tmp_path: Path) -> Path:
    path = tmp_path / "who.tsv"
    path.write_text(
        "subject\tsex\tstature_m\tmass_kg\tposture\n"
        "001\tfemale\t1.62\t60\tsupine\n"
        "short\tmale\t0\t75\tupright\n"
        "empty\tmale\t1.80\t\tupright\n"
        "odd\tmale\ttall\t75\tupright\n"
        "prone\tmale\t1.80\t75\tprone\n"
    )
    return path


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["calmly"], "style 'calmly' does not exist. Did you mean calm?"),
        (["xyzzy"], "There are: calm, deep, vital_capacity, panting, forced_exhale, giggle,"),
        (["missing.xml"], "missing.xml: there is no such file."),
        (["vital_capacity", "--form", "papers"], "vital_capacity has no form 'papers'. There are"),
        (["calm", "--form", "printed"], "invalid choice: 'printed'"),
        (["cough", "--duration", "100"], "give 3.5 to 40 s"),
        ([], "the following arguments are required: STYLE"),
        (["calm", "--duration", "long"], "invalid float value: 'long'"),
        (["calm", "--duration", "nan"], "--duration is nan s"),
        (["calm", "--duration", "-3"], "give 4.3 to 300 s"),
        (["deep", "--duration", "5"], "give 8.2 to 300 s"),
        (["calm", "--posture", "prone"], "invalid choice: 'prone'"),
        (["calm", "--sex", "male"], "Give --stature-m, --mass-kg too."),
        (["calm", "--sex", "male", "--stature-m", "17", "--mass-kg", "70"], "stature is 17.0 m"),
        (["calm", "--subject", "x", "--subjects", "no.tsv"], "Name it with --subjects."),
        (["calm", "--stile", "x"], "unrecognized arguments: --stile x"),
    ],
)
def test_bad_words_are_one_line(
    words: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 1
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert said.err.startswith("pleura: ") and problem in said.err


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("2", "subject '2' has 0 rows. There are: 001, short"),
        ("short", "subject short: stature is 0.0 m"),
        ("empty", "subject empty: mass_kg is empty. Give --mass-kg."),
        ("odd", "could not convert string to float: 'tall'"),
        ("prone", "posture is 'prone'. Use upright or supine."),
    ],
)
def test_bad_rows_are_one_line(
    name: str, problem: str, subjects: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calm", "--subject", name, "--subjects", str(subjects)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and str(subjects) in said and problem in said


def test_bad_places_are_refused_before_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    before = sorted(tmp_path.rglob("*"))
    for words in (
        ["--json", str(tmp_path)],
        ["--out", str(tmp_path / "file" / "x.h5")],
        ["--json", "x", "--out", "x"],
    ):
        assert main(["calm", *words]) == 1
        assert capsys.readouterr().err.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_a_named_parameter_set_is_kept() -> None:
    assert read_task(["calm"]).parameters == "calibrated"
    assert read_task(["calm", "--parameters", "papers"]).parameters == "papers"


def test_a_subject_comes_from_the_table(subjects: Path) -> None:
    task = read_task(["deep", "--subject", "001", "--subjects", str(subjects), "--seed", "5"])
    assert (task.name, task.posture, task.seed) == ("001", "supine", 5)
    assert (task.subject.sex, task.subject.stature, task.subject.mass) == ("female", 1.62, 60.0)


def test_flags_come_before_the_table(subjects: Path) -> None:
    task = read_task(
        ["calm", "--subject", "empty", "--subjects", str(subjects), "--mass-kg", "80",
         "--posture", "supine", "--duration", "9"]
    )  # fmt: skip
    assert (task.subject.mass, task.posture, task.duration) == (80.0, "supine", 9.0)


def _run(resting: RestingTorso, *words: str) -> dict[str, Any]:
    return run_task(read_task(list(words)), resting)[1]


@pytest.fixture(scope="module")
def calm(resting: RestingTorso) -> dict[str, Any]:
    return _run(resting, "calm", "--duration", "13")


def test_figures_promised_are_there(calm: dict[str, Any], tmp_path: Path) -> None:
    assert PROMISED <= set(calm)
    write_summary(tmp_path / "calm.json", calm)
    assert json.loads((tmp_path / "calm.json").read_text())["style"] == "calm"
    assert set(calm["rib_rotation_deg"]["rib_L5"]) == {"pump", "bucket"}


def test_calm_breath(calm: dict[str, Any]) -> None:
    assert 0.35 <= calm["tidal_volume_l"] <= 0.70
    assert calm["abdomen_volume_error"] < 0.02
    assert calm["compartment_sum_error"] < 0.03
    assert calm["steady"], calm["not_steady_because"]
    assert calm["diaphragm_excursion_mm"] > 0 and calm["abdomen_excursion_mm"] > 0


@pytest.mark.slow
def test_calm_does_not_drift_in_a_minute(resting: RestingTorso) -> None:
    figures = _run(resting, "calm", "--duration", "61")
    assert figures["n_breaths"] == 14 and figures["steady"]
    short = _run(resting, "calm", "--duration", "13")
    shift = figures["end_expiratory_volume_l"] - short["end_expiratory_volume_l"]
    assert abs(shift) < 5e-3


@pytest.mark.slow
def test_deep_breath(resting: RestingTorso) -> None:
    figures = _run(resting, "deep")
    assert 2.0 <= figures["tidal_volume_l"] <= 3.5
    assert figures["abdomen_volume_error"] < 0.02
    assert figures["steady"], figures["not_steady_because"]


@pytest.mark.slow
def test_vital_capacity(resting: RestingTorso) -> None:
    figures = _run(resting, "vital_capacity")
    assert figures["vital_capacity_l"] > 3.0
    assert figures["compartment_sum_error"] < 0.03


CONTROLS = """<controls>
<spring name="diaphragm"><curve type="square" high="{high}" period="4" phase="2" /></spring>
</controls>"""


def test_a_control_file_is_run(resting: RestingTorso, tmp_path: Path) -> None:
    path = tmp_path / "mine.xml"
    path.write_text(CONTROLS.format(high=0.05))
    figures = _run(resting, str(path), "--duration", "4", "--posture", "upright")
    assert (figures["style"], figures["form"]) == ("mine", None)
    assert figures["breaths_per_min"] == 15.0
    assert figures["tidal_volume_l"] > 0.1
    path.write_text(CONTROLS.format(high=0.0))
    still = _run(resting, str(path), "--duration", "4")
    write_summary(tmp_path / "still.json", still)
    assert still["tidal_volume_l"] < 0.01


def test_a_bad_control_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.xml"
    path.write_text(CONTROLS.format(high=1.5))
    assert main([str(path)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"{path}:2: spring diaphragm: activation is 1.5" in said


@pytest.fixture
def solved(resting: RestingTorso, monkeypatch: pytest.MonkeyPatch) -> None:
    """Spare `main` the solution of the reference man's rest."""
    monkeypatch.setattr("sim.cli.rest_torso", lambda subject, parameters: resting)


@pytest.mark.usefixtures("solved")
def test_files_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, figures = tmp_path / "run" / "calm.h5", tmp_path / "run" / "calm.json"
    assert main(["calm", "--duration", "4.3", "--out", str(out), "--json", str(figures)]) == 0
    said = capsys.readouterr()
    assert said.err == "" and "not steady: one breath from rest" in said.out
    moved, about = load_motion(out)
    assert about["style"] == "calm" and about["posture"] == "upright"
    assert moved.elements is not None and len(moved.elements.group) > 1000
    assert json.loads(figures.read_text())["n_breaths"] == 1
    assert sorted(p.name for p in out.parent.iterdir()) == ["calm.h5", "calm.json"]


@pytest.mark.usefixtures("solved")
def test_a_diverged_run_leaves_its_state_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sim.simulate.SPEED_LIMIT", 1e-9)
    assert main(["calm", "--json", str(tmp_path / "calm.json")]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "diverged at" in said and "calm.unstable.npz" in said
    assert [p.name for p in tmp_path.iterdir()] == ["calm.unstable.npz"]
