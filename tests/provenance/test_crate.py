"""Research objects of a small scenario: whole, true to what results say of themselves, repeatable.

Whether they keep to their profiles is what `make crate-check` asks the validator.
"""

import dataclasses
import errno
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import small_results
from projects import ROOT, copy_project
from rocrate import vocabs
from rocrate.rocrate import ROCrate
from typer.testing import CliRunner

from softslip.cli import app
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.errors import ConfigError, DatasetError, StorageError
from softslip.files.expected_results import expected_results
from softslip.files.storage import read_dataset, write_dataset
from softslip.provenance.crate import Credits, collect, files_of, write_archive, write_folder
from softslip.provenance.crate.contents import crate_file
from softslip.provenance.crate.graph import TERMS
from softslip.provenance.crate.steps import STEPS
from softslip.provenance.crate.writing import EARLIEST
from softslip.provenance.product_labels import read_product

METADATA, PREVIEW = "ro-crate-metadata.json", "ro-crate-preview.html"

SPOKEN_OF = {
    "https://doi.org/10.1093/bioinformatics/bts480",
    "https://snakemake.readthedocs.io",
    "https://w3id.org/ro/crate/1.1",
}
"""What the metadata point at without describing it: the library's own words on Snakemake, and the
version of RO-Crate."""

BENCHMARKED = "shear"
"""The stage that pretends to have been run by Snakemake."""


def made(folder):
    """Return a copy of the project with the small results in their usual place."""
    project = copy_project(folder)
    source = small_results.made()
    results = project / "results" / small_results.NAME
    shutil.copytree(source / "results", results)
    shutil.copy(source / f"{small_results.NAME}.yaml", project / "config")
    for path in (results / BENCHMARKED).glob("*.nc"):
        benchmark = results / "benchmarks" / BENCHMARKED / f"{path.stem}.tsv"
        benchmark.parent.mkdir(parents=True, exist_ok=True)
        benchmark.write_text("s\n1.0\n")
    return project


def collected(project, **options):
    """Collect the small scenario of a project, from wherever one is."""
    source = project / "config" / f"{small_results.NAME}.yaml"
    results = project / "results" / small_results.NAME
    return collect(str(source), results, project=project, **options)


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    return made(tmp_path_factory.mktemp("crate") / "project")


@pytest.fixture(scope="module")
def contents(project):
    return collected(project)


@pytest.fixture(scope="module")
def items(contents):
    return files_of(contents, Credits())


@pytest.fixture(scope="module")
def folder(items, tmp_path_factory):
    path = tmp_path_factory.mktemp("written") / "small.crate"
    write_folder(items, path)
    return path


@pytest.fixture
def own(tmp_path):
    """A project whose results one may change."""
    return made(tmp_path / "own")


def text(items, name=METADATA):
    (found,) = (each.source for each in items if each.name == name)
    return found.decode()


def graph(items):
    """Return the entities of the metadata by their identifiers."""
    entities = json.loads(text(items))["@graph"]
    found = {each["@id"]: each for each in entities}
    assert len(found) == len(entities), "an entity is there twice"
    return found


def all_of(value):
    return value if isinstance(value, list) else [value]


def names(value):
    """Return the identifiers that a property refers to."""
    return [each["@id"] for each in all_of(value)]


def references(entity):
    """Yield every identifier that an entity refers to."""
    for key, value in entity.items():
        for each in all_of(value):
            if isinstance(each, dict):
                assert set(each) == {"@id"}, f"{entity['@id']}: {key} is nested: {each}"
                yield each["@id"]


def of_type(entities, kind):
    return [each for each in entities.values() if kind in all_of(each["@type"])]


def action_of(entities, name):
    """Return the action of a job, by the path of its result."""
    (found,) = (
        each
        for each in of_type(entities, "CreateAction")
        if each["@id"] != "#workflow-run" and names(each["result"]) == [name]
    )
    return found


def below(folder):
    return {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}


def test_the_library_reads_it_back(folder, contents):
    crate = ROCrate(folder)
    assert crate.name == "Results of the scenario small"
    assert crate.mainEntity.id == "workflow/Snakefile"
    assert crate.mainEntity["programmingLanguage"].id.endswith("#snakemake")
    read = {each.id for each in crate.data_entities}
    assert {each.file.name for each in contents.results} <= read
    assert "config/small.yaml" in read
    assert len(contents.results) == small_results.count()


