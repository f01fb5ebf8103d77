"""Physics-based human torso: bones, soft cavities, muscles, lung."""

import os


def use_one_thread() -> None:
    """Keep linear algebra on one thread; to be called before numpy is imported.

    Snakemake sets these to a rule's threads, and a sum of products in another order is another
    number: a run must be the same to the bit on any number of cores. For the torso's small
    matrices one thread is also many times faster than several on a busy machine.
    """
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ[f"{library}_NUM_THREADS"] = "1"


use_one_thread()
