"""Draw the figures of docs/methods/muscle.md and write its verdicts.

`python scripts/muscle_figures.py` writes `docs/figures/muscle_*.svg` and `muscle.csv`; it takes
some seconds.
"""

from __future__ import annotations

import csv
from dataclasses import asdict
from pathlib import Path

from pipeline.draw.muscle import convergence_svg, curves_svg, filmstrip_svg, motion_svg
from sim.muscle_comparison import Comparison, compare_laws

OUT = Path(__file__).resolve().parents[1] / "docs" / "figures"
CONTRACTION = (0.0, 0.1, 0.2, 0.3, 0.48, 0.7, 1.0, 2.0)
RELAXATION = (0.0, 0.1, 0.3, 0.5, 0.65, 0.8, 1.0, 2.0)
RELEASE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9)
"""s, frames of the film strips since what happens."""


def figures(compared: Comparison) -> dict[str, str]:
    """SVG by name."""
    n, both = compared.numbers, ("spring", "hill")
    on, off, let_go = n["activated_at"], n["deactivated_at"], n["released_at"]
    activation = {law: compared.activation[law] for law in both}
    return {
        "curves": curves_svg(compared.curves),
        "activation": motion_svg(
            compared.activation, marks={on: "full activation", off: "rest"},
            span=n["activation_end"],
        ),
        "release": motion_svg(compared.release, marks={let_go: "released"}, span=n["release_end"]),
        "release_weightless": motion_svg(
            compared.release_weightless, marks={let_go: "released"}, span=n["release_end"]
        ),
        "contraction_strip": filmstrip_svg(activation, [on + t for t in CONTRACTION], since=on),
        "relaxation_strip": filmstrip_svg(activation, [off + t for t in RELAXATION], since=off),
        "release_strip": filmstrip_svg(
            compared.release, [let_go + t for t in RELEASE], since=let_go
        ),
        "convergence": convergence_svg(compared.convergence),
    }  # fmt: skip


def main() -> None:
    """Write all files."""
    compared = compare_laws()
    for name, svg in figures(compared).items():
        (OUT / f"muscle_{name}.svg").write_text(svg, encoding="utf-8")
    rows = [asdict(row) for row in compared.verdicts]
    with (OUT / "muscle.csv").open("w", newline="", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
