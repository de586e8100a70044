# Side-by-side benchmarks, which no scenario changes. Not part of the default target:
# `snakemake --cores 2 bench`.

BENCHMARKS = {
    "mobility": "--particles 800",
    "run": "--particles 100",
    "scaling": "",
    "memory": "--particles 800",
}


rule bench:
    input:
        "results/bench/benchmark.png",
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
    threads: workflow.cores
    params:
        options=lambda wildcards: BENCHMARKS[wildcards.bench],
    message:
        "Measuring {wildcards.bench}"
    shell:
        "OPENBLAS_NUM_THREADS=1 softslip bench {wildcards.bench} {params.options}"
        " --output {output:q} &> {log:q}"


rule benchmark_figure:
    input:
        expand("results/bench/{bench}.nc", bench=["scaling", "mobility", "run", "memory"]),
    output:
        "results/bench/benchmark.png",
    log:
        "results/bench/logs/benchmark.log",
    benchmark:
        "results/bench/benchmarks/benchmark.tsv"
    conda:
        f"../{ENVIRONMENT}"
    message:
        "Drawing benchmark"
    shell:
        "softslip draw benchmark {input:q} --output {output:q} 2> {log:q}"
