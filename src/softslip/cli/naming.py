"""What results are called on the command line: a scenario, their folder, or a file in it."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from softslip.config.scenario import FOLDER, SETTINGS, scenario_names
from softslip.config.stages import STAGES
from softslip.errors import ConfigError, DatasetError
from softslip.files.layout import CHECKPOINTS, DATASET
from softslip.files.products import TABLES
from softslip.messages import brief, file_text

ResultsName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Name of a file in config/, a .yaml path, a folder of results, or a file in it.",
        autocompletion=scenario_names,
    ),
]

WITHIN = (*STAGES, CHECKPOINTS, "figures", "snapshots", "benchmarks", "logs")
"""Folders that lie in a folder of results."""

OVERVIEW = ("figures/fig5.png", "flow_curve.nc")
"""What stands for all results of a scenario where one file is needed: the first that is there."""


def is_scenario(given: str) -> bool:
    """Whether a scenario is meant; it wins where its name is a folder's too."""
    if given == SETTINGS:
        return False
    return given.endswith(".yaml") or os.path.isfile(FOLDER / f"{given}.yaml")


def results_folder(path: Path) -> Path:
    """Return the folder of results that a file or a folder lies in, or the folder itself."""
    folder = path.parent if os.path.isfile(path) else path
    while folder.absolute().name in WITHIN:
        folder = folder.absolute().parent if folder == Path() else folder.parent
    return folder


def folder_of(given: str) -> Path | None:
    """Return the folder of results that is meant, None where nothing of the name is there.

    Parameters
    ----------
    given
        A scenario's name, a folder or a file.
    """
    if is_scenario(given):
        return Path("results") / Path(given).stem
    return results_folder(Path(given)) if os.path.exists(given) else None


def scenario_of(given: str, results: Path | None) -> tuple[str, Path | None]:
    """Return the scenario that is meant, as it is read, and the folder of its results.

    Parameters
    ----------
    given
        A scenario's name or .yaml path, a folder of results, or a file in it.
    results
        Folder that was given beside a scenario.

    Returns
    -------
        The folder is None where it is the scenario's own.

    Raises
    ------
    ConfigError
        When it is none of these, or the scenario of the folder is not in ``config``.
    """
    if is_scenario(given) or not (os.path.exists(given) or "/" in given):
        return given, results
    refuse_second_folder(results)
    folder = results_folder(Path(given))
    for name in (folder.absolute().name, *_names_in(folder)):
        if (os.path.exists(given) or folder.parent == Path("results")) and is_scenario(name):
            return name, folder
    if not os.path.exists(given):
        raise not_there(given)
    path = FOLDER / f"{folder.absolute().name}.yaml"
    raise ConfigError(
        "scenario",
        brief(given),
        f"is not a scenario's name, and there is no {file_text(path)} for its results",
        f"give the scenario's file: SCENARIO.yaml --results {file_text(folder)}",
    )


def overview_file(given: str) -> str:
    """Return the file that stands for a scenario's or a folder's results; else what was given.

    Raises
    ------
    ConfigError
        When there is no such file in the folder.
    """
    folder = folder_of(given)
    if folder is None or os.path.isfile(given):
        return given
    for name in OVERVIEW:
        if (folder / name).is_file():
            return str(folder / name)
    raise ConfigError(
        "target",
        brief(given),
        f"has no {' or '.join(OVERVIEW)} in {file_text(folder)}",
        "make them with snakemake, or give a file of results",
    )


def file_named(given: Path, name: str) -> Path:
    """Return a file of a scenario's or a folder's results by its name; else what was given."""
    folder = folder_of(str(given))
    return given if folder is None or os.path.isfile(given) else folder / name


def refuse_second_folder(results: Path | None) -> None:
    """Refuse a folder of results that is given beside another one.

    Raises
    ------
    ConfigError
        When there is one.
    """
    if results is not None:
        raise ConfigError("results", brief(str(results)), "is given with a folder", "give one")


def not_there(given: str) -> ConfigError:
    """Return the error for a path where there is nothing."""
    return ConfigError(
        "folder",
        brief(given),
        "is neither a scenario's name nor a folder or file that exists",
        "give a scenario such as demo, a folder such as results/demo, or a file in it",
    )


def _names_in(folder: Path) -> Iterator[str]:
    """Yield the scenario that each table in a folder says it is of."""
    from softslip.provenance.product_labels import read_product

    for table in TABLES:
        path = folder / f"{table}{DATASET}"
        if path.is_file():
            with suppress(DatasetError):  # a damaged table is what `verify` reports
                yield read_product(path).run
