# Lets `snakemake` run from the top of the project. An included file cannot set the default target.


include: "workflow/Snakefile"


rule default:
    default_target: True
    input:
        rules.all.input,
    localrule: True
