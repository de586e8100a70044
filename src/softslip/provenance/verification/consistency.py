"""What results say of one another and of their scenario, put to the test.

What is one product's alone is checked by `examined`; here each is compared with its name, with the
parameters that name it, with its parents and with the scenario. That a parent has the parameters
that its child states follows: both have the same identity, which is a hash of them.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from softslip.config.fields import group
from softslip.config.parameters import Parameters
from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES, stage_ids, stage_paths
from softslip.files.expected_results import expected_results
from softslip.files.layout import DATASET, FIGURE
from softslip.files.products import DATASETS, PAGES, TABLES, WITHOUT_RULE, shows_one_run
from softslip.messages import brief, file_text
from softslip.provenance.archive import Archive, usual_place
from softslip.provenance.attribution import UNKNOWN
from softslip.provenance.fingerprints import fingerprint
from softslip.provenance.product_labels import Parent, Product
from softslip.provenance.trees import flat_tree, value_in
from softslip.provenance.verification.examination import RIGHT, Examination
from softslip.provenance.verification.job_record import CLOCK_SLACK, is_after, job_faults

CODE = {
    **{stage: stage for stage in STAGES},
    **{table.name: table.rule for table in DATASETS.values()},
    FIGURE: "draw",
}
"""Whose fingerprint is that of the code that made a product, by its stage."""


def code_of(product: Product) -> str | None:
    """Return whose fingerprint is that of the code that made a product, None if nobody's."""
    return PAGES[product.title].rule if product.is_page else CODE.get(product.stage)


class Remark(str):
    """Something worth knowing, among sentences on what is wrong."""

    __slots__ = ()


