# Side-by-side benchmarks, which no scenario changes. Not part of the default target:
# `snakemake --cores 2 bench`.

BENCHMARKS = {
    "mobility_100": "mobility --particles 100 --fidelity paper",
    "mobility_800": "mobility --particles 800 --fidelity paper",
    "run_100": "run --particles 100 --fidelity standard",
    "run_800": "run --particles 800 --fidelity standard",
    "scaling": "scaling",
    "trajectory": "trajectory",
}

# The benchmark figure's datasets, that of the bars over N first.
COMPARED = ["scaling", "mobility_100", "mobility_800", "run_100", "run_800"]


rule bench:
    input:
        "results/bench/benchmark.png",
        "results/bench/trajectory.png",
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
        "OPENBLAS_NUM_THREADS=1 softslip bench {params.options}" " --output {output:q} &> {log:q}"


rule benchmark_figure:
    input:
        expand("results/bench/{bench}.nc", bench=COMPARED),
    output:
        "results/bench/benchmark.png",
    log:
        "results/bench/logs/benchmark.log",
    benchmark:
        "results/bench/benchmarks/benchmark.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing benchmark"
    shell:
        "softslip draw benchmark {input:q} --output {output:q} 2> {log:q}"


rule trajectory_figure:
    input:
        "results/bench/trajectory.nc",
    output:
        "results/bench/trajectory.png",
    log:
        "results/bench/logs/trajectory_figure.log",
    benchmark:
        "results/bench/benchmarks/trajectory_figure.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing trajectory"
    shell:
        "softslip draw trajectory {input:q} --output {output:q} 2> {log:q}"
