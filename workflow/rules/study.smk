# What the rules of the numerics share: the study, and what its datasets and figures need.

from softslip.files.products import FIGURES

STUDY = str(config.get("numerics", "full"))
NUMERICS = f"results/numerics/{STUDY}"

studies = sorted(glob_wildcards("config/numerics/{study,[A-Za-z0-9_-]+}.yaml").study)
if STUDY not in studies:
    raise WorkflowError(
        f"--config numerics={STUDY}: is no file in config/numerics; use one of {', '.join(studies)}"
    )


wildcard_constraints:
    name="[A-Za-z0-9_.-]+",


def study():
    """Return the study; read when its rules are wanted, as it brings the solver with it."""
    from softslip.studies.study import load_study

    try:
        return load_study(STUDY)
    except ConfigError as error:
        raise WorkflowError(str(error)) from None


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
