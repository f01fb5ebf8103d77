# Pages over all recordings of the study, and the list of everything that was built.
rule error_table:
    input:
        expand("results/{name}/posterior.json", name=plan.study.names_of("breath")),
    output:
        "reports/error_table.csv",
        "reports/error_table.html",
    log:
        "logs/error_table.log",
    params:
        names=plan.study.names_of("breath"),
        problems="\n".join(plan.lost),
        version=places.version(),
    shell:
        "pleura tabulate {params.names:q} --problems={params.problems:q} 2> {log:q}"


rule group:
    input:
        expand("results/{name}/posterior.json", name=plan.study.names_of("breath")),
    output:
        "reports/group.html",
    log:
        "logs/group.log",
    params:
        names=plan.study.names_of("breath"),
        problems="\n".join(plan.lost),
        version=places.version(),
    shell:
        "pleura group {params.names:q} --problems={params.problems:q} 2> {log:q}"


# It lists what is there and builds nothing by itself: only pages asked for beside it come first.
rule index:
    input:
        plan.indexed(asked.targets),
    output:
        "reports/index.html",
    log:
        "logs/index.log",
    params:
        others=plan.others(asked.targets),
        version=places.version(),
    shell:
        "pleura index 2> {log:q}"
