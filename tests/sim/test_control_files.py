"""Control files: the printed example, one line for everything wrong, written as read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.control.channels import channel_names, group_members, shares
from sim.control.controls import CLOSED, Controls, Larynx, Spine, Spring
from sim.control.curves import Linear, Sawtooth, Sine, Square
from sim.control.reader import LARGEST, parse_controls, read_controls
from sim.control.writer import format_controls, write_controls
from sim.errors import ControlFileError
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.spine import DIRECTIONS, JOINTS
from sim.simulate import BREATH_STEP, LEVELS, group_activation

PRINTED = """<?xml version="1.0" ?>
<controls>
<spring name="diaphragm">
  <curve type="square" start="0.0" end="4.0"
    high="1.0" low="0.0" period="4.0" phase="2.0" />
</spring>
<spring name="inner">
  <curve type="sine" ampl="0.3" period="4.0" offset="1.0" />
</spring>
<spring name="outer">
  <curve type="sine" ampl="-0.3" period="4.0" offset="1.0" />
</spring>
</controls>
"""
SPRING = '<spring name="diaphragm"><curve type="linear" points="0 0.5" /></spring>'


def parse(text: str) -> Controls:
    return parse_controls(text.encode(), "x.xml")


def test_the_printed_example() -> None:
    """dilorenzo2009 section 8.1, with a root around it."""
    controls = parse(PRINTED)
    names = ["diaphragm", "internal_intercostals", "external_intercostals"]
    assert [s.name for s in controls.springs] == names
    assert [s.values for s in controls.springs] == ["activation"] + ["contraction_ratio"] * 2
    assert controls.run_duration == 12.0 and controls.run_cycle(12.0) == 4.0
    drive = controls.drive(12.0)
    found = {name: drive.activation[:, MUSCLE_GROUPS.index(name)] for name in names}
    one = round(1.0 / BREATH_STEP)
    second = np.arange(12) * one
    assert found["diaphragm"][second].tolist() == [1.0, 1.0] + [0.0] * 10
    # r = 0.7 is an activation of 0.6; r over 1 is none: a muscle cannot push
    outer = [0.0, 0.6, 0.0, 0.0] * 3
    assert found["external_intercostals"][second] == pytest.approx(outer, abs=1e-9)
    assert found["internal_intercostals"][
        second + 2 * one - 4 * one * (second >= 10 * one)
    ] == pytest.approx(outer, abs=1e-9)
    written = format_controls(controls)
    assert "inner" not in written and "outer" not in written
    assert parse(written) == controls


BAD = [
    ("", "1: the file ends too early (no element found)"),
    ("hello", "1: this is not XML"),
    (f"<controls>{SPRING}", "1: the file ends too early"),
    (f"<controls>{SPRING}</controls>\n<controls />", "2: there is more than one root element"),
    ("<springs />", "1: <springs> is outermost, where <controls> belongs"),
    ("<controls />", "1: <controls> has no <spring>"),
    ('<!DOCTYPE a [<!ENTITY a "b">]><controls />', "1: a document type or entity is declared"),
    ('<!DOCTYPE a SYSTEM "file:///etc/passwd"><controls />', "1: a document type or entity"),
    ("<controls>&a;</controls>", "1: this is not XML (undefined entity)"),
    ('<?xml version="1.0" encoding="odd"?><controls />', "1: this encoding cannot be read"),
    (f"<controls>\n{SPRING} 0.5</controls>", "2: text '0.5' stands between elements"),
    (f'<controls version="2">{SPRING}</controls>', "1: <controls> version is '2'"),
    (f'<controls versoin="1">{SPRING}</controls>', "'versoin' does not exist. Did you mean v"),
    (f'<controls step_s="0.1">{SPRING}</controls>', "step_s is 0.1. Give 0.0001 to 0.005."),
    (f'<controls duration_s="0">{SPRING}</controls>', "duration_s is 0. Give more than 0."),
    (f'<controls posture="prone">{SPRING}</controls>', "posture 'prone' does not exist. There are"),
    (f"<controls>\n{SPRING}{SPRING}</controls>", "2: <spring> diaphragm is there twice"),
    (f'<controls>{SPRING}<spine name="bow"><curve type="linear" points="0 1"/></spine></controls>',
     "direction 'bow' does not exist"),
    (f'<controls>{SPRING}<spine name="twist" joint="T1"><curve type="linear" points="0 1"/></spine>'
     "</controls>", "joint 'T1' does not exist. There are: L4-L5"),
    (f'<controls>{SPRING}<larynx><closed start="1"/></larynx></controls>', "<closed> has no end."),
    (f'<controls>{SPRING}<larynx><closed start="2" end="1"/></larynx></controls>', "from 2 to 1 s"),
    (f"<controls>{SPRING}<larynx /><larynx /></controls>", "<larynx> is there twice"),
]  # fmt: skip
BAD_CURVES = [
    (
        "diaphram",
        'type="linear" points="0 0"',
        "'diaphram' does not exist. Did you mean diaphragm?",
    ),
    ("diaphragm", 'type="sinus" ampl="1" period="1"', "'sinus' does not exist. Did you mean sine?"),
    ("diaphragm", 'ampl="1" period="1"', "<curve> has no type."),
    ("diaphragm", 'type="sine" period="1"', "<curve> has no ampl."),
    ("diaphragm", 'type="sine" ampl="1"', "<curve> has no period."),
    ("diaphragm", 'type="square" period="1"', "<curve> has no high."),
    ("diaphragm", 'type="linear"', "<curve> has no points."),
    ("diaphragm", 'type="sine" ampl="1" period="0"', "period is 0 s. Give more than 0."),
    ("diaphragm", 'type="sine" ampl="1" period="-2"', "period is -2 s."),
    ("diaphragm", 'type="sine" ampl="nan" period="1"', "ampl is 'nan'. Give a number."),
    ("diaphragm", 'type="sine" ampl="1" period="1e999"', "period is '1e999'. Give a number."),
    ("diaphragm", 'type="sine" ampl="much" period="1"', "ampl is 'much'. Give a number."),
    ("diaphragm", 'type="sine" ampl="1" period="1" start="3" end="2"', "end is 2 s, start 3 s."),
    ("diaphragm", 'type="sine" ampl="1" period="1" high="2"', "sine: attribute 'high' does not"),
    ("diaphragm", 'type="sine" ampl="1" amplitude="1" period="1"', "has ampl and amplitude"),
    ("diaphragm", 'type="square" ampl="1" high="1" period="1"', "has high or low beside ampl"),
    ("diaphragm", 'type="linear" points="0 0; 1 1"', "is no pair. Write 'time value'."),
    ("diaphragm", 'type="linear" points="0 0, 0 1"', "points do not go forward in time"),
]


@pytest.mark.parametrize(("text", "problem"), BAD)
def test_a_bad_file_is_one_line(text: str, problem: str) -> None:
    with pytest.raises(ControlFileError) as raised:
        parse(text)
    said = str(raised.value)
    assert said.startswith("x.xml:") and problem in said and "\n" not in said


@pytest.mark.parametrize(("name", "curve", "problem"), BAD_CURVES)
def test_a_bad_curve_names_its_line(name: str, curve: str, problem: str) -> None:
    with pytest.raises(ControlFileError) as raised:
        parse(f'<controls>\n<spring name="{name}">\n<curve {curve} /></spring></controls>')
    said = str(raised.value)
    line = 2 if name not in channel_names() else 3
    assert said.startswith(f"x.xml:{line}: ") and problem in said and "\n" not in said


@pytest.mark.parametrize(
    ("inside", "problem"),
    [
        ('<spring name="rectus"><curve type="square" high="1.5" period="1" /></spring>',
         "x.xml:2: spring rectus: activation is 1.5 at 0.5 s."),
        ('<spring name="rectus"><curve type="sine" ampl="0.5" period="1" /></spring>',
         "x.xml:2: spring rectus: activation is -0.5"),
        ('<spring name="rectus" values="contraction_ratio"><curve type="linear" points="0 0.4" />'
         "</spring>", "contraction ratio is 0.4 at 0 s. Keep the sum of its curves within 0.5 to"),
        ('<spring name="intercostals"><curve type="linear" points="0 0.6" /></spring>\n'
         '<spring name="outer"><curve type="linear" points="0 0.6" /></spring>',
         "external_intercostals is driven by several springs: their activation is 1.2"),
        (SPRING + '<spine name="flexion"><curve type="linear" points="0 400" /></spine>',
         "x.xml:2: spine: flexion goes from 400 to 400 degrees. Give"),
        (SPRING + '<spine name="lateral" joint="L4-L5"><curve type="linear" points="0 10" />'
         "</spine>", "lateral at L4-L5 goes from 10 to 10 degrees. Give -9 to 9."),
        (SPRING + '<larynx><curve type="linear" points="0 -1" /></larynx>',
         "x.xml:2: larynx: resistance is -1 cmH2O s/L"),
    ],
)  # fmt: skip
def test_values_out_of_bounds_are_one_line(inside: str, problem: str) -> None:
    controls = parse(f'<controls values="activation">\n{inside}</controls>')
    with pytest.raises(ControlFileError) as raised:
        controls.drive(2.0)
    assert problem in str(raised.value) and "\n" not in str(raised.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    large = tmp_path / "large.xml"
    large.write_bytes(b"<controls>" + b" " * LARGEST)
    for path, problem in (
        (large, "is larger than 1 MB"),
        (tmp_path, "is no file"),
        (tmp_path / "missing.xml", "there is no such file"),
    ):
        with pytest.raises(ControlFileError) as raised:
            read_controls(path)
        assert str(path) in str(raised.value) and problem in str(raised.value)


@given(st.binary(max_size=200))
@settings(max_examples=100)
def test_any_bytes_are_one_line(content: bytes) -> None:
    with pytest.raises(ControlFileError) as raised:
        parse_controls(b"<controls>" + content, "x.xml")
    assert "\n" not in str(raised.value)


def test_every_channel_reaches_a_muscle() -> None:
    assert set(LEVELS) | set(MUSCLE_GROUPS) <= set(channel_names())
    for members in group_members().values():
        assert set(members) <= set(LEVELS) | set(MUSCLE_GROUPS)
    for name in channel_names():
        given = shares(name)
        assert given.max() <= 1.0 and given.sum() > 0.0 and (given >= 0.0).all()


def test_a_level_takes_its_accessory_muscles_along_unless_alone() -> None:
    spring = '<spring name="external_intercostals"{}><curve type="linear" points="0 0.5"/></spring>'
    whole, alone = (
        parse(f"<controls>{spring.format(word)}</controls>").drive(0.01).activation[0]
        for word in ("", ' alone="true"')
    )
    np.testing.assert_allclose(whole, group_activation(np.array([0.5, 0.0, 0.0, 0.0])))
    assert alone[MUSCLE_GROUPS.index("external_intercostals")] == 0.5
    assert np.count_nonzero(alone) == 1


def test_larynx_and_spine() -> None:
    drive = parse(
        f"<controls>{SPRING}"
        '<larynx><curve type="linear" points="0 30" /><closed start="0.5" end="0.7" /></larynx>'
        '<spine name="flexion"><curve type="linear" points="0 20" /></spine>'
        '<spine name="twist" joint="T5-T8"><curve type="linear" points="0 10" /></spine>'
        "</controls>"
    ).drive(1.0)
    assert drive.larynx is not None and drive.bend is not None
    closed, opened = round(0.5 / BREATH_STEP), round(0.7 / BREATH_STEP)
    assert drive.larynx[[0, closed - 1, closed, opened - 1, opened]] == pytest.approx(
        [30 * 98066.5, 30 * 98066.5, CLOSED, CLOSED, 30 * 98066.5]
    )
    assert np.degrees(drive.bend[0, :, 1].sum()) == pytest.approx(20.0)
    assert np.degrees(drive.bend[0, JOINTS.index("T5-T8"), 2]) == pytest.approx(10.0)
    assert np.count_nonzero(drive.bend[0, :, 2]) == 1


number = st.floats(-1e6, 1e6)
length = st.floats(1e-3, 1e3)
times = st.fixed_dictionaries(
    {"phase": number, "start": st.floats(0.0, 10.0), "end": st.none() | st.floats(11.0, 50.0)}
)
CURVES = st.one_of(
    st.builds(lambda t, **k: Sine(**t, **k), times, period=length, amplitude=number, offset=number),
    st.builds(lambda t, **k: Square(**t, **k), times, period=length, high=number, low=number,
              share=st.floats(0.01, 0.99)),
    st.builds(lambda t, **k: Sawtooth(**t, **k), times, period=length, high=number, low=number,
              rise=st.floats(0.01, 0.3), hold=st.floats(0.0, 0.3), release=st.floats(0.0, 0.3)),
    st.builds(
        lambda t, **k: Linear(**t, **k), times,
        points=st.lists(st.tuples(number, number), min_size=1, max_size=5, unique_by=lambda p: p[0])
        .map(sorted).map(tuple),
    ),
)  # fmt: skip
SOME = st.lists(CURVES, min_size=1, max_size=3).map(tuple)
WORDS = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), max_size=20)
# another name of one group is written as that group
ALIASES = {name for name, members in group_members().items() if list(members.values()) == [1.0]}
SPRINGS = st.builds(
    Spring, name=st.sampled_from([n for n in channel_names() if n not in ALIASES]), curves=SOME,
    values=st.sampled_from(["activation", "contraction_ratio"]), source=WORDS, note=WORDS,
)  # fmt: skip
SPINES = st.builds(
    Spine, name=st.sampled_from(list(DIRECTIONS)), joint=st.none() | st.sampled_from(JOINTS),
    curves=SOME, source=WORDS, note=WORDS,
)  # fmt: skip
SHUT = st.tuples(st.floats(0.0, 5.0), st.floats(5.1, 9.0))
WHOLE = st.builds(
    Controls, name=WORDS.filter(bool),
    springs=st.lists(SPRINGS, min_size=1, max_size=3, unique_by=lambda s: s.name).map(tuple),
    spines=st.lists(SPINES, max_size=2, unique_by=lambda s: (s.name, s.joint)).map(tuple),
    larynx=st.none() | st.builds(Larynx, curves=st.just(()) | SOME,
                                 closed=st.lists(SHUT, max_size=2).map(tuple), source=WORDS),
    duration=st.none() | length, step=st.none() | st.floats(1e-4, 5e-3),
    frames=st.none() | st.floats(1.0, 1000.0), cycle=st.none() | length,
    posture=st.none() | st.sampled_from(["upright", "supine"]), source=WORDS, note=WORDS,
)  # fmt: skip


@given(WHOLE)
@settings(max_examples=100)
def test_what_is_written_is_read_back(controls: Controls) -> None:
    text = format_controls(controls)
    assert parse(text) == controls
    assert format_controls(parse(text)) == text


def test_a_file_on_disk_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "new" / "printed.xml"
    write_controls(path, parse(PRINTED))
    assert read_controls(path) == parse(PRINTED)
