# The torso beside published physiology: two people simulated, one page.
rule physiology_man:
    output:
        "results/physiology/male.json",
    log:
        "logs/physiology/male.log",
    params:
        sex="male",
        version=places.stamp(),
    shell:
        "pleura validate {params.sex} 2> {log:q}"


use rule physiology_man as physiology_woman with:
    output:
        "results/physiology/female.json",
    log:
        "logs/physiology/female.log",
    params:
        sex="female",
        version=places.stamp(),


rule physiology:
    input:
        rules.physiology_man.output,
        rules.physiology_woman.output,
    output:
        "reports/physiology.csv",
        "reports/physiology.html",
    log:
        "logs/physiology/page.log",
    params:
        version=places.stamp(),
    shell:
        "pleura physiology 2> {log:q}"
