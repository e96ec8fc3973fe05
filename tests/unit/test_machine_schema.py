import json

import jsonschema
import pytest
import yaml

from gcodejerk.machine import machine_schema
from gcodejerk.machine.file.table import MACHINE, Section
from gcodejerk.machine.find import shipped_machines

VALID = {
    "interval": 0.001,
    "positioning": "linear",
    "axes": {"X": {"rapid": {"velocity": 1, "acceleration": 2}}},
}


def axis_x(**keys):
    return {"axes": {"X": VALID["axes"]["X"] | keys}}


@pytest.fixture(scope="module")
def validator():
    schema = json.loads(json.dumps(machine_schema(), allow_nan=False))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", sorted(shipped_machines()))
def test_shipped_machines_are_valid(validator, name):
    text = shipped_machines()[name].read_text(encoding="utf-8")
    validator.validate(yaml.safe_load(text))


def test_the_smallest_machine_is_valid(validator):
    validator.validate(VALID)


@pytest.mark.parametrize(
    "change",
    [
        {"interval": 0},
        {"interval": "fast"},
        {"interval": 2},
        {"positioning": "dogleg"},
        {"axes": {}},
        {"axes": {"x": {"rapid": {"velocity": 1, "acceleration": 2}}}},
        {"axes": {"X": {}}},
        {"axes": {"X": {"rapid": {"velocity": -1, "acceleration": 2}}}},
        {"speed": 1},
        {"schema": 2},
        {"design": {"profile": "condition4"}},
        {"design": {"band": 1}},
        {"modes": [{"frequency": 9}]},
        {"modes": [{"frequency": 9, "damping": 1, "participation": {"X": 1}}]},
        {"program": {"offsets": {"G60": {}}}},
        {"program": {"offsets": {"H1": {"X": 1}}}},
        {"program": {"startup": "do it"}},
        axis_x(spectrum=None),
        axis_x(spectrum=["x.csv"]),
        axis_x(spectrum={"participation": 1}),
        axis_x(spectrum={"file": "x.csv", "participation": -1}),
        axis_x(spectrum={"file": "x.csv", "damping": 0.1}),
        axis_x(modes={"frequency": 30}),
        axis_x(modes={"spectrum": "x.csv", "frequency": 30}),
        axis_x(modes="x.csv"),
    ],
    ids=str,
)
def test_what_the_loader_refuses_the_schema_refuses(validator, change):
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(VALID | change)


def test_a_key_left_empty_is_valid_where_the_loader_takes_it(validator):
    validator.validate(VALID | {"modes": None, "program": None, "design": None})


@pytest.mark.parametrize(
    "keys",
    [
        {"modes": None},
        {"modes": []},
        {"spectrum": "x.csv"},
        {"spectrum": {"file": "x.csv", "participation": 0.5}},
        {"modes": {"spectrum": "x.csv"}},
        {"modes": {"spectrum": {"file": "x.csv"}}},
    ],
    ids=str,
)
def test_modes_and_spectrum_are_valid_in_every_form_that_the_loader_takes(validator, keys):
    validator.validate(VALID | axis_x(**keys))


def test_every_number_names_its_unit():
    properties = machine_schema()["properties"]
    assert properties["interval"]["description"].endswith("[s]")
    axis = next(iter(properties["axes"]["patternProperties"].values()))["properties"]
    assert axis["rapid"]["properties"]["jerk"]["description"].endswith(
        "[mm/s^3; inch/s^3 with units: inch; deg/s^3 on a rotary axis]"
    )
    assert axis["travel"]["description"].endswith(
        "[mm; inch with units: inch; deg on a rotary axis]"
    )


def test_every_key_of_the_table_is_documented():
    def check(section):
        for key in section.keys:
            assert key.doc.endswith("."), key.name
            if isinstance(key.kind, Section):
                check(key.kind)

    check(MACHINE)
