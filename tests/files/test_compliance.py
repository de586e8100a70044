"""Datasets of every kind keep to CF-1.11 and ACDD-1.3, as the IOOS compliance checker sees it."""

import copy
import json
import socket
import tomllib
import warnings
from pathlib import Path

import netCDF4
import pytest
import scenes
import small_results
import tradeoff_synthetic
import xarray as xr
from cf_units import Unit
from compliance_checker.acdd import ACDD1_3Check
from compliance_checker.cf import util
from compliance_checker.cf.cf_1_11 import CF1_11Check
from compliance_checker.suite import CheckSuite
from ruamel.yaml import YAML
from studies_small import SMALL_MAP
from synthetic import sweep as runs_of

from softslip.analysis.against_paper import against_paper
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.structure import structure
from softslip.analysis.observables.tables import creep, flow_curve, profiles
from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters
from softslip.config.scenario import load_scenario
from softslip.files.conventions import file_units
from softslip.files.discovery import DESCRIPTIONS
from softslip.files.storage import read_dataset, write_dataset
from softslip.operations.effort import measure_effort
from softslip.operations.reproduction import measure_reproduction
from softslip.simulation import hydrodynamics
from softslip.simulation.expansion import expand
from softslip.simulation.packing import pack
from softslip.studies import stability, validation
from softslip.studies.bench import as_dataset
from softslip.studies.bench.datasets import LABELS, SERIES, TABLES, UNITS, WORDS
from softslip.studies.coverage import measure_coverage
from softslip.studies.tradeoff import long_runs, member_dataset
from softslip.studies.tradeoff.members import members_of
from softslip.studies.tradeoff.table import gather
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign
from softslip.studies.tradeoff.tradeoff_scenes import prepare
from softslip.studies.validation.film import Film

ROOT = Path(__file__).parents[2]

CHECKERS = {"cf:1.11": CF1_11Check, "acdd:1.3": ACDD1_3Check}
CF, ACDD = CHECKERS

NOT_APPLICABLE = {
    "A channel in the model's units is at no place on Earth.": (
        *("geospatial_bounds", "geospatial_bounds_crs", "geospatial_bounds_vertical_crs"),
        *(f"geospatial_{axis}_{end}" for axis in ("lat", "lon") for end in ("min", "max")),
        *(f"geospatial_{axis}_{end}" for axis in ("lat", "lon") for end in ("units", "resolution")),
        *(f"geospatial_vertical_{end}" for end in ("min", "max", "units", "resolution")),
        "geospatial_vertical_positive",
    ),
    "Time in the model has no date.": tuple(
        f"time_coverage_{end}" for end in ("start", "end", "duration", "resolution")
    ),
    "Nothing was observed: there is no instrument and nothing that carries it.": (
        *("platform", "platform_vocabulary", "instrument", "instrument_vocabulary"),
    ),
    "CITATION.cff names the developers as a group, without address, institution or domain.": (
        *("creator_url", "creator_email", "creator_institution", "institution"),
        *("naming_authority", "metadata_link", "program"),
        *("contributor_name", "contributor_role"),
    ),
    "Who runs the software publishes what it makes, or does not.": (
        *("publisher_name", "publisher_url", "publisher_email", "publisher_type"),
        *("publisher_institution", "date_issued"),
    ),
    "A file is never changed, only replaced: date_created says it all.": (
        *("date_modified", "date_metadata_modified"),
    ),
    "The table of CF has no names for the flow of a model suspension.": (
        *("standard_name_vocabulary", "standard_name of a variable"),
    ),
    "Keywords are free words.": ("keywords_vocabulary",),
}
"""What ACDD recommends and datasets do not have, by the reason."""

REPEATED = (
    *("is_geophysical", "get_auxiliary_coordinate_variables", "get_coordinate_variables"),
    *("get_axis_variables", "get_bounds_variables", "get_time_variables"),
)
"""What the checker asks of a file again and again."""

EXTENTS = {f"geospatial_{axis}_min/max" for axis in ("lat", "lon")}
"""The checker speaks of these twice."""

FEW = TradeoffDesign.of(
    {
        **{"particles": 24, "stresses": [0.5], "roughnesses": [0.0]},
        **{"ageing": 0.05, "shearing": 0.05, "settling": 0.02, "interval": 0.05},
        **{"skipped": 1, "records": 2, "short_records": 1},
        **{"regularisations": [0.2], "node_spacings": [6.0], "tolerances": [2e-2]},
        **{"finest_tolerance": 2e-2, "closer_spacing": None, "levels": [], "variants": {}},
        "steady": {
            **{"regularisations": [None], "stresses": [0.5], "roughnesses": [0.0]},
            **{"seeds": [1], "wide_regularisations": [], "ageing": 0.05, "duration": 0.2},
        },
    }
)
"""The smallest study of speed against accuracy."""


