"""YAML that people write by hand."""

import pytest
import yaml

from app.yaml_text import parse_yaml


def test_numbers_are_read_as_json_reads_them():
    assert parse_yaml("{a: 1e-3, b: [2, '3'], c: null}") == {"a": 1e-3, "b": [2, "3"], "c": None}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a: &x [1]\nb: *x\n", r"aliases \(\*name\) are not read"),
        ("a: {b: 1, b: 2}", "'b' is defined twice"),
        ("[" * 600 + "]" * 600, "nested too deeply"),
        ("? [1, 2]\n: 3\n", "unhashable"),
        ("a: [", "expected the node content"),
    ],
)
def test_what_is_not_read(text, why):
    with pytest.raises(yaml.YAMLError, match=why):
        parse_yaml(text)
