# The paper's figures from the datasets.

from softslip.files.products import FIGURES, figures_of

FIGURE_DATA = {
    figure: [f"{RESULTS}/{dataset}.nc" for dataset in FIGURES[figure].parents]
    for figure in figures_of("figure")
}


rule figure:
    input:
        lambda wildcards: FIGURE_DATA[wildcards.name],
    output:
        report(
            f"{RESULTS}/figures/{{name}}.png",
            caption="../report/figure.rst",
            category="Figures",
            labels={"figure": "{name}"},
        ),
    log:
        f"{RESULTS}/logs/figures/{{name}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/figures/{{name}}.tsv"
    wildcard_constraints:
        name="|".join(FIGURE_DATA),
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing {wildcards.name}"
    shell:
        "softslip draw {wildcards.name} {input:q} --output {output:q} 2> {log:q}"


rule snapshot:
    input:
        f"{RESULTS}/shear/{{run}}.nc",
    output:
        report(
            f"{RESULTS}/figures/snapshots/{{run}}.png",
            caption="../report/snapshot.rst",
            category="Snapshots",
            labels=run_labels,
        ),
    log:
        f"{RESULTS}/logs/figures/snapshots/{{run}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/figures/snapshots/{{run}}.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing the snapshot of {wildcards.run}"
    shell:
        "softslip draw snapshot {input:q} --output {output:q} 2> {log:q}"
