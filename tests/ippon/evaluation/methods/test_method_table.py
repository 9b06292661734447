import dataclasses
import json

import pytest

from ippon.evaluation.methods.method_table import (
    ABLATIONS,
    BASELINES,
    METHODS,
    method_named,
    widened,
)
from ippon.guidance.levels import Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.config import MissionConfig
from ippon.robot import ZED
from ippon.vocabulary import MATTERPORT_40


def _changes(one, other, prefix=""):
    """Paths of the fields in which two configurations differ."""
    out = set()
    for f in dataclasses.fields(one):
        a, b = getattr(one, f.name), getattr(other, f.name)
        if dataclasses.is_dataclass(a):
            out |= _changes(a, b, f"{prefix}{f.name}.")
        elif a != b:
            out.add(prefix + f.name)
    return out


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        ("ippon", set()),
        ("no_bayes", {"map.fusion"}),
        ("no_guidance", set()),
        ("no_local_planner", {"planner.local_planner.enabled"}),
        (
            "hard_clearance",
            {
                "planner.local_planner.clearance",
                "planner.local_planner.hard_margin_m",
                "planner.traversability.margin_m",
                "planner.traversability.slow_fraction",
            },
        ),
        ("no_initial_yaw", {"look_around.turn"}),
        ("no_travel_pitch", {"travel_pitch.sweep"}),
        ("no_far_evidence", {"far_evidence.enabled"}),
        ("no_colour_check", {"attribute_check.max_range_m"}),
        (
            "paper",
            {
                "far_evidence.enabled",
                "planner.closer_look.passing.enabled",
                "planner.selection.cost_power",
                "planner.selection.framing_cap",
                "planner.selection.look_s",
                "planner.selection.passing_weight",
                "planner.selection.stay_power",
                "planner.view.termination_depth_m",
            },
        ),
        *((name, set()) for name in (*BASELINES, "oracle")),
    ],
)
def test_a_method_changes_only_its_own_settings(name, changed):
    plain = MissionConfig()
    assert _changes(plain, METHODS[name].configure(plain)) == changed


def test_without_guidance_every_level_is_average():
    guidance = EmbeddedPrior().levels("bed", "", MATTERPORT_40)
    flat = METHODS["no_guidance"].guide(guidance)
    assert set(flat.levels().tolist()) == {int(Level.AVERAGE)}
    assert [row.label for row in flat.rows] == list(MATTERPORT_40)
    for name in set(METHODS) - {"no_guidance"}:
        assert METHODS[name].guide(guidance) is guidance


@pytest.mark.parametrize("name", METHODS)
def test_the_settings_of_a_method_can_be_written_as_json(name):
    values = dataclasses.asdict(METHODS[name].configure(MissionConfig()))
    assert json.loads(json.dumps(values, allow_nan=False)) is not None


def test_groups_name_methods():
    # Only searches by attribute have a colour to check.
    others = {"ippon", "oracle", "no_colour_check"}
    assert set(ABLATIONS) | set(BASELINES) | others == set(METHODS)


def test_a_wider_robot_is_wider_by_that_much():
    assert widened(ZED, 0.05).radius_m == pytest.approx(ZED.radius_m + 0.05)


def test_an_unknown_method_lists_the_methods():
    with pytest.raises(ValueError, match=r"'greedy_nbw'; did you mean 'greedy_nbv'\? There are"):
        method_named("greedy_nbw")
    with pytest.raises(ValueError, match="no method 'vlfm'; there are ippon, no_bayes"):
        method_named("vlfm")