def test_every_file_is_listed_with_its_digest_and_there_is_no_other(folder, items):
    found, entities = below(folder), graph(items)
    listed = {each["@id"] for each in of_type(entities, "File")}
    assert set(found) - listed == {METADATA, PREVIEW}
    assert listed <= set(found)
    for name in listed:
        content = found[name].read_bytes()
        assert entities[name]["sha256"] == hashlib.sha256(content).hexdigest(), name
        assert entities[name]["contentSize"] == str(len(content)), name
        assert re.fullmatch(r"\w+/[\w.+-]+", entities[name]["encodingFormat"]), name
    assert {name for name in found if name.startswith("workflow/")} >= {
        "workflow/rules/simulate.smk",
        "workflow/envs/softslip.yaml",
    }
    assert set(names(entities["./"]["hasPart"])) == listed


def test_results_are_whole_in_it(folder, project):
    for name in ("flow_curve", "fits"):
        read_dataset(folder / "results" / "small" / f"{name}.nc", stage=name)
    own, there = (below(top / "results" / "small") for top in (folder, project))
    # A stage of more than a minute, as on a busy machine, leaves a checkpoint.
    assert set(own) == {name for name in there if not name.endswith((".lock", ".checkpoint"))}
    assert all(own[name].read_bytes() == there[name].read_bytes() for name in own)


def test_the_graph_is_closed_and_whole(items):
    entities = graph(items)
    pointed = {name for each in entities.values() for name in references(each)}
    assert pointed - set(entities) == SPOKEN_OF
    reached, waiting = set(), [METADATA, PREVIEW]
    while waiting:
        name = waiting.pop()
        if name in entities and name not in reached:
            reached.add(name)
            waiting += references(entities[name])
    assert reached == set(entities), "these belong to nothing"


def test_every_word_has_a_meaning(items):
    known = vocabs.RO_CRATE["@context"].keys() | TERMS.keys()
    metadata = json.loads(text(items))
    assert metadata["@context"] == ["https://w3id.org/ro/crate/1.1/context", dict(TERMS)]
    for entity in metadata["@graph"]:
        assert {key for key in entity if key[0] != "@"} <= known, entity["@id"]
        assert set(all_of(entity["@type"])) <= known, entity["@id"]
        lists = [key for key, value in entity.items() if isinstance(value, list) and len(value) < 2]
        assert lists == [], f"{entity['@id']}: lists of one or none"


def test_actions_link_what_results_say_that_they_were_made_from(items, contents, project):
    entities = graph(items)
    actions = of_type(entities, "CreateAction")
    assert len(actions) == len(contents.results) + 1
    results = project / "results" / "small"
    for name in (each.name for each in expected_results(contents.scenario)):
        product = read_product(results / name)
        action = action_of(entities, f"results/small/{name}")
        read = {each for each in names(action.get("object", [])) if each.endswith((".nc", ".png"))}
        assert read == {
            f"results/small/{each.stage}/{each.run}.nc"
            if each.stage in STAGES
            else f"results/small/{each.stage}.nc"
            for each in product.parents
        }, name
        own = entities[f"results/small/{name}"]["identifier"]["@id"]
        assert entities[own]["value"] == product.content
        for key, told in (("startTime", "started"), ("endTime", "ended")):
            assert re.fullmatch(r"\d{4}(-\d\d){2}T(\d\d:){2}\d\d\.\d{3}\+00:00", action[key])
            assert action[key][:23] == product.provenance[told][:23], name
        tool = entities[action["instrument"]["@id"]]
        assert tool["description"].endswith(f"{product.provenance['fingerprint']}."), name
        spent = entities[action["resourceUsage"]["@id"]]
        assert float(spent["value"]) == product.provenance["core_seconds"]


def test_a_run_says_which_of_the_swept_values_it_has(items, contents):
    entities = graph(items)
    values = {}
    for run in contents.scenario.runs():
        action = action_of(entities, f"results/small/shear/{run.ids['shear']}.nc")
        (value,) = (each for each in names(action["object"]) if each.startswith("#value/"))
        assert entities[value]["name"] == "rheometer.stress"
        values[run.coordinates["stress"]] = entities[value]["value"]
        before = action_of(entities, f"results/small/ageing/{run.ids['ageing']}.nc")
        assert not [each for each in names(before["object"]) if each.startswith("#value/")]
    assert values == {0.2: 0.2, 0.4: 0.4}


