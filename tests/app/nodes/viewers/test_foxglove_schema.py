"""Schemas have nothing that Foxglove's parser refuses, and the fields that are plotted."""

import pytest

from app.nodes.viewers.foxglove_schema import schema_of
from app.nodes.viewers.foxglove_topics import JSON_TYPES

PLAIN = {"boolean", "string", "number"}


def check_object(schema):
    """As Foxglove's parser does, which throws on everything else."""
    assert schema["type"] == "object"
    for each in schema["properties"].values():
        field = each["items"] if each["type"] == "array" else each
        if field["type"] == "object":
            check_object(field)
        else:
            assert field["type"] in PLAIN


@pytest.mark.parametrize("key", JSON_TYPES)
def test_foxglove_reads_it(key):
    schema = schema_of(JSON_TYPES[key])
    check_object(schema)
    assert schema["properties"]
    assert schema["title"] == JSON_TYPES[key].__name__


def test_what_is_plotted_and_what_is_nullable_has_its_type():
    fields = schema_of(JSON_TYPES["status"])["properties"]
    assert fields["best_ooi"] == {"type": "number"}
    assert fields["state"] == {"type": "string"}
    assert fields["goal"]["properties"]["object"] == {"type": "string"}
    assert fields["queue"]["items"]["properties"]["goal_id"] == {"type": "number"}
    assert fields["find"]["properties"]["position_world"]["items"] == {"type": "number"}


def test_arrays_in_arrays_are_left_out():
    fields = schema_of(JSON_TYPES["map/glimpses"])["properties"]
    assert set(fields) == {"stamp_ns", "cell_m"}
