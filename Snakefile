# Lets `snakemake` run from the top of the project. An included file cannot set the default target.


include: "workflow/Snakefile"


rule default:
    localrule: True
    default_target: True
    input:
        rules.all.input,
