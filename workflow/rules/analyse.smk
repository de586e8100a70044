# Datasets over all runs of the scenario: each swept parameter is a dimension.

from softslip.files.products import TABLES as GATHERED

SHEARED = [f"{RESULTS}/shear/{run}.nc" for run in SHOWN]


rule gather:
    input:
        SHEARED,
    output:
        f"{RESULTS}/{{table}}.nc",
    log:
        f"{RESULTS}/logs/{{table}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{table}}.tsv"
    wildcard_constraints:
        table="|".join(GATHERED),
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("gather"),
        scenario=not_counted(SOURCE),
        results=lambda wildcards, output: os.path.dirname(output[0]),
        # A run that leaves the scenario leaves the dataset.
        runs=sorted(TABLES["shear"]),
        swept=[axis.label for axis in SCENARIO.axes],
    message:
        "Gathering {wildcards.table}"
    shell:
        "softslip gather {wildcards.table} {params.scenario:q}"
        " --results {params.results:q} --output {output:q} 2> {log:q}"


rule fit:
    input:
        f"{RESULTS}/flow_curve.nc",
    output:
        f"{RESULTS}/fits.nc",
    log:
        f"{RESULTS}/logs/fits.log",
    benchmark:
        f"{RESULTS}/benchmarks/fits.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("fit"),
    message:
        "Fitting flow and slip laws"
    shell:
        "softslip fit {input:q} --output {output:q} &> {log:q}"


# The table in Markdown is a log, so that only datasets and figures decide what is to be done.
rule compare:
    input:
        f"{RESULTS}/flow_curve.nc",
        f"{RESULTS}/fits.nc",
    output:
        f"{RESULTS}/comparison.nc",
    log:
        table=f"{RESULTS}/comparison.md",
        errors=f"{RESULTS}/logs/comparison.log",
    benchmark:
        f"{RESULTS}/benchmarks/comparison.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("compare"),
    message:
        "Comparing with the paper"
    shell:
        "softslip compare {input:q} --output {output:q} > {log.table:q} 2> {log.errors:q}"