def chain(aged):
    """The stages of a run."""
    few = scenes.parameters(suspension={"area_fraction": 0.6}, expansion={"ramp_steps": 400})
    kept = scenes.parameters(
        rheometer={"stress": 0.5},
        time_stepping={"shear_time": 0.05},
        recording={"snapshots": [0.02, 0.05], "profile_interval": 0.02},
    )
    packed = pack(few)
    found = {"packing": packed, "expansion": expand(packed, few), "ageing": aged}
    found["shear"] = hydrodynamics.shear(aged, kept)
    return {
        name: each.assign_attrs(parameters=few.model_dump_json()) for name, each in found.items()
    }


def tables():
    """What is made of many runs, over an axis of numbers and one of words."""
    few = runs_of((0.1, 0.3), (0.0, 0.59), duration=30.0, profiles=2)
    runs = [
        ({**labels, "surface": surface}, run) for surface in ("soft", "hard") for labels, run in few
    ]
    curve = flow_curve(few)
    return {
        "flow_curve": flow_curve(runs),
        "creep": creep(few),
        "profiles": profiles(few),
        "structure": structure(few),
        "fits": fit_laws(curve),
        "comparison": against_paper(curve, fit_laws(curve)),
    }


def benchmarks():
    """Results of benchmarks with every figure that there may be; their numbers mean nothing."""
    series = ("shear_rate_wall", "shear_rate_bulk", "slip_velocity", "film_thickness")
    words = {key: {"a": "some", "b": "other"} for key in WORDS}
    named = {key: {"a": 1.0, "b": 2.0} for key, dim in TABLES.items() if dim != "part"}
    alone = {key: 1.0 for key in UNITS if key not in (*TABLES, "time")}
    return {
        "run": {"ratio": 2.0, "paper": alone, "level": alone},
        "scaling": {
            **{key: [1.0, 2.0] for key in ("particles", "nodes", "seconds")},
            **{key: {"fft": [1.0, 2.0]} for key, dim in TABLES.items() if dim == "part"},
        },
        "trajectory": {
            "time": [1.0, 2.0],
            SERIES: {key: {"grid": [1.0, 2.0], "seed": [2.0, 3.0]} for key in series},
            **{key: each for key, each in named.items() if TABLES[key] in ("quantity", "run")},
        },
        "elements": {key: each for key, each in named.items() if TABLES[key] == "element"} | words,
    }


def named(scene):
    """Attributes of what tells scenes apart, which made-up members lack."""
    return {name: scene[name].attrs for name in ("stress", "roughness")}


def numerics():
    """The parts of a study of the numerics."""
    films = {"fidelity": ["literal", "standard"], "regularisation": [None, 0.5]}
    small = SMALL_MAP.model_copy(update={"duration": 0.02, "stresses": (0.3,)})
    stresses = stability.measure_group("stress", small)
    scene = prepare(FEW)
    (member,) = (each for name, each in members_of(FEW).items() if name.startswith("finest"))
    (case,) = long_runs.sheared_packings(FEW).values()
    members = tradeoff_synthetic.members()
    for name, attributes in named(scene).items():
        members[0][name].attrs.update(attributes)
    longs = [tradeoff_synthetic.long_run(seed=seed) for seed in (1, 2)]
    limits = ROOT / "results/published/numerics/stability_limit.nc"
    return {
        "coverage": measure_coverage(1),
        "validation": validation.sweep(Film, films, {"thickness": 0.9}),
        "stability": stresses,
        "stability_map": stability.gather([stresses]),
        "limits": read_dataset(limits, stage="limits"),
        "scene": scene,
        "member": member_dataset.measure_member(scene, member, FEW),
        "steady": long_runs.measure_steady(case, FEW),
        "tradeoff": gather(members, longs),
    }


