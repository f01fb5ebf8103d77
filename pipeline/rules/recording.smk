# One recording: each stage leaves its record, results/NAME/STAGE.json, even for a row that cannot
# be used; its other files stand beside it.
rule markers:
    input:
        lambda w: plan.files(w.name),
    output:
        "results/{name}/markers.json",
    log:
        "logs/{name}/markers.log",
    params:
        job=lambda w: plan.job(w.name, "markers"),
    shell:
        "pleura markers {wildcards.name:q} --keep-going --job {params.job:q} 2> {log:q}"


rule signature:
    input:
        "results/{name}/markers.json",
    output:
        "results/{name}/signature.json",
    log:
        "logs/{name}/signature.log",
    params:
        job=lambda w: plan.job(w.name, "signature"),
    shell:
        "pleura signature {wildcards.name:q} --keep-going --job {params.job:q} 2> {log:q}"


rule fit:
    input:
        "results/{name}/signature.json",
    output:
        "results/{name}/fit.json",
    log:
        "logs/{name}/fit.log",
    threads: workflow.cores or 1
    params:
        job=lambda w: plan.job(w.name, "fit"),
    shell:
        "pleura fit {wildcards.name:q} --keep-going --processes {threads}"
        " --job {params.job:q} 2> {log:q}"


rule posterior:
    input:
        "results/{name}/fit.json",
    output:
        "results/{name}/posterior.json",
    log:
        "logs/{name}/posterior.log",
    threads: workflow.cores or 1
    params:
        job=lambda w: plan.job(w.name, "posterior"),
    shell:
        "pleura posterior {wildcards.name:q} --keep-going --processes {threads}"
        " --job {params.job:q} 2> {log:q}"


# A laugh goes another way: its sound becomes pressure, then calls.
rule audio:
    input:
        lambda w: plan.files(w.name)[:1],
    output:
        "results/{name}/audio.json",
    log:
        "logs/{name}/audio.log",
    params:
        job=lambda w: plan.job(w.name, "audio"),
    shell:
        "pleura audio {wildcards.name:q} --keep-going --job {params.job:q} 2> {log:q}"


rule pressure:
    input:
        "results/{name}/audio.json",
        lambda w: plan.files(w.name)[1:],
    output:
        "results/{name}/pressure.json",
    log:
        "logs/{name}/pressure.log",
    params:
        job=lambda w: plan.job(w.name, "pressure"),
    shell:
        "pleura pressure {wildcards.name:q} --keep-going --job {params.job:q} 2> {log:q}"


# calls.csv is no output: a person may edit it, and Snakemake deletes outputs before a run.
rule calls:
    input:
        "results/{name}/pressure.json",
    output:
        "results/{name}/calls.json",
    log:
        "logs/{name}/calls.log",
    params:
        job=lambda w: plan.job(w.name, "calls"),
    shell:
        "pleura calls {wildcards.name:q} --keep-going --job {params.job:q} 2> {log:q}"


rule follow:
    input:
        "results/{name}/calls.json",
    output:
        "results/{name}/follow.json",
    log:
        "logs/{name}/follow.log",
    threads: workflow.cores or 1
    params:
        job=lambda w: plan.job(w.name, "follow"),
    shell:
        "pleura follow {wildcards.name:q} --keep-going --processes {threads}"
        " --job {params.job:q} 2> {log:q}"


rule report:
    input:
        lambda w: plan.records(w.name),
    output:
        "reports/{name}.html",
    log:
        "logs/{name}/report.log",
    params:
        job=lambda w: plan.job(w.name, "report"),
    shell:
        "pleura report {wildcards.name:q} --keep-going --job {params.job:q} 2> {log:q}"


# Beside the chain, when asked for: the fitted breath led to a slower, more diaphragmatic one.
rule retraining:
    input:
        "results/{name}/fit.json",
    output:
        "results/{name}/retraining.json",
    log:
        "logs/{name}/retraining.log",
    threads: workflow.cores or 1
    params:
        job=lambda w: plan.job(w.name, "retraining"),
    shell:
        "pleura retraining {wildcards.name:q} --keep-going --processes {threads}"
        " --job {params.job:q} 2> {log:q}"


rule retraining_report:
    input:
        "results/{name}/retraining.json",
    output:
        "reports/{name}_retraining.html",
    log:
        "logs/{name}/retraining_report.log",
    params:
        job=lambda w: plan.job(w.name, "report"),
    shell:
        "pleura retraining_report {wildcards.name:q} --job {params.job:q} 2> {log:q}"
