"""The muscle laws of section 4.3: drawings and verdicts of `sim.muscle_comparison`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from pipeline.draw.muscle import curves_svg, filmstrip_svg, motion_svg
from pipeline.papers.table import Judged, Printed, Verdict
from pipeline.records import read_json, write_json, write_text
from pipeline.validation.table import FINDING
from sim.muscle_comparison import FAILS, HOLDS, PARTLY, Comparison, compare_laws

SECTION = "muscle laws"
OUR_VERDICT = {HOLDS: Verdict.HOLDS, PARTLY: Verdict.PARTLY, FAILS: Verdict.FAILS}
NOTHING_PRINTED = ("–", "(not printed)")
LAWS = ("spring", "hill")
AFTER_ACTIVATION = (0.0, 0.1, 0.2, 0.3, 0.48, 0.7, 1.0, 2.0)
AFTER_REST = (0.0, 0.1, 0.3, 0.5, 0.65, 0.8, 1.0, 2.0)
AFTER_RELEASE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9)
"""s, pictures of the strips since what happens."""


def pictures(compared: Comparison) -> dict[str, str]:
    """Figs 4.2 to 4.7 as SVG by name."""
    n = compared.numbers
    on, off, let_go = n["activated_at"], n["deactivated_at"], n["released_at"]
    both = {law: compared.activation[law] for law in LAWS}
    marks = {on: "full activation", off: "rest"}
    return {
        "muscle_curves": curves_svg(compared.curves),
        "muscle_activation": motion_svg(both, marks=marks, span=n["activation_end"]),
        "muscle_release": motion_svg(
            compared.release, marks={let_go: "released"}, span=n["release_end"]
        ),
        "muscle_contraction_strip": filmstrip_svg(
            both, [on + t for t in AFTER_ACTIVATION], since=on
        ),
        "muscle_relaxation_strip": filmstrip_svg(both, [off + t for t in AFTER_REST], since=off),
        "muscle_release_strip": filmstrip_svg(
            compared.release, [let_go + t for t in AFTER_RELEASE], since=let_go
        ),
    }


def write_muscles(folder: Path) -> None:
    """Run the comparison and write muscles.json and its drawings.

    Parameters
    ----------
    folder : results of the page
    """
    compared = compare_laws()
    for name, text in pictures(compared).items():
        write_text(folder / f"{name}.svg", text)
    rows = [
        {"quantity": v.quantity, "printed": v.printed, "ours": v.ours, "verdict": v.verdict,
         "why": v.why}
        for v in compared.verdicts
        if v.printed not in NOTHING_PRINTED
    ]  # fmt: skip
    write_json(folder / "muscles.json", {"rows": rows})


def _judged(number: int, row: Mapping[str, str]) -> Judged:
    printed = Printed(
        key=f"muscle_{number}",
        section=SECTION,
        paper="dilorenzo2009",
        place="section 4.3, Figs 4.2 to 4.7",
        form="",
        quantity=row["quantity"],
        figure="",
        printed=row["printed"],
        low=math.nan,
        high=math.nan,
        unit=FINDING,
        band="",
        note="",
    )
    return Judged(row=printed, value=math.nan, shown=row["ours"],
                  verdict=OUR_VERDICT[row["verdict"]], why=row["why"])  # fmt: skip


def judged_muscles(folder: Path) -> list[Judged]:
    """Verdicts of the comparison as rows of the page."""
    rows = read_json(folder / "muscles.json")["rows"]
    return [_judged(k, row) for k, row in enumerate(rows, start=1)]