@pytest.fixture(scope="module")
def files(aged, tmp_path_factory):
    """A file of each kind, as the commands write them."""
    folder = tmp_path_factory.mktemp("compliance")
    bench = {name: as_dataset({"bench": name, **each}) for name, each in benchmarks().items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(member_dataset, "ROUNDS_FOR", 0.0)
        patch.setattr(member_dataset, "FEWEST_ROUNDS", 1)
        found = chain(aged) | tables() | numerics() | {"elements": bench.pop("elements")}
    made = small_results.made()
    scenario = load_scenario(str(made / f"{small_results.NAME}.yaml"))
    found["effort"] = measure_effort(scenario, made / "results")[0]
    curve = read_dataset(made / "results" / "flow_curve.nc", stage="flow_curve")
    found["reproduction"] = measure_reproduction(curve, curve)
    kinds = [(stage, "test", dataset) for stage, dataset in found.items()]
    kinds += [("bench", name, dataset) for name, dataset in bench.items()]
    written = {}
    for stage, run, dataset in kinds:
        path = folder / f"{stage}-{run}.nc"
        write_dataset(dataset, path, stage=stage, run=run, title=f"{stage} of {run}")
        written[stage, run] = path
    return written


@pytest.fixture(scope="module")
def offline():
    """A machine without a network."""

    def refuse(*_, **__):
        raise AssertionError("the checker asks the network")

    with pytest.MonkeyPatch.context() as patch:
        for name in ("connect", "connect_ex", "sendto"):
            patch.setattr(socket.socket, name, refuse)
        for name in ("getaddrinfo", "gethostbyname", "create_connection"):
            patch.setattr(socket, name, refuse)
        yield


@pytest.fixture(scope="module")
def check(offline):
    """The checker: what it finds wrong in a file, by convention."""
    # It asks the same of a file for each variable, which makes it slow where there are many.
    with pytest.MonkeyPatch.context() as patch:
        for name in REPEATED:
            patch.setattr(util, name, remembering(getattr(util, name)))
        patch.setattr(CheckSuite, "checkers", CHECKERS)
        yield findings


def remembering(function):
    """A function of a file, or of one of its variables, that is called once for each."""
    known = {}

    def remembered(*args):
        if args not in known:
            known[args] = function(*args)
        return copy.copy(known[args])

    return remembered


def findings(path):
    """Return all that is wrong with a file for each convention, whatever its weight."""
    suite = CheckSuite(options={"cf": {"enable_appendix_a_checks"}})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Its own ones are no business of ours.
        dataset = suite.load_dataset(str(path))
        results = suite.run_all(dataset, [CF, ACDD])
        dataset.close()
    found = {}
    for convention, (groups, failures) in results.items():
        assert groups, f"{convention} looked at nothing"
        wrong = [leaf for group in groups for leaf in leaves(group) if not is_full(leaf.value)]
        found[convention] = {line for leaf in wrong for line in lines_of(leaf)}
        found[convention] |= {f"{name}: {error[0]!r}" for name, error in failures.items()}
    return found


def leaves(result):
    if not result.children:
        return [result]
    return [leaf for child in result.children for leaf in leaves(child)]


def is_full(value):
    return value is True or (isinstance(value, tuple) and value[0] == value[1])


def lines_of(leaf):
    about = str(leaf.name) if str(leaf.name).startswith("variable ") else ""
    return [f"{about} {line}".strip() for line in leaf.msgs or [f"{leaf.name} fails"]]


def recommended(line):
    """Return what ACDD misses, without the name of the variable or the file."""
    if line.startswith("variable "):
        return f"{line.rpartition(': ')[2]} of a variable"
    return line.removeprefix("Attr ").replace(" is not present", " not present").partition(" ")[0]


# --- what the checker says --------------------------------------------------------------------


def test_there_is_a_file_of_every_kind(files):
    assert {stage for stage, _ in files} == set(DESCRIPTIONS)
    assert {run for stage, run in files if stage == "bench"} == set(benchmarks()) - {"elements"}


def test_everything_is_as_conventions_have_it_or_not_applicable(files, check):
    allowed = {name for names in NOT_APPLICABLE.values() for name in names} | EXTENTS
    for kind, path in files.items():
        found = check(path)
        assert not found[CF], f"{kind}: {sorted(found[CF])}"
        missed = {recommended(line) for line in found[ACDD]}
        assert missed == allowed, f"{kind}: {sorted(missed ^ allowed)}"


DAMAGE = {
    "units of the model": (
        lambda file: file["centre"].setncattr("units", "length unit"),
        (CF, 'units for centre, "length unit" are not recognized by UDUNITS'),
    ),
    "words for a coordinate variable": (
        lambda file: file.renameVariable("axis_label", "axis"),
        (CF, "check_coordinate_variables_strict_monotonicity: TypeError"),
    ),
    "no meaning": (
        lambda file: file["radius"].delncattr("long_name"),
        (CF, "Attribute long_name or/and standard_name is highly recommended for variable radius"),
    ),
    "a place on Earth": (
        lambda file: file["radius"].setncattr("standard_name", "latitude"),
        (CF, "latitude"),
    ),
    "an attribute of dimensions": (
        lambda file: file["radius"].setncattr("calendar", "standard"),
        (CF, '[Appendix A] Attribute "calendar"'),
    ),
    "no kind of content": (
        lambda file: file["radius"].delncattr("coverage_content_type"),
        (ACDD, "coverage_content_type"),
    ),
    "no licence": (lambda file: file.delncattr("license"), (ACDD, "license not present")),
    "no date": (lambda file: file.delncattr("date_created"), (ACDD, "date_created")),
    "conventions of its own": (
        lambda file: file.setncattr("Conventions", "CF-1.11"),
        (ACDD, "Conventions does not contain 'ACDD-1.3'"),
    ),
}


@pytest.fixture(scope="module")
def sound(files, check):
    """What is found in the file that is damaged below."""
    return check(files["packing", "test"])


@pytest.mark.parametrize("what", DAMAGE)
def test_the_checker_sees_what_is_wrong(files, check, sound, tmp_path, what):
    change, (convention, words) = DAMAGE[what]
    path = tmp_path / "damaged.nc"
    path.write_bytes(files["packing", "test"].read_bytes())
    with netCDF4.Dataset(path, "a") as file:
        change(file)
    added = check(path)[convention] - sound[convention]
    assert any(words in line for line in added), f"{words!r} is not in {added}"


# --- what it does not look at -----------------------------------------------------------------


def test_every_variable_says_what_it_is(files):
    for kind, path in files.items():
        with netCDF4.Dataset(path) as file:
            for name, variable in file.variables.items():
                assert getattr(variable, "long_name", ""), f"{kind}: {name}"
                words = variable.dtype is str
                assert words or getattr(variable, "units", ""), f"{kind}: {name}"
                assert getattr(variable, "coverage_content_type", ""), f"{kind}: {name}"


def test_model_units_are_kept_beside_those_of_others(files):
    with netCDF4.Dataset(files["shear", "test"]) as file:
        velocity = file["wall_velocity"]
        assert (velocity.units, velocity.model_units) == ("1", "length unit / time unit")
        assert not hasattr(file["strain"], "model_units")
        assert "model_units" in file.comment


def test_no_unit_is_strange_to_udunits():
    """Of any parameter that may be swept, any case and any benchmark."""
    models = (Parameters, *validation.CASES.values())
    fields = [field for model in models for field in all_fields(model).values()]
    units = {str(extra(field, "unit")) for field in fields}
    units |= {unit for case in validation.CASES.values() for unit, _ in case.units.values()}
    units |= {unit for unit, _ in UNITS.values()}
    assert {"length unit", "viscosity unit", "s / time unit", "MiB"} <= units
    for unit in units:
        Unit(file_units(unit))  # ValueError where it is unknown.


def test_names_and_licence_are_the_projects(files):
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    with netCDF4.Dataset(files["packing", "test"]) as file:
        assert [{"name": file.creator_name}] == citation["authors"] == project["authors"]
        assert file.project == project["name"] == citation["title"]
        assert file.license.split()[0] == project["license"] == citation["license"]
        assert (ROOT / "LICENSE").read_text().startswith(file.license)
        assert file.product_version == project["version"]


def test_no_path_is_in_any_attribute(files):
    for kind, path in files.items():
        with netCDF4.Dataset(path) as file:
            text = json.dumps({name: str(file.getncattr(name)) for name in file.ncattrs()})
        for folder in (ROOT, path.parent, Path.home()):
            assert f"{folder}/" not in text, kind


def test_named_things_of_benchmarks_all_have_a_meaning():
    assert set(LABELS) == {*TABLES.values(), "run"}


def test_others_read_them_by_name(files):
    """As people do who have no softslip."""
    curve = xr.load_dataset(files["creep", "test"])
    assert curve.sel(stress=0.3, model_time=1.0, method="nearest")["slip_velocity"].notnull().all()
    assert curve["model_time"].attrs["model_units"] == "time unit"
    shear_run = xr.load_dataset(files["shear", "test"])
    assert shear_run["wall_label"].values.tolist() == ["lower", "upper"]