def test_the_run_of_the_workflow_spans_all_jobs_and_takes_every_parameter(items, contents):
    entities = graph(items)
    run = entities["#workflow-run"]
    jobs = [each for each in of_type(entities, "CreateAction") if each is not run]
    assert run["startTime"] == min(each["startTime"] for each in jobs)
    assert run["endTime"] == max(each["endTime"] for each in jobs)
    assert entities["./"]["datePublished"] == run["endTime"]
    taken = {}
    for each in names(run["object"]):
        if each.startswith("#value/"):
            assert entities[each]["exampleOfWork"]["@id"] == f"#input/{entities[each]['name']}"
            taken.setdefault(entities[each]["name"], []).append(entities[each]["value"])
    assert taken["rheometer.stress"] == [0.2, 0.4]
    assert taken["channel.length"] == [0.046875]
    assert taken["recording.snapshots"] == [[0.1, 0.2, 0.3, 0.4, 0.5]]
    assert "recording.bulk_margin" not in taken, "it is null"
    outputs = {each.file.name for each in contents.results if STEPS[each.rule].is_output}
    assert set(names(run["result"])) == outputs
    assert run["instrument"]["@id"] == entities["./"]["mainEntity"]["@id"]


def test_only_what_snakemake_left_a_benchmark_of_is_told_to_be_its_job(items, contents):
    entities = graph(items)
    jobs = of_type(entities, "ControlAction")
    done = [entities[job["object"]["@id"]] for job in jobs]
    shear = [each for each in contents.results if each.rule == BENCHMARKED]
    assert {each["result"]["@id"] for each in done} == {each.file.name for each in shear}
    (engine,) = of_type(entities, "OrganizeAction")
    assert names(engine["object"]) == [job["@id"] for job in jobs]
    for each in shear:
        assert entities[each.benchmark.name]["about"]["@id"] in {job["@id"] for job in done}
    by_hand = [dataclasses.replace(each, benchmark=None) for each in contents.results]
    alone = graph(files_of(dataclasses.replace(contents, results=tuple(by_hand)), Credits()))
    assert of_type(alone, "OrganizeAction") == of_type(alone, "ControlAction") == []


def test_steps_are_the_rules_of_the_workflow(items):
    entities = graph(items)
    steps = names(entities["workflow/Snakefile"]["step"])
    assert steps == [f"#{rule}" for rule in STEPS]
    sources = "".join(path.read_text() for path in (ROOT / "workflow" / "rules").glob("*.smk"))
    rules = dict(re.findall(r"^rule (\w+):\n(.*?)(?=^rule |\Z)", sources, re.M | re.S))
    for rule, told in STEPS.items():
        # Stages take the place of their shell, so that signals reach them.
        called = re.search(rf'"(?:exec )?softslip {told.command} ', rules[rule])
        assert called, f"{rule} calls something else"
    tools = {name for step in steps for name in names(entities[step]["workExample"])}
    assert tools == set(names(entities["workflow/Snakefile"]["hasPart"]))
    assert {
        entities[each["instrument"]["@id"]]["@id"]
        for each in entities.values()
        if each["@type"] == "CreateAction" and each["@id"] != "#workflow-run"
    } == tools
    positions = {rule: int(entities[f"#{rule}"]["position"]) for rule in STEPS}
    for rule, told in STEPS.items():
        assert all(positions[before] < positions[rule] for before in told.reads), rule


def test_connections_are_those_that_files_have_gone_through(items):
    entities = graph(items)
    for each in of_type(entities, "ParameterConnection"):
        source, target = each["sourceParameter"]["@id"], each["targetParameter"]["@id"]
        through = [
            file["@id"]
            for file in of_type(entities, "File")
            if {source, target} <= set(names(file.get("exampleOfWork", [])))
        ]
        assert through, f"nothing went from {source} to {target}"


