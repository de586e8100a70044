# Side-by-side benchmarks, which no scenario changes. Not part of the default target:
# `snakemake --cores 2 bench`.

from softslip.files.products import figures_of

BENCHMARKS = {
    "mobility_100": "mobility --particles 100 --fidelity paper",
    "mobility_800": "mobility --particles 800 --fidelity paper",
    "run_100": "run --particles 100 --fidelity standard",
    "run_800": "run --particles 800 --fidelity standard",
    "scaling": "scaling",
    "trajectory": "trajectory",
}


rule bench:
    input:
        expand("results/bench/{figure}.png", figure=figures_of("bench_figure")),
    localrule: True


rule measure:
    output:
        "results/bench/{bench}.nc",
    log:
        "results/bench/logs/{bench}.log",
    benchmark:
        "results/bench/benchmarks/{bench}.tsv"
    wildcard_constraints:
        bench="|".join(BENCHMARKS),
    conda:
        f"../{ENVIRONMENT}"
    # A measurement has the machine to itself, but runs on one core.
    threads: os.cpu_count()
    params:
        fingerprint=lambda wildcards: fingerprint("bench"),
        options=lambda wildcards: BENCHMARKS[wildcards.bench],
    message:
        "Measuring {wildcards.bench}"
    shell:
        "softslip bench {params.options} --output {output:q} &> {log:q}"


rule bench_figure:
    input:
        benchmarks_drawn,
    output:
        "results/bench/{figure}.png",
    log:
        "results/bench/logs/{figure}_figure.log",
    benchmark:
        "results/bench/benchmarks/{figure}_figure.tsv"
    wildcard_constraints:
        figure="|".join(figures_of("bench_figure")),
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing {wildcards.figure}"
    shell:
        "softslip draw {wildcards.figure} {input:q} --output {output:q} 2> {log:q}"
