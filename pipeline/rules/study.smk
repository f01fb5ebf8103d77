# The whole study: every recording's report and the pages over all of them.
rule all:
    input:
        expand("reports/{name}.html", name=plan.study.names),
        plans.PAGES,
    default_target: True


rule error_table:
    input:
        expand("results/{name}/posterior.json", name=plan.study.names),
    output:
        "reports/error_table.csv",
        "reports/error_table.html",
    log:
        "logs/error_table.log",
    params:
        names=plan.study.names,
        rows=plan.rows,
        version=places.version(),
    shell:
        "pleura tabulate {params.names:q} --problems {params.rows:q} 2> {log:q}"


rule group:
    input:
        expand("results/{name}/posterior.json", name=plan.study.names),
    output:
        "reports/group.html",
    log:
        "logs/group.log",
    params:
        names=plan.study.names,
        rows=plan.rows,
        version=places.version(),
    shell:
        "pleura group {params.names:q} --problems {params.rows:q} 2> {log:q}"
