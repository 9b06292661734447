import json
from dataclasses import dataclass, field
from typing import Literal

import pytest

from app.configuration import (
    ConfigurationError,
    as_yaml,
    changed,
    differences,
    explanations,
    field_names,
    parse_changes,
    parse_yaml,
    read_file,
    unit_of,
)
from app.nodes.navigator.config import NavigatorConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """Drives one wheel."""

    max_speed_m_s: float = 1.0
    """Highest speed; larger is
    faster."""
    gears: int = 2

    def __post_init__(self) -> None:
        if self.gears < 1:
            raise ValueError(f"gears is at least 1; got {self.gears}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """A robot."""

    name: str = "one"
    motor: Motor = field(default_factory=Motor)
    budget_s: float | None = None
    labels: tuple[str, ...] = ("hat", "bed")
    drive: Literal["legs", "wheels"] = "legs"


def test_fields_of_groups_are_changed_and_the_rest_stays():
    robot = changed(Robot(), {"motor": {"gears": 3}, "budget_s": 1, "labels": ["cup"]})
    assert robot == Robot(motor=Motor(gears=3), budget_s=1.0, labels=("cup",))
    assert changed(robot, {}) == robot


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"motor": {"gear": 3}},
            r"motor\.gear: no field 'gear' in motor; did you mean motor",
        ),
        ({"gears": 3}, r"no field 'gears' in the configuration; did you mean motor\.gears\?"),
        ({"qqq": 3}, "no field 'qqq'.*there is name, motor, budget_s, labels, drive"),
        ({"motor": 3}, "motor is a group of fields; got 3"),
        ({"motor": {"gears": "many"}}, r"motor\.gears: Expected `int`, got `str`; got 'many'"),
        ({"budget_s": True}, r"budget_s: Expected `float \| null`, got `bool`"),
        ({"drive": "wings"}, r"drive is one of legs, wheels; got 'wings'"),
        ({"motor": {"gears": 0}}, r"motor\.gears: gears is at least 1; got 0"),
        ({"motor": {"gears": 0, "max_speed_m_s": 2.0}}, r"^motor: gears is at least 1"),
    ],
)
def test_an_error_names_the_field_and_what_would_work(changes, text):
    with pytest.raises(ConfigurationError, match=text):
        changed(Robot(), changes)


def test_name_value_pairs_reach_groups_and_their_shorthand():
    tree = parse_changes(Robot(), ["gears=4", "name=two", "motor.max_speed_m_s=1e-1"], "motor")
    assert tree == {"motor": {"gears": 4, "max_speed_m_s": 0.1}, "name": "two"}
    with pytest.raises(ConfigurationError, match=r"a change is NAME=VALUE.*got 'gears'"):
        parse_changes(Robot(), ["gears"])


def test_differences_name_fields_by_their_path():
    (found,) = differences(Robot(motor=Motor(gears=5)), Robot())
    assert (found.name, found.value, found.default) == ("motor.gears", 5, 2)


def test_the_printed_yaml_explains_every_field_and_reads_back():
    text = as_yaml(Robot())
    assert "  # [m/s] Highest speed; larger is faster.\n  max_speed_m_s: 1.0\n" in text
    assert "# Drives one wheel.\nmotor:\n" in text
    assert changed(Robot(name="other"), parse_yaml(text)) == Robot()


def test_the_navigator_s_whole_configuration_reads_back():
    config = NavigatorConfig()
    text = as_yaml(config, left_out=("profile",))
    assert changed(config, parse_yaml(text)) == config
    for name in field_names(config.mission):
        assert f"{name.split('.')[-1]}: " in text


def test_docstrings_below_fields_are_explanations():
    assert explanations(Motor) == {"max_speed_m_s": "Highest speed; larger is faster."}
    assert (unit_of("max_speed_m_s"), unit_of("gears"), unit_of("time_s")) == ("m/s", "", "s")


def test_files_are_yaml_or_json(tmp_path):
    file = tmp_path / "robot.json"
    file.write_text(json.dumps({"motor": {"gears": 3}}))
    assert read_file(file) == {"motor": {"gears": 3}}
    file.write_text('{\n\t"motor": {\n\t\t"gears": 4\n\t}\n}\n')
    assert read_file(file) == {"motor": {"gears": 4}}
    file.write_text("# nothing\n")
    assert read_file(file) == {}
    for content, text in (
        ("- a\n", "is not a mapping of names to values"),
        ("a: [", "configuration .*robot.json: "),
        ("a: 1\na: 2\n", "'a' is defined twice"),
        ('{\n\t"a": 1,\n\t"a": 2\n}', "'a' is defined twice"),
        ("labels: [&a [x], *a, *a]", "aliases .* are not read"),
        ("labels: " + "[" * 3000 + "]" * 3000, "nested too deeply"),
    ):
        file.write_text(content)
        with pytest.raises(ConfigurationError, match=text):
            read_file(file)
    with pytest.raises(ConfigurationError, match="No such file"):
        read_file(tmp_path / "none.yaml")