def test_software_is_told_as_it_was_recorded(items, contents):
    entities = graph(items)
    (environment,) = {each.product.provenance["environment"] for each in contents.results}
    tool = entities[action_of(entities, "results/small/fits.nc")["instrument"]["@id"]]
    told = [entities[name] for name in names(tool["softwareRequirements"])]
    assert ", ".join(f"{each['name']} {each['softwareVersion']}" for each in told) == environment
    commit = contents.results[0].product.provenance["commit"]
    assert tool["softwareVersion"].removesuffix("-dirty") == commit or commit == "unknown"


def changed(contents, place, **origin):
    """Return the contents with one result that was made otherwise."""
    results = list(contents.results)
    product = results[place].product
    provenance = {**product.provenance, **origin}
    product = dataclasses.replace(product, provenance=provenance)
    results[place] = dataclasses.replace(results[place], product=product)
    return dataclasses.replace(contents, results=tuple(results))


def test_results_of_two_codes_have_two_tools(contents):
    places = [place for place, each in enumerate(contents.results) if each.rule == "shear"]
    entities = graph(files_of(changed(contents, places[0], fingerprint="f" * 16), Credits()))
    tools = names(entities["#shear"]["workExample"])
    assert len(tools) == 2
    used = [
        action_of(entities, contents.results[place].file.name)["instrument"]["@id"]
        for place in places
    ]
    assert used == tools


def test_code_outside_a_repository_is_told_by_its_fingerprint(contents):
    entities = graph(files_of(changed(contents, 0, commit="unknown", dirty=None), Credits()))
    name = contents.results[0].file.name
    tool = entities[action_of(entities, name)["instrument"]["@id"]]
    assert tool["softwareVersion"] == contents.results[0].product.provenance["fingerprint"]
    assert tool["description"].startswith("At no known commit;")


def test_the_version_of_snakemake_is_told_only_where_it_is_known(contents):
    """It is that of the lock, which has to be the one that all results name."""
    (lock,) = (each for each in contents.others if each.name == "requirements.lock")
    told = re.search(r"^snakemake==(\S+)", lock.source.read_text(), re.M)[1]
    language = "https://w3id.org/workflowhub/workflow-ro-crate#snakemake"
    known = contents
    for place in range(len(contents.results)):
        known = changed(known, place, lock_sha256=lock.sha256)
    entities = graph(files_of(known, Credits()))
    assert entities[language]["version"] == told
    assert "another list" not in entities["requirements.lock"]["description"]
    entities = graph(files_of(changed(known, 0, lock_sha256="0" * 64), Credits()))
    assert "version" not in entities[language]
    said = entities["requirements.lock"]["description"]
    assert f"1 of {small_results.count()} results were made with another list" in said


def test_people_and_machines_are_named_only_if_asked_for(items, contents):
    host = contents.results[0].product.provenance["host"]
    quiet = graph(items)
    assert of_type(quiet, "Person") == []
    assert not [each for each in quiet.values() if "agent" in each or "author" in each]
    actions = of_type(quiet, "CreateAction")
    assert not [each for each in actions if re.search(r"\bhost\b", each["description"])]
    orcid, licence = "https://orcid.org/0000-0002-1825-0097", "https://example.org/licence"
    named = graph(files_of(contents, Credits("Josiah Carberry", orcid, licence, hosts=True)))
    assert named[orcid]["name"] == "Josiah Carberry"
    assert named["./"]["author"] == {"@id": orcid}
    assert named["./"]["license"] == {"@id": licence}
    assert named["workflow/Snakefile"]["license"] == {"@id": "https://spdx.org/licenses/MIT"}
    for each in of_type(named, "CreateAction"):
        assert each["agent"] == {"@id": orcid}
        assert each["description"].endswith(f", host {host}") or each["@id"] == "#workflow-run"
    nameless = graph(files_of(contents, Credits("Josiah Carberry")))
    assert nameless["./"]["author"] == {"@id": "#agent"}


