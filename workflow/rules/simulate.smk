# The stages of a run. Runs that differ only in later stages share the earlier ones.
#
# The fingerprint of a stage's code is a parameter, so that a change of it runs the stage again. The
# checkpoints of ageing and shear lie beside their results and are no outputs, which would be
# removed before each attempt.
#
# `exec` puts the run in the place of the shell that starts it: a batch system signals all processes
# of a job, and a shell would end at once, while its run is still writing a checkpoint.


rule packing:
    output:
        f"{RESULTS}/packing/{{run}}.nc",
    log:
        f"{RESULTS}/logs/packing/{{run}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/packing/{{run}}.tsv"
    priority: priority_of("packing")
    conda:
        f"../{ENVIRONMENT}"
    threads: 1
    resources:
        runtime=minutes_of("packing"),
        mem_mb=memory_of("packing"),
    params:
        scenario=not_counted(SOURCE),
        fingerprint=fingerprint("packing"),
        parameters=parameters_of("packing"),
    message:
        "Packing discs with LAMMPS ({wildcards.run})"
    shell:
        "exec softslip packing {params.scenario:q} {wildcards.run}"
        " --parameters {params.parameters:q}"
        " --output {output:q} 2> {log:q}"


rule expansion:
    input:
        parent=parent_of("expansion"),
    output:
        f"{RESULTS}/expansion/{{run}}.nc",
    log:
        f"{RESULTS}/logs/expansion/{{run}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/expansion/{{run}}.tsv"
    priority: priority_of("expansion")
    conda:
        f"../{ENVIRONMENT}"
    threads: 1
    resources:
        runtime=minutes_of("expansion"),
        mem_mb=memory_of("expansion"),
    params:
        scenario=not_counted(SOURCE),
        fingerprint=fingerprint("expansion"),
        parameters=parameters_of("expansion"),
    message:
        "Growing discs into membranes ({wildcards.run})"
    shell:
        "exec softslip expansion {params.scenario:q} {wildcards.run}"
        " --parameters {params.parameters:q}"
        " --parent {input.parent:q} --output {output:q} 2> {log:q}"


rule ageing:
    input:
        parent=parent_of("ageing"),
    output:
        f"{RESULTS}/ageing/{{run}}.nc",
    log:
        f"{RESULTS}/logs/ageing/{{run}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/ageing/{{run}}.tsv"
    priority: priority_of("ageing")
    # A second attempt resumes from the checkpoint of the first.
    retries: RETRIES
    conda:
        f"../{ENVIRONMENT}"
    threads: 1
    resources:
        runtime=minutes_of("ageing"),
        mem_mb=memory_of("ageing"),
    params:
        scenario=not_counted(SOURCE),
        fingerprint=fingerprint("ageing"),
        parameters=parameters_of("ageing"),
        interval=not_counted(CHECKPOINT_INTERVAL),
    message:
        "Ageing at zero stress ({wildcards.run})"
    shell:
        "exec softslip ageing {params.scenario:q} {wildcards.run}"
        " --parameters {params.parameters:q}"
        " --threads {threads} --checkpoint-interval {params.interval}"
        " --parent {input.parent:q} --output {output:q} 2> {log:q}"


rule shear:
    input:
        parent=parent_of("shear"),
    output:
        f"{RESULTS}/shear/{{run}}.nc",
    log:
        f"{RESULTS}/logs/shear/{{run}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/shear/{{run}}.tsv"
    priority: priority_of("shear")
    # A second attempt resumes from the checkpoint of the first.
    retries: RETRIES
    conda:
        f"../{ENVIRONMENT}"
    threads: 1
    resources:
        runtime=minutes_of("shear"),
        mem_mb=memory_of("shear"),
    params:
        scenario=not_counted(SOURCE),
        fingerprint=fingerprint("shear"),
        parameters=parameters_of("shear"),
        interval=not_counted(CHECKPOINT_INTERVAL),
    message:
        "Shearing ({wildcards.run})"
    shell:
        "exec softslip shear {params.scenario:q} {wildcards.run}"
        " --parameters {params.parameters:q}"
        " --threads {threads} --checkpoint-interval {params.interval}"
        " --parent {input.parent:q} --output {output:q} 2> {log:q}"
