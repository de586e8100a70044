# The paper's figures from the datasets.

from softslip.files.products import EXPLORER, PAGES, TABLES as TABLED, figures_of


rule figure:
    input:
        lambda wildcards: shown_in(wildcards.name),
    output:
        report(
            f"{RESULTS}/figures/{{name}}.png",
            caption="../report/figure.rst",
            category="Figures",
            labels=lambda wildcards: {
                "figure": wildcards.name,
                "shows": EVERY_FIGURE[wildcards.name].summary,
            },
        ),
    log:
        f"{RESULTS}/logs/figures/{{name}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/figures/{{name}}.tsv"
    wildcard_constraints:
        name="|".join(figures_of("figure")),
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


rule movie:
    input:
        lambda wildcards: shown_in("movie"),
    output:
        # The report plays it on a page of its own.
        f"{RESULTS}/figures/movie.mp4",
    log:
        f"{RESULTS}/logs/figures/movie.log",
    benchmark:
        f"{RESULTS}/benchmarks/figures/movie.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("draw"),
    message:
        "Drawing the movie"
    shell:
        "softslip draw movie {input:q} --output {output:q} 2> {log:q}"


rule figures:
    input:
        [path for path in DRAWN if "/snapshots/" not in path],
    localrule: True


# Each figure by its name: `snakemake fig6`.
for figure_name in figures_of("figure"):

    rule:
        name:
            figure_name
        input:
            f"{RESULTS}/figures/{figure_name}.png",
        localrule: True


rule explorer:
    input:
        [f"{RESULTS}/{table}.nc" for table in PAGES[EXPLORER].parents if table in TABLED],
        SHEARED,
    output:
        f"{RESULTS}/explorer.html",
    log:
        f"{RESULTS}/logs/explorer.log",
    benchmark:
        f"{RESULTS}/benchmarks/explorer.tsv"
    conda:
        f"../{ENVIRONMENT}"
    params:
        fingerprint=fingerprint("explorer"),
        scenario=not_counted(SOURCE),
        results=lambda wildcards, output: os.path.dirname(output[0]),
    message:
        "Writing the page of all runs"
    shell:
        "softslip explorer {params.scenario:q} --results {params.results:q}"
        " --output {output:q} 2> {log:q}"
