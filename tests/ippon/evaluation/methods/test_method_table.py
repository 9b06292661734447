import dataclasses
import json
from dataclasses import replace

import pytest

from ippon.evaluation.methods.method_table import (
    ABLATIONS,
    BASELINES,
    METHODS,
    base_name,
    method_named,
    widened,
)
from ippon.evaluation.trial import TrialConfig, config_hash
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


@pytest.fixture
def mine(monkeypatch):
    """A method with two parameters, among those of this program."""
    method = replace(METHODS["ippon"], name="mine", parameters={"power": 2.0, "look_s": 1.0})
    monkeypatch.setitem(METHODS, "mine", method)
    return method


def test_values_of_parameters_make_a_method_of_their_own(mine):
    assert method_named("mine") is mine
    other = method_named("mine@look_s=0.50@power=3")
    assert other.name == "mine@power=3@look_s=0.5"
    assert other.parameters == {"power": 3.0, "look_s": 0.5}
    assert method_named(other.name) == other
    for value in (1000001.0, 0.1234567, -2e-9, 1.0 / 3.0):
        assert method_named(method_named(f"mine@power={value!r}").name).parameters["power"] == value
    assert method_named("mine@power=1").parameters == {"power": 1.0, "look_s": 1.0}
    assert base_name(other.name) == base_name("mine") == "mine"
    hashes = {config_hash(TrialConfig(), one) for one in (mine, other)}
    assert len(hashes) == 2


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("mine@speed=1", r"mine has no parameter 'speed'; it has power=2, look_s=1"),
        ("ippon@speed=1", r"ippon has no parameter 'speed'; it has none"),
        ("mine@", r"mine has no parameter ''"),
        ("mine@power", r"mine@power= takes a number; got ''"),
        ("mine@power=nan", r"mine@power= takes a number; got 'nan'"),
        ("mine@power=fast", r"mine@power= takes a number; got 'fast'"),
        ("mini@power=1", r"no method 'mini'; did you mean 'mine'"),
    ],
)
def test_a_parameter_that_is_not_there_or_no_number_is_refused(mine, name, text):
    with pytest.raises(ValueError, match=text):
        method_named(name)
