"""From recordings to fitted breaths, tables and reports."""

import os

# Snakemake sets these to a rule's threads, and a sum of products in another order is another
# number: a fit must be the same to the bit on any number of cores. Read when numpy is imported.
for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"
