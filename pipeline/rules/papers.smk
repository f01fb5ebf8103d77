# The papers' tables and figures made anew: behaviours in three forms, the map of breaths, experiments, one page.
rule papers_printed:
    output:
        "results/papers/papers.json",
    log:
        "logs/papers/papers.log",
    params:
        part="papers",
        settings=plan.papers,
        version=places.stamp(),
    shell:
        "pleura reproduce {params.part} --settings {params.settings:q} 2> {log:q}"


use rule papers_printed as papers_calibrated with:
    output:
        "results/papers/calibrated.json",
    log:
        "logs/papers/calibrated.log",
    params:
        part="calibrated",
        settings=plan.papers,
        version=places.stamp(),


use rule papers_printed as papers_set with:
    output:
        "results/papers/papers_set.json",
    log:
        "logs/papers/papers_set.log",
    params:
        part="papers_set",
        settings=plan.papers,
        version=places.stamp(),


use rule papers_printed as papers_experiments with:
    output:
        "results/papers/experiments.json",
    log:
        "logs/papers/experiments.log",
    params:
        part="experiments",
        settings=plan.papers,
        version=places.stamp(),


rule papers_map:
    output:
        "results/papers/map.csv",
        "results/papers/map.json",
    log:
        "logs/papers/map.log",
    threads: workflow.cores or 1
    params:
        settings=plan.papers,
        version=places.stamp(),
    shell:
        "pleura reproduce map --processes {threads} --settings {params.settings:q} 2> {log:q}"


rule papers:
    input:
        rules.papers_printed.output,
        rules.papers_calibrated.output,
        rules.papers_set.output,
        rules.papers_experiments.output,
        rules.papers_map.output,
    output:
        "reports/papers.csv",
        "reports/papers.html",
    log:
        "logs/papers/page.log",
    params:
        version=places.stamp(),
    shell:
        "pleura papers 2> {log:q}"
