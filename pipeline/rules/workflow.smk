# Included by the Snakefile of the repository and of every study made by `pleura new`.
from pathlib import Path

from snakemake.logging import logger

from pipeline import console, places
from pipeline import workflow as plans
from sim.errors import TorsoError

here = Path.cwd()
first = workflow.is_main_process

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


if first:
    targets = workflow.dag_settings.targets
    try:
        plans.check_targets(targets, [rule.name for rule in workflow.rules], plan.study)
    except TorsoError as error:
        console.say(str(error))
        sys.exit(1)
    notice = places.difference(here, places.PACKAGE.parent)
    if notice:
        console.say(notice)
    logger.addHandler(console.OneLiners())
    if not workflow.dryrun:
        console.conclude(*plan.asked(targets), plans.RESULTS)