def strings(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [found for each in value for found in strings(each)]
    return [value] if isinstance(value, str) else []


def test_another_process_elsewhere_gives_the_same_bytes_and_no_name_of_a_person(
    items, contents, own, tmp_path
):
    """The command itself, for another user with another home, of files with other times."""
    home = tmp_path / "zaphod"
    archives = [tmp_path / name for name in ("here.zip", "there.zip")]
    write_archive(items, archives[0])
    for path in below(own).values():
        os.utime(path, (1e9, 1e9))
    person = {"USER": "zaphod", "LOGNAME": "zaphod", "HOME": str(home), "PYTHONHASHSEED": "7"}
    done = subprocess.run(
        [sys.executable, "-m", "softslip", "crate", "small", "--zip", str(archives[1])],
        cwd=own,
        env=os.environ | person | {"TZ": "Asia/Tokyo", "LC_ALL": "C"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"wrote {archives[1]}: {len(items)} files, ")
    assert archives[0].read_bytes() == archives[1].read_bytes()
    told = [text(items, name) for name in (METADATA, PREVIEW, "README.md")]
    for private in (str(own), str(contents.results[0].product.path.parents[3]), str(Path.home())):
        assert private == "/" or not any(private in each for each in told)
    assert not any("zaphod" in each for each in told)
    for each in strings(json.loads(told[0])):
        assert not re.search(r"(?<![\w.:/])/\w", each), f"an absolute path: {each}"


def test_an_archive_is_the_folder_in_order_and_without_times(folder, items, tmp_path):
    path = tmp_path / "small.zip"
    write_archive(items, path)
    found = below(folder)
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == sorted(found)
        for member in archive.infolist():
            assert archive.read(member) == found[member.filename].read_bytes(), member.filename
            assert member.date_time == EARLIEST
            assert member.external_attr >> 16 == 0o644
    assert ROCrate(path).name == ROCrate(folder).name


def test_an_archive_has_the_same_bytes_whatever_the_order_of_its_files(items, tmp_path):
    paths = [tmp_path / name for name in ("one.zip", "two.zip")]
    for path, order in zip(paths, (items, items[::-1]), strict=True):
        write_archive(order, path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_data_are_copied_or_linked(items, contents, folder, tmp_path):
    linked = tmp_path / "linked"
    write_folder(items, linked, link=True)
    name = contents.results[0].file.name
    source = contents.results[0].product.path
    assert os.path.samefile(linked / name, source)
    assert not os.path.samefile(folder / name, source)
    same = {name: path.read_bytes() for name, path in below(folder).items()}
    assert {name: path.read_bytes() for name, path in below(linked).items()} == same


def test_a_link_that_cannot_be_is_one_sentence(items, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))

    monkeypatch.setattr(os, "link", refuse)
    with pytest.raises(StorageError, match=r"cannot be linked .*; give --data copy"):
        write_folder(items, tmp_path / "small.crate", link=True)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("link", [False, True])
def test_a_file_that_changes_meanwhile_is_not_taken(link, tmp_path):
    source = tmp_path / "source"
    source.write_bytes(b"before")
    changing = crate_file("data.nc", source)
    source.write_bytes(b"after!")
    where = tmp_path / "where"
    with pytest.raises(StorageError, match=r"data\.nc: has changed since it was checked"):
        write_folder([changing], where / "small.crate", link=link)
    with pytest.raises(StorageError, match=r"data\.nc: has changed since it was checked"):
        write_archive([changing], where / "small.zip")
    assert list(where.iterdir()) == []


def test_what_is_there_is_not_replaced(items, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("mine")
    with pytest.raises(ConfigError, match=r"^output: .* is there already"):
        write_folder(items, tmp_path / "full")
    assert [path.name for path in tmp_path.rglob("*")] == ["full", "mine"]
    (tmp_path / "empty").mkdir()
    write_folder(items, tmp_path / "empty")
    assert (tmp_path / "empty" / METADATA).exists()
    with pytest.raises(ConfigError, match=r"^zip: .* does not end in \.zip"):
        write_archive(items, tmp_path / "small.tar")


def results_of(project):
    return project / "results" / "small"


def test_missing_results_are_refused_unless_asked_for(own):
    results = results_of(own)
    (results / "fits.nc").unlink()
    (results / "figures" / "fig5.png").unlink()
    with pytest.raises(DatasetError) as refused:
        collected(own)
    assert f"2 of {small_results.count()} results are missing (fits.nc, figures/fig5.png)" in str(
        refused.value
    )
    assert str(refused.value).endswith("or give --partial")
    items = files_of(collected(own, partial=True), Credits())
    entities = graph(items)
    run = entities["#workflow-run"]
    assert run["actionStatus"] == "http://schema.org/FailedActionStatus"
    gap = f"2 of {small_results.count()} results are missing: fits.nc, figures/fig5.png."
    assert run["error"] == gap
    assert entities["./"]["description"].endswith(gap)
    assert "- `fits.nc`" in text(items, "README.md")
    assert "#fit" not in entities, "a step that nobody took has no tool"
    pointed = {name for each in entities.values() for name in references(each)}
    assert pointed - set(entities) == SPOKEN_OF


def test_a_whole_one_has_no_failed_action(items):
    status = {each.get("actionStatus") for each in of_type(graph(items), "CreateAction")}
    assert status == {"http://schema.org/CompletedActionStatus"}


def test_a_lost_parent_is_left_out_of_a_partial_one(own):
    contents = collected(own)
    lost = contents.results[0]
    lost.product.path.unlink()
    entities = graph(files_of(collected(own, partial=True), Credits()))
    child = next(each for each in contents.results if lost in contents.parents(each))
    assert names(action_of(entities, child.file.name)["object"]) == ["config/small.yaml"]


def test_the_first_results_alone_make_a_whole_graph(own):
    results = results_of(own)
    for path in results.iterdir():
        if path.name != "packing":
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    entities = graph(files_of(collected(own, partial=True), Credits()))
    assert entities["workflow/Snakefile"]["step"] == {"@id": "#packing"}
    pointed = {name for each in entities.values() for name in references(each)}
    assert pointed - set(entities) == SPOKEN_OF
    assert not [each["@id"] for each in entities.values() if [] in each.values()]


def test_fits_without_their_table_are_taken_for_what_they_are(own):
    for table in ("flow_curve", "creep", "profiles", "structure"):
        (results_of(own) / f"{table}.nc").unlink()
    entities = graph(files_of(collected(own, partial=True), Credits()))
    assert "object" not in action_of(entities, "results/small/fits.nc")
    assert not [each["@id"] for each in entities.values() if [] in each.values()]


def test_nothing_at_all_is_refused(own):
    shutil.rmtree(results_of(own))
    every = small_results.count()
    said = rf"{every} of {every} results are missing .* and {every - 3} more\)"
    with pytest.raises(DatasetError, match=said) as no:
        collected(own, partial=True)
    assert "--partial" not in str(no.value)


def test_a_dataset_that_was_altered_is_refused(own):
    small_results.edit(results_of(own) / "flow_curve.nc", {"title": "another"})
    with pytest.raises(DatasetError, match=r"flow_curve\.nc: \w+"):
        collected(own)


def test_a_damaged_figure_is_refused(own):
    path = results_of(own) / "figures" / "fig8.png"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=r"fig8\.png: \w+"):
        collected(own)


def test_a_result_in_the_place_of_another_is_refused(own):
    one, other = sorted((results_of(own) / "figures" / "snapshots").iterdir())
    shutil.copy(one, other)
    with pytest.raises(DatasetError, match=r"is of run '\w+', not '\w+'"):
        collected(own)


def test_a_figure_in_the_place_of_another_is_refused(own):
    figures = results_of(own) / "figures"
    shutil.copy(figures / "fig8.png", figures / "fig4.png")
    with pytest.raises(DatasetError, match=r"fig4\.png: is of title 'fig8', not 'fig4'"):
        collected(own)


def test_a_result_of_another_parent_than_the_one_that_is_there_is_refused(own):
    path = results_of(own) / "flow_curve.nc"
    curve = read_dataset(path, stage="flow_curve")
    other = curve.assign_attrs(comment="made otherwise")
    write_dataset(other, path, stage="flow_curve", run="small", title=curve.attrs["title"])
    with pytest.raises(DatasetError, match=r"fits\.nc: was made from flow_curve small, which has"):
        collected(own)


def test_a_table_of_fewer_runs_than_there_are_is_refused(own):
    results, source = results_of(own), own / "config" / "small.yaml"
    run = load_scenario(str(source)).runs()[0].ids["shear"]
    path = results / "shear" / f"{run}.nc"
    shutil.move(path, own)
    words = ["gather", "creep", source, "--results", results, "--output", results / "creep.nc"]
    assert not small_results.call(words)
    shutil.move(own / path.name, path)
    with pytest.raises(DatasetError, match=r"creep\.nc: was gathered from 1 of 2 runs; rerun the"):
        collected(own)


def test_a_table_of_runs_that_have_left_the_scenario_is_refused(own):
    source = own / "config" / "small.yaml"
    source.write_text(small_results.SCENARIO.replace("[0.2, 0.4]", "[0.4]"))
    with pytest.raises(DatasetError, match=r"flow_curve\.nc: .* is no part of the scenario"):
        collected(own)


def test_a_folder_without_the_workflow_is_refused(own):
    (own / "workflow" / "Snakefile").unlink()
    with pytest.raises(ConfigError, match="change to the project's folder"):
        collected(own)


def test_a_scenario_from_elsewhere_gets_the_place_where_its_name_is_looked_for(own, tmp_path):
    elsewhere = tmp_path / "elsewhere" / "small.yaml"
    elsewhere.parent.mkdir()
    shutil.move(own / "config" / "small.yaml", elsewhere)
    contents = collect(str(elsewhere), results_of(own), project=own)
    items = files_of(contents, Credits())
    assert "config/small.yaml" in {each.name for each in items}
    assert "elsewhere" not in text(items)


def test_the_preview_shows_a_description_as_text(contents):
    words = "Stresses <b>above</b> & below."
    scenario = dataclasses.replace(contents.scenario, description=words)
    items = files_of(dataclasses.replace(contents, scenario=scenario), Credits())
    page = text(items, PREVIEW)
    assert "Stresses &lt;b&gt;above&lt;/b&gt; &amp; below." in page
    assert "<b>above" not in page
    assert graph(items)["./"]["description"].startswith(words), "only the page is changed"
    assert graph(items)["./"]["license"] == {"@id": "https://spdx.org/licenses/MIT"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--data", "move"], "ConfigError: data: 'move' is not known; use one of copy, link"),
        (["--data", "link", "--zip", "a.zip"], "data: 'link' is for a folder"),
        (["--zip", "a.tar"], "ConfigError: zip: 'a.tar' does not end in .zip"),
        (["--zip", "config.zip"], "exists and is not a file"),
        (["--output", "config"], "ConfigError: output: 'config' is there already"),
        (["--agent", " "], "ConfigError: agent: ' ' is not a name"),
        (["--orcid", "0000-0002-1825-0097"], "is given without a name; give --agent too"),
        (["--agent", "A", "--orcid", "0000-0002-1825-0098"], "is not an ORCID iD"),
        (["--agent", "A", "--orcid", "carberry"], "is not an ORCID iD"),
        (["--license", "mine"], "ConfigError: license: 'mine' is not a web address"),
        (["--results", "nowhere"], "DatasetError: nowhere: EVERY of EVERY results are missing"),
    ],
)
def test_what_cannot_be_is_one_sentence(project, monkeypatch, capsys, words, said):
    monkeypatch.chdir(project)
    (project / "config.zip").mkdir(exist_ok=True)
    before = set(below(project))
    assert "exit status" in small_results.call(["crate", "small", *words])
    (line,) = capsys.readouterr().err.splitlines()
    assert said.replace("EVERY", str(small_results.count())) in line
    assert set(below(project)) == before


def test_the_command_writes_beside_the_results_and_says_so(own, monkeypatch):
    monkeypatch.chdir(own)
    agent = ["--agent", "Josiah Carberry", "--orcid", "https://orcid.org/0000-0002-1825-0097"]
    written = CliRunner().invoke(app, ["crate", "small", "--data", "link", *agent])
    assert re.match(r"wrote results/small\.crate: \d+ files, ", written.stdout)
    entities = json.loads((own / "results" / "small.crate" / METADATA).read_text())["@graph"]
    assert "https://orcid.org/0000-0002-1825-0097" in {each["@id"] for each in entities}
    again = CliRunner().invoke(app, ["crate", "small"])
    assert again.exit_code == 2
    assert "'results/small.crate' is there already" in again.stderr


@pytest.mark.parametrize(
    ("orcid", "right"), [("0000-0002-1694-233X", True), ("0000-0002-1694-2330", False)]
)
def test_the_check_digit_of_an_orcid_may_be_an_x(orcid, right, project, monkeypatch, capsys):
    monkeypatch.chdir(project)
    # Refused for another reason, and only then, where the ORCID iD is right.
    small_results.call(["crate", "small", "--agent", "A", "--orcid", orcid, "--output", "config"])
    assert ("is there already" in capsys.readouterr().err) == right