@dataclass
class Consistency:
    """All that is known of a folder of results, to test each file's claims with."""

    scenario: Scenario
    folder: Path
    examined: Mapping[Path, Examination]

    def test(self, product: Product) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return what is wrong with a product's claims, and what is worth knowing of them."""
        name, found = file_text(product.path), list(self._findings(product))
        problems = tuple(f"{name}: {each}" for each in found if not isinstance(each, Remark))
        return problems, tuple(f"{name}: {each}" for each in found if isinstance(each, Remark))

    def is_foreign(self, product: Product) -> bool:
        """Return whether a product is none of the scenario as it is now."""
        if product.stage in STAGES:
            return product.run not in self._ids[product.stage]
        if product.stage == FIGURE and shows_one_run(product.title):
            return product.run not in self._ids["shear"]
        known = (*DATASETS, *WITHOUT_RULE, FIGURE)
        return product.stage not in known or dict(product.parameters) != self._parameters

    def is_of_other_code(self, product: Product) -> bool:
        """Return whether a product was made by other code than there is now."""
        stage = code_of(product)
        return stage is not None and product.provenance.get("fingerprint") != fingerprint(stage)

    @cached_property
    def _ids(self) -> dict[str, frozenset[str]]:
        return {stage: frozenset(self.scenario.stage_table(stage)) for stage in STAGES}

    @cached_property
    def _parameters(self) -> dict[str, Any]:
        return dict(json.loads(self.scenario.as_json()))

    @cached_property
    def _expected(self) -> frozenset[str]:
        return frozenset(each.name for each in expected_results(self.scenario))

    @cached_property
    def _archive(self) -> Archive:
        return Archive(self.folder)

    @cached_property
    def _by_content(self) -> dict[str, Path]:
        right = [each for each in self.examined.values() if each.product is not None]
        return {each.product.content: each.path for each in right if each.product is not None}

    def _findings(self, product: Product) -> Iterator[str]:
        yield from self._place(product)
        yield from job_faults(product)
        if product.stage in STAGES:
            yield from self._identity(product)
        elif product.stage in TABLES:
            yield from self._table(product)
        elif product.stage in (*DATASETS, FIGURE):
            yield from self._derived(product)
        # What is published of results has the tables and figures, but not the runs.
        without_runs = not any((self.folder / stage).is_dir() for stage in STAGES)
        if without_runs and any(parent.stage in STAGES for parent in product.parents):
            yield Remark("was made from runs, of which this folder has none")
        for parent in product.parents:
            if not (without_runs and parent.stage in STAGES):
                yield from self._parent(product, parent)
        if product.provenance.get("commit") == UNKNOWN:
            yield Remark("its commit is not known; it was made outside a checkout")
        if self.is_of_other_code(product):
            yield Remark("was made by other code than there is now")

    def _place(self, product: Product) -> Iterator[str]:
        """Compare a file's name with what it holds."""
        suffix = product.path.suffix
        place = usual_place(product.stage, product.run, product.title, suffix)
        name = product.path.relative_to(self.folder).as_posix()
        if name == place:
            return
        # In the folder of a stage a file's name is its run; elsewhere people may keep copies.
        if name in self._expected or name.partition("/")[0] in STAGES:
            yield f"holds {brief(product.label)}; its name should be {place}"
        else:
            yield Remark(f"holds {brief(product.label)}, which the workflow keeps elsewhere")

    def _identity(self, product: Product) -> Iterator[str]:
        """Compare a run's name, parent and marks with the parameters that it states."""
        stage = product.stage
        apart = flat_tree(product.parameters).keys() ^ set(stage_paths(stage))
        if apart:
            sentence = f"its parameters are not those that its stage depends on: {min(apart)}"
            if self.is_foreign(product) and self.is_of_other_code(product):
                yield Remark(f"{sentence}; its run ID cannot be checked")
            else:
                yield sentence
            return
        stated = _constructed(product.parameters)
        ids = stage_ids(stated)
        if product.run != ids[stage]:
            yield f"is called run {brief(product.run)}, but its parameters are of run {ids[stage]}"
        before = STAGES[STAGES.index(stage) - 1] if stage != STAGES[0] else ""
        parents = [(before, ids[before])] if before else []
        if [(each.stage, each.run) for each in product.parents] != parents:
            yield f"does not name its one parent, {' '.join(parents[0]) if parents else 'none'}"
        expected = {
            "parent": ids[before] if before else "",
            "mean_radius": stated.suspension.mean_radius,
            "area_fraction": stated.suspension.area_fraction,
        }
        marks = self.examined[product.path].marks
        for key, value in expected.items():
            if key not in marks or marks[key] != value:
                yield f"its {key} is {brief(marks.get(key))}, but its parameters say {brief(value)}"
        seed = product.provenance.get("seed")
        if seed != stated.seed:
            yield f"its seed is noted as {brief(seed)}, but its parameters say {stated.seed}"

    def _table(self, product: Product) -> Iterator[str]:
        """Compare a table's cells with its parents and their parameters."""
        cells = self.examined[product.path].cells
        if cells is None:
            yield "has no run_id, so that the runs that it was made from are not known"
            return
        if any(each.done != bool(each.run) for each in cells):
            yield "names runs where its status is missing, or none where it is done"
        named = sorted(each.run for each in cells if each.done)
        if named != sorted(parent.run for parent in product.parents):
            yield "its run_id are not the runs that it was made from"
        if {parent.stage for parent in product.parents} != {"shear"}:
            yield "was made from something else than runs of the shear stage"
        paths = list(product.parameters.get("axes", {}))
        if any(len(each.values) != len(paths) for each in cells):
            yield f"has not the {len(paths)} dimensions that its scenario sweeps"
            return
        for cell in cells:
            if cell.done:
                yield from self._cell(cell.run, paths, cell.values)

    def _cell(self, run: str, paths: Sequence[str], values: Sequence[Any]) -> Iterator[str]:
        """Compare the swept values of one run with its parameters."""
        found = self.examined.get(self.folder / "shear" / f"{run}{DATASET}")
        if found is None or found.product is None:
            return
        for path, value in zip(paths, values, strict=True):
            own = value_in(found.product.parameters, path)
            # What only picks other parameters, such as fidelity, is none of the run's own.
            if own is not None and own != value and str(own) != str(value):
                yield f"has run {run} at {path} = {brief(value)}, but that run has {brief(own)}"

    def _derived(self, product: Product) -> Iterator[str]:
        """Compare what was made from one or two datasets with the first of them."""
        if not product.parents:
            yield "does not say what it was made from"
            return
        first = product.parents[0]
        if product.run != first.run:
            yield f"is of {brief(product.run)}, but was made from {first.stage} {first.run}"
        found = self.examined.get(self._archive.place(first))
        parent = found.product if found is not None else None
        if parent is None or parent.content != first.content:
            return
        if dict(parent.parameters) != dict(product.parameters):
            yield f"states other parameters than {file_text(parent.path)}, which it was made from"

    def _parent(self, product: Product, parent: Parent) -> Iterator[str]:
        """Compare what a product says of a parent with what is there."""
        place = self._archive.place(parent)
        # Of a folder that cannot be looked into the examined is that of all in it.
        found, name = self.examined.get(place, self.examined.get(place.parent)), file_text(place)
        if found is None:
            elsewhere = self._by_content.get(parent.content)
            if elsewhere is None:
                yield f"its parent {name} is not there"
            else:
                yield Remark(f"its parent is {file_text(elsewhere)}, not {name}")
        elif found.state != RIGHT or found.product is None:
            yield Remark(f"its parent {name} is {found.state}")
        elif found.product.content != parent.content:
            yield f"its parent {name} has been changed since: its content is not what it was"
        elif not parent.record:
            yield f"does not note the record of its parent {name}"
        elif found.product.record != parent.record:
            yield from self._relabelled(product, found.product)
        elif is_after(found.product, "ended", product, "ended", CLOCK_SLACK):
            yield f"ended before its parent {name} did"

    def _relabelled(self, product: Product, parent: Product) -> Iterator[str]:
        """Tell a parent that was recomputed from one whose provenance was edited.

        What a child has read had ended before the child did. A parent that ended later was
        recomputed since; any other is the very one that was read, and says something else now.
        """
        name = file_text(parent.path)
        if is_after(parent, "ended", product, "ended"):
            yield Remark(f"its parent {name} has been recomputed since, with the same content")
        else:
            yield f"its parent {name} has been changed since: its provenance is not what it was"


def _constructed(tree: Mapping[str, Any]) -> Parameters:
    """Return parameters as a file states them, the others at their defaults, unchecked.

    Those of later stages, which the file does not have, need not go with them.
    """
    values: dict[str, Any] = {}
    for name, inside in tree.items():
        model = group(Parameters.model_fields[name])
        values[name] = inside if model is None else model.model_construct(**inside)
    return Parameters.model_construct(**values)
