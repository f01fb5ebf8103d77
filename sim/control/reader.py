"""Read an XML control file: no entity, no document type, every complaint one line."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from sim.control.attributes import (
    CURVES,
    TIMES,
    check_names,
    choice,
    length,
    needed,
    number,
    read_curve,
)
from sim.control.channels import our_name, unknown
from sim.control.controls import Controls, Larynx, Spine, Spring
from sim.control.curves import Curve, Sine
from sim.errors import ControlFileError, ParameterError
from sim.model.muscles import MUSCLE_GROUPS
from sim.model.spine import DIRECTIONS, JOINTS
from sim.rest import GRAVITY

LARGEST = 1_000_000
"""Bytes of a control file."""
LEAST_STEP, MOST_STEP = 1e-4, 5e-3
MOST_FRAMES = 1000.0
VALUES = ("activation", "contraction_ratio")
SAID = ("source", "note")
ELEMENTS = {
    "controls": ("version", "name", "duration_s", "step_s", "frames_per_s", "cycle_s",
                 "posture", "values", *SAID),
    "spring": ("name", "values", "alone", *SAID),
    "spine": ("name", "joint", *SAID),
    "larynx": SAID,
    "curve": ("type", *TIMES, *dict.fromkeys(a for _, own in CURVES.values() for a in own)),
    "closed": ("start", "end"),
}  # fmt: skip
INSIDE = {
    "": ("controls",),
    "controls": ("spring", "spine", "larynx"),
    "spring": ("curve",),
    "spine": ("curve",),
    "larynx": ("curve", "closed"),
}


@dataclass(slots=True)
class _Element:
    """An element while its children are read."""

    tag: str
    said: Mapping[str, str]
    line: int
    curves: list[Curve] = field(default_factory=list)
    closed: list[tuple[float, float]] = field(default_factory=list)


class _Reader:
    """Handlers of one parse."""

    def __init__(self, place: str) -> None:
        self.place = place
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = lambda *_: self._refuse_declaration()
        self.parser.EntityDeclHandler = lambda *_: self._refuse_declaration()
        self.open: list[_Element] = []
        self.root: _Element | None = None
        self.springs: list[Spring] = []
        self.spines: list[Spine] = []
        self.larynx: Larynx | None = None

    def read(self, content: bytes) -> Controls:
        """Parse a whole file."""
        try:
            self.parser.Parse(content, True)
        except expat.ExpatError as error:
            self._fail(_reason(error), error.lineno)
        except (LookupError, ValueError) as error:
            self._fail(f"this encoding cannot be read ({error}). Write UTF-8", 1)
        if self.root is None:
            self._fail("there is no <controls> in it. Put everything in one", 1)
        return self._controls(self.root)

    def _fail(self, problem: str, line: int | None = None) -> NoReturn:
        where = self.parser.CurrentLineNumber if line is None else line
        words = " ".join(problem.split())
        end = "" if words.endswith((".", "?")) else "."
        raise ControlFileError(f"{self.place}:{where}: {words}{end}")

    def _refuse_declaration(self) -> NoReturn:
        self._fail("a document type or entity is declared. Leave it out: none is read")

    def _text(self, text: str) -> None:
        if text.strip():
            self._fail(f"text '{text.strip()[:40]}' stands between elements. Leave it out")

    def _start(self, tag: str, said: Mapping[str, str]) -> None:
        inside = self.open[-1].tag if self.open else ""
        allowed = INSIDE.get(inside, ())
        if tag not in allowed:
            where = f"in <{inside}>" if inside else "outermost"
            fits = ", ".join(f"<{a}>" for a in allowed) or "nothing"
            self._fail(f"<{tag[:40]}> is {where}, where {fits} belongs. Move or rename it")
        try:
            check_names(f"<{tag}>", said, ELEMENTS[tag])
        except ParameterError as error:
            self._fail(str(error))
        self.open.append(_Element(tag, dict(said), self.parser.CurrentLineNumber))

    def _end(self, tag: str) -> None:
        element = self.open.pop()
        try:
            self._finish(element, self.open[-1] if self.open else element)
        except ParameterError as error:
            self._fail(f"<{tag}> {error}", element.line)

    def _finish(self, element: _Element, parent: _Element) -> None:
        if element.tag == "curve":
            parent.curves.append(read_curve(element.said))
        elif element.tag == "closed":
            parent.closed.append(_closure(element.said))
        elif element.tag == "controls":
            self.root = element
        elif element.tag == "larynx":
            if self.larynx is not None:
                raise ParameterError(f"is there twice, first in line {self.larynx.line}. Keep one.")
            self.larynx = Larynx(curves=tuple(element.curves), closed=tuple(element.closed),
                                 line=element.line, **_said(element))  # fmt: skip
        elif not element.curves:
            raise ParameterError(f"'{element.said.get('name', '')[:40]}' has no <curve>. Add one.")
        elif element.tag == "spine":
            self._add_spine(element)
        else:
            self._add_spring(element)

    def _add_spring(self, element: _Element) -> None:
        alone = choice(element.said, "alone", ("true", "false"), "false") == "true"
        name = our_name(needed(element.said, "name"))
        if alone and name not in MUSCLE_GROUPS:
            raise unknown("single muscle group", name, MUSCLE_GROUPS)
        for other in self.springs:
            if (other.name, other.alone) == (name, alone):
                raise ParameterError(
                    f"{name} is there twice, first in line {other.line}. Put its curves in one."
                )
        default = _values(self.open[0].said, element.curves)
        values = choice(element.said, "values", VALUES, default)
        self.springs.append(
            Spring(name=name, curves=tuple(element.curves), values=values, alone=alone,
                   line=element.line, **_said(element))
        )  # fmt: skip

    def _add_spine(self, element: _Element) -> None:
        name, joint = needed(element.said, "name"), element.said.get("joint")
        if name not in DIRECTIONS:
            raise unknown("direction", name, DIRECTIONS)
        if joint is not None and joint not in JOINTS:
            raise unknown("joint", joint, JOINTS)
        for other in self.spines:
            if (other.name, other.joint) == (name, joint):
                raise ParameterError(
                    f"{name} is there twice, first in line {other.line}. Put its curves in one."
                )
        self.spines.append(
            Spine(name=name, joint=joint, curves=tuple(element.curves), line=element.line,
                  **_said(element))
        )  # fmt: skip

    def _controls(self, root: _Element) -> Controls:
        said = root.said
        try:
            if said.get("version", "1") != "1":
                raise ParameterError(f"version is '{said['version'][:40]}'. This program reads 1.")
            if not self.springs:
                raise ParameterError("has no <spring>. Add one.")
            return Controls(
                name=said.get("name") or Path(self.place).stem,
                duration=length(said, "duration_s", 0.0, math.inf),
                step=length(said, "step_s", LEAST_STEP, MOST_STEP),
                frames=length(said, "frames_per_s", 1.0, MOST_FRAMES),
                cycle=length(said, "cycle_s", 0.0, math.inf),
                posture=choice(said, "posture", tuple(GRAVITY), "") or None,
                springs=tuple(self.springs),
                spines=tuple(self.spines),
                larynx=self.larynx,
                place=self.place,
                **_said(root),
            )
        except ParameterError as error:
            self._fail(f"<controls> {error}", root.line)


def _reason(error: expat.ExpatError) -> str:
    words = expat.ErrorString(error.code)
    if words == expat.errors.XML_ERROR_JUNK_AFTER_DOC_ELEMENT:
        return "there is more than one root element. Put everything in one <controls>"
    if words in (expat.errors.XML_ERROR_NO_ELEMENTS, expat.errors.XML_ERROR_UNCLOSED_TOKEN):
        return f"the file ends too early ({words}). Close what is open, or copy it anew"
    return f"this is not XML ({words}). Mend that line"


def _said(element: _Element) -> dict[str, str]:
    return {name: element.said.get(name, "") for name in SAID}


def _values(root: Mapping[str, str], curves: list[Curve]) -> str:
    """What a spring's values are when it does not say so itself.

    The listing of dilorenzo2009 section 8.1 mixes both without a word. A sine about exactly 1, the
    rest length, is a contraction ratio: as an activation it would always pass 1.
    """
    printed = all(isinstance(c, Sine) and c.offset == 1.0 and c.amplitude != 0.0 for c in curves)
    return choice(root, "values", VALUES, VALUES[1] if printed else VALUES[0])


def _closure(said: Mapping[str, str]) -> tuple[float, float]:
    start, end = number(said, "start"), number(said, "end")
    if not 0.0 <= start < end:
        raise ParameterError(f"goes from {start:g} to {end:g} s. Let it end after it starts.")
    return start, end


def parse_controls(content: bytes, place: str) -> Controls:
    """Controls from the bytes of a file.

    Parameters
    ----------
    place : name of the file for complaints

    Raises
    ------
    ControlFileError
        one line: file, line, what is wrong, how to mend it
    """
    if len(content) > LARGEST:
        raise ControlFileError(
            f"{place}: is larger than {LARGEST // 10**6} MB. A control file has a few kilobytes:"
            " check its name."
        )
    return _Reader(place).read(content)


def read_controls(path: Path) -> Controls:
    """Read a control file.

    Raises
    ------
    ControlFileError
        if it cannot be read or is not as `docs/methods/control.md` has it
    """
    if not path.is_file():
        what = "is no file" if path.exists() else "there is no such file"
        raise ControlFileError(f"{path}: {what}. Check its name.")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except OSError as error:
        raise ControlFileError(f"{path}: cannot be read ({error.strerror}).") from error
    return parse_controls(content, str(path))
