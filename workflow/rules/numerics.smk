# Validation, the trade of speed for accuracy, stability at the extremes, and what elements of a
# scene cost. Not part of the default target: `snakemake --cores 2 numerics`, and with
# `--config numerics=ci` the same at a small size.

from softslip.files.products import figures_of


rule numerics:
    input:
        expand(
            "{folder}/{figure}.png",
            folder=NUMERICS,
            figure=figures_of("numerics_figure"),
        ),
        f"{NUMERICS}/elements.nc",
        f"{NUMERICS}/coverage.nc",
    localrule: True


rule validation:
    output:
        f"{NUMERICS}/validation/{{name}}.nc",
    log:
        f"{NUMERICS}/logs/validation/{{name}}.log",
    benchmark:
        f"{NUMERICS}/benchmarks/validation/{{name}}.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("validation"),
        study=STUDY,
        sweep=lambda wildcards: str(study().validation[wildcards.name]),
    message:
        "Validating {wildcards.name}"
    shell:
        "softslip numerics validation {wildcards.name:q} --study {params.study:q}"
        " --output {output:q} &> {log:q}"


# First, as one of its axes takes as long as all of another part.
rule stability:
    output:
        f"{NUMERICS}/stability/{{name}}.nc",
    log:
        f"{NUMERICS}/logs/stability/{{name}}.log",
    benchmark:
        f"{NUMERICS}/benchmarks/stability/{{name}}.tsv"
    priority: 1
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("stability"),
        study=STUDY,
        plan=lambda wildcards: str(study().stability),
    message:
        "Stretching {wildcards.name}"
    shell:
        "softslip numerics stability {wildcards.name:q} --study {params.study:q}"
        " --output {output:q} &> {log:q}"


rule stability_map:
    input:
        stability_groups,
    output:
        f"{NUMERICS}/stability_map.nc",
    log:
        f"{NUMERICS}/logs/stability_map.log",
    benchmark:
        f"{NUMERICS}/benchmarks/stability_map.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("stability"),
        study=STUDY,
    message:
        "Gathering the map of stability"
    shell:
        "softslip numerics map {input:q} --study {params.study:q}" " --output {output:q} &> {log:q}"


rule stability_limit:
    output:
        f"{NUMERICS}/stability_limit.nc",
    log:
        f"{NUMERICS}/logs/stability_limit.log",
    benchmark:
        f"{NUMERICS}/benchmarks/stability_limit.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("stability"),
        study=STUDY,
        plan=lambda wildcards: str(study().stability),
    message:
        "Measuring the longest stable steps"
    shell:
        "softslip numerics limits --study {params.study:q} --output {output:q} &> {log:q}"


rule tradeoff_scene:
    output:
        f"{NUMERICS}/scene.nc",
    log:
        f"{NUMERICS}/logs/scene.log",
    benchmark:
        f"{NUMERICS}/benchmarks/scene.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("tradeoff"),
        study=STUDY,
        plan=lambda wildcards: str(study().tradeoff),
    message:
        "Making the scenes of the trade-off"
    shell:
        "softslip numerics scene --study {params.study:q} --output {output:q} &> {log:q}"


rule tradeoff_member:
    input:
        f"{NUMERICS}/scene.nc",
    output:
        f"{NUMERICS}/member/{{name}}.nc",
    log:
        f"{NUMERICS}/logs/member/{{name}}.log",
    benchmark:
        f"{NUMERICS}/benchmarks/member/{{name}}.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("tradeoff"),
        study=STUDY,
    message:
        "Measuring {wildcards.name}"
    shell:
        "softslip numerics member {wildcards.name:q} --scene {input:q}"
        " --study {params.study:q} --output {output:q} &> {log:q}"


rule tradeoff_steady:
    output:
        f"{NUMERICS}/steady/{{name}}.nc",
    log:
        f"{NUMERICS}/logs/steady/{{name}}.log",
    benchmark:
        f"{NUMERICS}/benchmarks/steady/{{name}}.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("tradeoff"),
        study=STUDY,
        plan=lambda wildcards: str(study().tradeoff),
    message:
        "Running {wildcards.name} for long"
    shell:
        "softslip numerics steady {wildcards.name:q} --study {params.study:q}"
        " --output {output:q} &> {log:q}"


rule tradeoff:
    input:
        tradeoff_parts,
    output:
        f"{NUMERICS}/tradeoff.nc",
    log:
        f"{NUMERICS}/logs/tradeoff.log",
    benchmark:
        f"{NUMERICS}/benchmarks/tradeoff.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=lambda wildcards: fingerprint("tradeoff"),
        study=STUDY,
    message:
        "Gathering the trade of speed for accuracy"
    shell:
        "softslip numerics tradeoff {input:q} --study {params.study:q}"
        " --output {output:q} &> {log:q}"


rule elements:
    output:
        f"{NUMERICS}/elements.nc",
    log:
        f"{NUMERICS}/logs/elements.log",
    benchmark:
        f"{NUMERICS}/benchmarks/elements.tsv"
    conda:
        f"../{ENVIRONMENT}"
    # Its times are to be those of a core that nothing else uses.
    threads: os.cpu_count()
    params:
        fingerprint=lambda wildcards: fingerprint("bench"),
        study=STUDY,
        options=lambda wildcards: str(study().elements),
    message:
        "Measuring what elements of a scene cost"
    shell:
        "softslip numerics elements --study {params.study:q} --output {output:q} &> {log:q}"


rule coverage:
    output:
        f"{NUMERICS}/coverage.nc",
    log:
        f"{NUMERICS}/logs/coverage.log",
    benchmark:
        f"{NUMERICS}/benchmarks/coverage.tsv"
    conda:
        f"../{ENVIRONMENT}"
    threads: 2
    params:
        fingerprint=lambda wildcards: fingerprint("coverage"),
        study=STUDY,
        draws=lambda wildcards: study().draws,
    message:
        "Measuring the coverage of estimates"
    shell:
        "softslip numerics coverage --study {params.study:q} --cores {threads} "
        "--output {output:q} &> {log:q}"


rule numerics_figure:
    input:
        drawn,
    output:
        f"{NUMERICS}/{{figure}}.png",
    log:
        f"{NUMERICS}/logs/{{figure}}_figure.log",
    benchmark:
        f"{NUMERICS}/benchmarks/{{figure}}_figure.tsv"
    wildcard_constraints:
        figure="|".join(figures_of("numerics_figure")),
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing {wildcards.figure}"
    shell:
        "softslip draw {wildcards.figure} {input:q} --output {output:q} 2> {log:q}"
