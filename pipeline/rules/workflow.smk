# Included by the Snakefile of the repository and of every study made by `pleura new`.
import re
import sys
from pathlib import Path

from snakemake.cli import get_argument_parser
from snakemake.logging import logger

from pipeline import console, places, status
from pipeline import workflow as plans
from sim.errors import TorsoError

# Snakemake itself reads the targets only after this file.
asked = get_argument_parser().parse_known_args(sys.argv[1:])[0]
told = console.OneLiners()
if workflow.is_main_process and not asked.dryrun:
    logger.addHandler(told)

try:
    plans.check_installed()
    plan = plans.read_plan(config)
except TorsoError as error:
    console.say(str(error))
    sys.exit(1)


wildcard_constraints:
    name="|".join(map(re.escape, plan.study.names)) or "(?!)",


include: "recording.smk"
include: "study.smk"
include: "physiology.smk"
include: "papers.smk"


if workflow.is_main_process:
    try:
        plans.check_targets(
            asked.targets,
            [rule.name for rule in workflow.rules],
            plan.study,
            [str(made) for rule in workflow.rules for made in rule.output],
        )
    except TorsoError as error:
        console.say(str(error))
        sys.exit(1)
    notice = places.difference(Path.cwd(), places.PACKAGE.parent)
    if notice:
        console.say(notice)
    if not asked.dryrun:
        status.forget_failures(plans.RESULTS, plan.asked(asked.targets)[0])
        console.conclude(told, *plan.asked(asked.targets), plans.RESULTS)
