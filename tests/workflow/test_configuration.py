"""Settings: defaults of the package, a study's changes, misspelt keys named."""

from __future__ import annotations

import pytest

from pipeline import configuration, places
from sim.errors import InputError


def write(folder, text):
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_defaults_are_complete_and_fit_their_dataclasses():
    config = configuration.load(None, {})
    for name, kind in configuration.SECTIONS.items():
        assert isinstance(configuration.section(name, config[name], "test"), kind)


def test_study_changes_only_what_it_names(tmp_path):
    default = configuration.read_yaml(places.default_config())
    path = write(tmp_path, "markers:\n  max_gap_s: 0.123\n")
    config = configuration.load(path, {"recordings": "my.tsv"})
    assert config["markers"] == default["markers"] | {"max_gap_s": 0.123}
    assert config["signature"] == default["signature"]
    assert config["recordings"] == "my.tsv"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("markrs:\n  max_gap_s: 1\n", r"markrs: is not a setting\. Did you mean markers"),
        (
            "markers:\n  max_gap: 1\n",
            r"markers\.max_gap: is not a setting\. Did you mean max_gap_s",
        ),
        ("markers:\n  max_gap_s: long\n", r"markers\.max_gap_s: is 'long', must be a number"),
        ("markers:\n  max_gap_s: true\n", r"must be a number"),
        ("markers: 3\n", r"markers: must hold"),
        ("seed: -1\n", r"seed: is -1, must be a whole number"),
        ("seed: many\n", r"seed: is 'many'"),
        ("recordings:\n", r"recordings: must be the path"),
        ("- a list\n", r"holds no 'key: value' lines"),
        ("markers: [\n", r"is not YAML"),
    ],
)
def test_slip_is_one_line_that_names_the_key(tmp_path, text, words):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=words) as caught:
        configuration.load(path, {})
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_missing_setting_is_named():
    values = dict(configuration.load(None, {})["signature"])
    del values["n_phase"]
    with pytest.raises(InputError, match=r"signature\.n_phase: is missing"):
        configuration.section("signature", values, "test")
