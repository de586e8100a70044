import json
from pathlib import Path

import pytest

from softslip.config.fields import all_fields
from softslip.config.parameters import Parameters
from softslip.config.reading import read_mapping
from softslip.config.reference import (
    LINE_LENGTH,
    defaults_yaml,
    parameters_schema,
    parameters_table,
    with_table,
    write_references,
)
from softslip.config.scenario import load_scenario

CONFIG = Path(__file__).parents[2] / "config"
STALE = "is not what the parameter models generate; run `softslip schema`"


def test_the_schema_file_is_up_to_date() -> None:
    stored = json.loads((CONFIG / "schema.json").read_text(encoding="utf-8"))
    assert stored == parameters_schema(), f"config/schema.json {STALE}"


def test_the_defaults_file_is_up_to_date() -> None:
    stored = (CONFIG / "defaults.yaml").read_text(encoding="utf-8")
    assert stored == defaults_yaml(), f"config/defaults.yaml {STALE}"


def test_the_table_of_keys_is_up_to_date() -> None:
    stored = (CONFIG / "README.md").read_text(encoding="utf-8")
    assert stored == with_table(stored), f"the table in config/README.md {STALE}"


def test_the_defaults_file_spells_out_every_default() -> None:
    scenario = load_scenario(str(CONFIG / "defaults.yaml"))
    assert scenario.base == Parameters()
    base = read_mapping(CONFIG / "defaults.yaml")["base"]
    spelt = {
        f"{group}.{key}" if isinstance(inside, dict) else group
        for group, inside in base.items()
        for key in (inside if isinstance(inside, dict) else [None])
    }
    assert spelt == set(all_fields(Parameters))
    longest = max(defaults_yaml().splitlines(), key=len)
    assert len(longest) <= LINE_LENGTH, longest


def test_the_schema_forbids_unknown_keys_everywhere() -> None:
    schema = parameters_schema()
    for name, group in {"top": schema, **schema["$defs"]}.items():
        assert group["additionalProperties"] is False, f"{name} accepts any key"


def test_the_schema_knows_every_parameter_and_its_unit() -> None:
    schema = parameters_schema()
    axes = schema["properties"]["axes"]["anyOf"][0]["properties"]
    for path, field in all_fields(Parameters).items():
        if isinstance(field.default, tuple):
            continue
        place = schema
        for part in axes[path]["items"]["$ref"].removeprefix("#/").split("/"):
            place = place[part]
        assert place["unit"], f"{path} has no unit in the schema"
        assert place["description"] == field.description


def test_the_table_has_one_row_for_every_key() -> None:
    rows = parameters_table().splitlines()
    keys = [row.split("|")[1].strip(" `") for row in rows[2:]]
    assert keys == list(all_fields(Parameters))
    assert {row.count(" | ") for row in rows} == {6}


def test_a_text_without_the_markers_is_refused() -> None:
    with pytest.raises(ValueError, match="needs the lines"):
        with_table("no table here")


def test_writing_anew_leaves_up_to_date_files_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_bytes((CONFIG / "README.md").read_bytes())
    written = write_references(tmp_path)
    assert {path.name for path in written} == {"schema.json", "defaults.yaml", "README.md"}
    for path in written:
        assert path.read_bytes() == (CONFIG / path.name).read_bytes(), f"{path.name} differs"
