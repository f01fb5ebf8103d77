"""`pleura`: one subcommand a stage; each parses, calls one function and writes."""

from __future__ import annotations

import argparse
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from pipeline import configuration, places
from pipeline.render.command import add_words
from pipeline.skin_words import METHODS, UNITS, UPS
from sim.errors import TorsoError

STAGE_HELP = {
    "markers": "read and clean a recording",
    "signature": "find breaths and average them",
    "fit": "fit the torso's activations to the breath",
    "posterior": "give the activations intervals",
    "audio": "read a sound and tell which kind it is",
    "pressure": "turn the sound of a laugh into lung pressure",
    "calls": "find the calls and bouts of a laugh",
    "follow": "let the torso follow the sound",
    "retraining": "lead the fitted breath to a slower, more diaphragmatic one",
    "report": "write the report of a recording",
    "retraining_report": "write the page of a breath retraining",
}
PAGE_HELP = {
    "tabulate": "write reports/error_table.csv and .html",
    "group": "write reports/group.html",
}


def _add_study(parser: argparse.ArgumentParser) -> None:
    for table in configuration.TABLES:
        parser.add_argument(f"--{table}", metavar="TABLE", help=f"instead of config/{table}.tsv")


def _add_skin(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("trajectory", type=Path, metavar="TRAJECTORY.h5")
    add("--out", type=Path, metavar="OUT.h5", help="write the trajectory with the skin")
    add("--binding", type=Path, metavar="TABLE.csv", help="write the binding, to be edited")
    add("--use", type=Path, metavar="TABLE.csv", help="take an edited binding")
    add("--method", choices=METHODS, help="of binding; nearest is the published one")
    add("--age-years", type=float, metavar="YEARS", help="of the human skin")
    add("--fat-mm", type=float, metavar="MM", help="least layer over the belly's wall")
    add("--mesh", type=Path, metavar="MESH.obj|MESH.glb", help="a mesh of one's own as the skin")
    add("--landmarks", type=Path, metavar="TABLE.csv", help="places on the mesh: landmark,x,y,z")
    add("--unit", choices=tuple(UNITS), default="m", help="of the mesh")
    add("--up", choices=tuple(UPS), default="y", help="axis of the mesh")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="pleura", description="From a recorded breath to a fitted, breathing torso."
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for stage, text in STAGE_HELP.items():
        sub = commands.add_parser(stage, help=text, description=f"{text.capitalize()}.")
        sub.add_argument("name", help="a row of the table of recordings")
        sub.add_argument("--job", metavar="JSON", help="given by the workflow; else read here")
        sub.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N")
        sub.add_argument(
            "--keep-going",
            action="store_true",
            help="exit 0 when the recording cannot be used: its record tells",
        )
        _add_study(sub)
    for page, text in PAGE_HELP.items():
        sub = commands.add_parser(page, help=text, description=f"{text.capitalize()}.")
        sub.add_argument("names", nargs="*", help="recordings; none: every row of the study")
        sub.add_argument("--problems", help="rows without a report; else read from the tables")
        _add_study(sub)
    validate = commands.add_parser("validate", help="simulate a person of reports/physiology.html")
    validate.add_argument("sex", choices=("male", "female"))
    commands.add_parser("physiology", help="write reports/physiology.html and .csv")
    reproduce = commands.add_parser("reproduce", help="make runs of reports/papers.html")
    parts = ("papers", "calibrated", "papers_set", "map", "experiments")
    reproduce.add_argument("part", choices=parts)
    reproduce.add_argument("--settings", metavar="JSON", help="given by the workflow")
    reproduce.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N")
    commands.add_parser("papers", help="write reports/papers.html and .csv")
    commands.add_parser("index", help="write reports/index.html, the list of what was built")
    check = commands.add_parser("check", help="check tables and files before any run")
    _add_study(check)
    new = commands.add_parser("new", help="make the folder of a study")
    new.add_argument("study", type=Path, help="a folder that does not exist yet")
    view = commands.add_parser("view", help="write a page that plays runs side by side")
    view.add_argument("trajectory", type=Path, nargs="+", metavar="TRAJECTORY.h5")
    view.add_argument("--out", type=Path, required=True, metavar="PAGE.html")
    export = commands.add_parser("export", help="write a trajectory for another tool")
    export.add_argument("trajectory", type=Path, metavar="TRAJECTORY.h5")
    export.add_argument("--to", type=Path, required=True, metavar="OUT.glb|.usdc|.abc|.bvh|.c3d")
    add_words(commands.add_parser("render", help="draw a trajectory as a film or as pictures"))
    _add_skin(commands.add_parser("skin", help="another skin on a trajectory, or its binding"))
    commands.add_parser("simulate", help="let the torso breathe by itself", add_help=False)
    commands.add_parser("version", help="print the version")
    return parser


def _overrides(options: argparse.Namespace) -> dict[str, str]:
    given = {table: getattr(options, table) for table in configuration.TABLES}
    return {table: path for table, path in given.items() if path is not None}


def _stage(options: argparse.Namespace) -> int:
    from pipeline.job import read_job
    from pipeline.run import run_stage
    from pipeline.stages import STAGES
    from pipeline.workflow import RESULTS, read_plan

    if options.job is None:
        plan = read_plan(_overrides(options))
        job = read_job(plan.job(options.name, options.command))
    else:
        job = read_job(options.job)
    try:
        line = run_stage(STAGES[job.stage], job, RESULTS / job.name, options.processes)
    except TorsoError as error:
        if not options.keep_going:
            raise
        line = f"{job.name}: {job.stage}: not used: {error}"
    if line:
        print(line, flush=True)
    return 0


def _report(options: argparse.Namespace) -> int:
    from pipeline.job import LAUGH, read_job
    from pipeline.laugh_report import write_laugh_report
    from pipeline.report import write_report
    from pipeline.workflow import REPORTS, RESULTS, read_plan

    if options.job is None:
        kind = read_plan(_overrides(options)).study.entry(options.name).recording["kind"]
    else:
        kind = read_job(options.job).kind
    write = write_laugh_report if kind == LAUGH else write_report
    path = write(RESULTS / options.name, REPORTS / f"{options.name}.html")
    print(f"{options.name}: report: {path}", flush=True)
    return 0


def _retraining_report(options: argparse.Namespace) -> int:
    from pipeline.retraining_report import SUFFIX, write_retraining_report
    from pipeline.workflow import REPORTS, RESULTS

    path = REPORTS / f"{options.name}{SUFFIX}.html"
    print(f"{options.name}: {write_retraining_report(RESULTS / options.name, path)}", flush=True)
    return 0


def _page(options: argparse.Namespace) -> int:
    from pipeline.tabulate import write_error_table, write_group
    from pipeline.workflow import REPORTS, RESULTS, read_plan

    names, problems = options.names, options.problems
    if not names or problems is None:
        plan = read_plan(_overrides(options))
        names, problems = plan.study.names_of("breath"), plan.lost
    else:
        problems = [line for line in problems.split("\n") if line]
    write = write_error_table if options.command == "tabulate" else write_group
    for path in write(RESULTS, names, problems, REPORTS):
        print(f"study: {path}", flush=True)
    return 0


def _validate(options: argparse.Namespace) -> int:
    from pipeline.validation.person import write_person
    from pipeline.workflow import PHYSIOLOGY

    print(
        f"physiology: {write_person(options.sex, PHYSIOLOGY / f'{options.sex}.json')}", flush=True
    )
    return 0


def _physiology(options: argparse.Namespace) -> int:
    from pipeline.validation.write import write_physiology
    from pipeline.workflow import PHYSIOLOGY, REPORTS

    for path in write_physiology(PHYSIOLOGY, REPORTS):
        print(f"physiology: {path}", flush=True)
    return 0


def _reproduce(options: argparse.Namespace) -> int:
    from pipeline.papers.make import make_part
    from pipeline.workflow import PAPERS

    path = make_part(options.part, PAPERS, options.settings, options.processes)
    print(f"papers: {path}", flush=True)
    return 0


def _papers(options: argparse.Namespace) -> int:
    from pipeline.papers.write import write_papers
    from pipeline.workflow import PAPERS, REPORTS

    for path in write_papers(PAPERS, REPORTS):
        print(f"papers: {path}", flush=True)
    return 0


def _index(options: argparse.Namespace) -> int:
    from pipeline.report_index import write_index
    from pipeline.workflow import REPORTS

    print(f"index: {write_index(REPORTS)}", flush=True)
    return 0


def _check(options: argparse.Namespace) -> int:
    from pipeline.workflow import read_plan

    study = read_plan(_overrides(options)).study
    bad = [entry for entry in study.entries if entry.problem]
    for entry in bad:
        print(entry.problem, file=sys.stderr)
    print(f"{len(study.entries) - len(bad)} of {len(study.entries)} recordings can be used.")
    return 1 if bad else 0


def _new(options: argparse.Namespace) -> int:
    from pipeline.new_study import create

    create(options.study)
    print(f"{options.study}: fill in config/recordings.tsv and config/subjects.tsv, then there:")
    print("  pleura check && snakemake")
    return 0


def _view(options: argparse.Namespace) -> int:
    from pipeline.view import write_view

    print(write_view(options.trajectory, options.out), flush=True)
    return 0


def _export(options: argparse.Namespace) -> int:
    from pipeline.export import export

    print(export(options.trajectory, options.to), flush=True)
    return 0


def _skin(options: argparse.Namespace) -> int:
    from pipeline.skin_command import SkinTask, run_skin

    given = {key: value for key, value in vars(options).items() if key != "command"}
    print("\n".join(run_skin(SkinTask(**given))), flush=True)
    return 0


def _render(options: argparse.Namespace) -> int:
    from pipeline.render.command import run

    print(run(options), flush=True)
    return 0


def _version(options: argparse.Namespace) -> int:
    code = places.fingerprint(places.PACKAGE.parent)
    print(f"pleura {places.version()} (code {code}, in {places.PACKAGE.parent})")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; an error a user can act on is one line and exit code 1."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        if words[:1] == ["simulate"]:
            from sim.cli import main as simulate

            return int(simulate(words[1:]))
        options = _parser().parse_args(words)
        actions = {"check": _check, "new": _new, "version": _version, "report": _report}
        actions |= {"view": _view, "export": _export, "render": _render}
        actions |= {"index": _index, "skin": _skin}
        actions |= {"retraining_report": _retraining_report}
        actions |= {"validate": _validate, "physiology": _physiology}
        actions |= {"reproduce": _reproduce, "papers": _papers}
        actions |= dict.fromkeys(PAGE_HELP, _page)
        return actions.get(options.command, _stage)(options)
    except TorsoError as error:
        print(f"pleura: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        # The reader of a pipe (head, say) left early; that is no error of ours.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        what = " ".join(f"{type(error).__name__}: {error}".split())
        where = f"{Path(place.filename).name} line {place.lineno}"
        print(f"pleura: internal error in {where} ({what}). Report it.", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
