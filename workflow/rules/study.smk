# What the rules of the numerics share: the study, and what its datasets and figures need.

from softslip.files.products import FIGURES

STUDY = str(config.get("numerics", "full"))
NUMERICS = f"results/numerics/{STUDY}"

# What was not asked for need not be there: scenarios may be run from any folder, or as a module.
studies = sorted(glob_wildcards("config/numerics/{study,[A-Za-z0-9_-]+}.yaml").study)
if "numerics" in config and STUDY not in studies:
    remedy = f"use one of {', '.join(studies)}" if studies else "change to the project's folder"
    raise WorkflowError(f"--config numerics={STUDY}: is no file in config/numerics; {remedy}")


wildcard_constraints:
    name="[A-Za-z0-9_.-]+",


def study():
    """Return the study; read when its rules are wanted, as it brings the solver with it."""
    from softslip.studies.study import load_study

    try:
        return load_study(STUDY)
    except ConfigError as error:
        raise WorkflowError(str(error)) from None


# Refused before Snakemake calls the functions of rules, whose errors it shows as tracebacks.
if any(word.endswith("numerics") or in_folder(word, located(NUMERICS)) for word in sys.argv[1:]):
    study()


def validations(wildcards):
    return expand(f"{NUMERICS}/validation/{{name}}.nc", name=study().validation)


def stability_groups(wildcards):
    from softslip.studies.stability import GROUPS

    return expand(f"{NUMERICS}/stability/{{name}}.nc", name=GROUPS)


def tradeoff_parts(wildcards):
    from softslip.studies.tradeoff.members import members_of
    from softslip.studies.tradeoff.long_runs import sheared_packings

    plan = study().tradeoff
    return [
        *expand(f"{NUMERICS}/member/{{name}}.nc", name=members_of(plan)),
        *expand(f"{NUMERICS}/steady/{{name}}.nc", name=sheared_packings(plan)),
    ]


def drawn(wildcards):
    """Return the datasets that a figure of the numerics shows."""
    stage, *more = FIGURES[wildcards.figure].parents
    if more:
        return validations(wildcards)
    name = "stability_limit" if stage == "limits" else stage
    return f"{NUMERICS}/{name}.nc"
