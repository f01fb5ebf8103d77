# snakemake reports/subject1.html
import sys
from pathlib import Path

# The rules, the checks and `pleura STAGE` must be of one version, the installed one, and Snakemake
# puts this folder, with its own copy of the package, in front of it.
here = str(Path.cwd())
sys.path[:] = [*(p for p in sys.path if p != here), here]

from pipeline import places


include: str(places.workflow())


rule all:
    input:
        plan.everything,
