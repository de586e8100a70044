"""Which file a scenario is written in, so that two of one name are not taken for each other.

Results lie in a folder of the scenario's name, and another file may have that name. Runs cannot be
mixed up, as their names follow from their parameters; but the tables over all runs, and what is
made from them, would be overwritten. So each table notes the file of its scenario. Another spelling
of its path, an edit of the file and an identical copy are the same scenario; a file in another
place whose parameters or axes differ is another one.
"""

import hashlib
import json
import os
from pathlib import Path

from softslip.config.scenario import Scenario
from softslip.errors import ConfigError, DatasetError
from softslip.files.layout import DATASET
from softslip.files.products import TABLES
from softslip.messages import brief, file_text
from softslip.provenance.product_labels import Product, read_product

NOTED = "scenario_file"
"""What a table's provenance calls the file of its scenario."""

OUTSIDE = "a file outside the project's folder"


def noted_file(scenario: Scenario) -> str:
    """Return the file of a scenario, the same for every spelling of its path.

    It is the path from the current folder, so that a project may be moved. Of a file outside that
    folder only a digest is given, as results may be published and paths name people.
    """
    path = os.path.relpath(os.path.realpath(scenario.file))
    if path.split(os.sep)[0] != os.pardir:
        return path
    return f"{OUTSIDE} ({hashlib.sha256(os.fsencode(path)).hexdigest()[:16]})"


def refuse_other_file(scenario: Scenario, results: Path) -> None:
    """Refuse a scenario whose tables would replace those of another one of the same name.

    Parameters
    ----------
    scenario
        Whose results are to go there.
    results
        Folder of the results.

    Raises
    ------
    ConfigError
        When tables in the folder are of a scenario in another file, with other parameters or axes.
    """
    for table in TABLES:
        path = results / f"{table}{DATASET}"
        try:
            product = read_product(path)
        except DatasetError:
            continue  # Nothing is there, or what may be rerun whatever it was.
        if _is_other(product, scenario):
            noted = product.provenance[NOTED]
            file = OUTSIDE if noted.startswith(OUTSIDE) else file_text(noted)
            raise ConfigError(
                "scenario",
                brief(str(scenario.file)),
                f"would overwrite {file_text(path)}, which is of another scenario of that name, in "
                f"{file}",
                "rename one of the two files, or, if this is the same scenario, moved and edited, "
                f"delete {file_text(path)}",
            )


def _is_other(product: Product, scenario: Scenario) -> bool:
    noted = product.provenance.get(NOTED)
    if product.run != scenario.name or not isinstance(noted, str):
        return False
    same_runs = product.parameters == json.loads(scenario.as_json())
    return noted != noted_file(scenario) and not same_runs
