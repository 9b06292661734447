import dataclasses

import pytest

from app.errors import UsageError
from app.evaluation.config import EvaluationConfig
from app.evaluation.setup import catalogue_of, expand_methods, settings_of, trial_of
from app.robot_file import template
from ippon.evaluation.methods.method_table import ABLATIONS, METHODS, method_named
from ippon.evaluation.trial import TrialConfig, config_hash
from ippon.robot import ZED


def test_groups_of_methods():
    assert expand_methods("ippon,ablations,no_bayes") == ("ippon", *ABLATIONS)
    assert expand_methods("all") == tuple(METHODS)
    with pytest.raises(UsageError, match=r"no method 'magic'.*groups are all, ablations"):
        expand_methods("ippon,magic")
    with pytest.raises(UsageError, match="no methods; there are ippon"):
        expand_methods(" , ")


def test_options_reach_the_set_up(tmp_path):
    command = EvaluationConfig(
        out=tmp_path, robot="zed", voxel_size_m=0.15, objects="habitat,Alarm Clock", starts=2
    )
    trial = trial_of(command)
    assert (trial.robot.name, trial.image_width) == ("zed", 320)
    assert trial.mission.map.voxel_size_m == 0.15
    catalogue = catalogue_of(command)
    assert catalogue.goals[-1] == "alarm_clock"
    assert catalogue.starts_per_goal == 2
    assert trial.limits.max_time_s == 300.0
    assert catalogue.min_shortest_path_m == 1.0
    longer = dataclasses.replace(command, max_time_s=900.0, min_path_m=8.0)
    assert trial_of(longer).limits.max_time_s == 900.0
    assert catalogue_of(longer).min_shortest_path_m == 8.0
    with pytest.raises(ValueError, match="max_time_s"):
        trial_of(dataclasses.replace(command, max_time_s=0.0))
    with pytest.raises(ValueError, match="image-width lies in 32 to 4096"):
        trial_of(dataclasses.replace(command, image_width=2))


def test_a_robot_of_ones_own_is_measured_with_its_own_body_and_camera(tmp_path):
    file = tmp_path / "scout.yaml"
    own = dataclasses.replace(ZED, name="scout", camera_height_m=0.6, max_depth_m=4.0)
    file.write_text(template(own))
    trial = trial_of(EvaluationConfig(out=tmp_path, robot=str(file)))
    assert (trial.robot.name, trial.robot.camera_height_m) == ("scout", 0.6)
    assert trial.mission.map.max_range_m == 4.0
    assert trial.limits == trial_of(EvaluationConfig(out=tmp_path, robot="zed")).limits
    with pytest.raises(ValueError, match="no robot profile 'nobody': give zed, habitat, "):
        trial_of(EvaluationConfig(out=tmp_path, robot="nobody"))


def test_under_the_errors_of_the_paper_the_detector_s_are_not_part_of_the_set_up(tmp_path):
    ippon = method_named("ippon")
    command = EvaluationConfig(out=tmp_path, segmentation_errors="paper")
    paper = trial_of(command)
    assert config_hash(paper, ippon) == config_hash(_with_smaller_boxes(paper), ippon)
    fixed = settings_of(command, paper, ("ippon",), "1")["fixed"]
    assert "segmentation_errors" not in fixed


def test_the_errors_of_a_detector_are_another_set_up(tmp_path):
    ippon = method_named("ippon")
    measured = EvaluationConfig(out=tmp_path, segmentation_errors="detector")
    trial = trial_of(measured)
    paper = trial_of(dataclasses.replace(measured, segmentation_errors="paper"))
    assert trial.world.segmentation_errors == "detector"
    hashes = {config_hash(one, ippon) for one in (trial, paper, _with_smaller_boxes(trial))}
    assert len(hashes) == 3
    fixed = settings_of(measured, trial, ("ippon",), "1")["fixed"]
    assert fixed["segmentation_errors"] == "detector"


def _with_smaller_boxes(trial: TrialConfig) -> TrialConfig:
    detector = dataclasses.replace(trial.world.detector, smallest_px=40.0)
    return dataclasses.replace(trial, world=dataclasses.replace(trial.world, detector=detector))


def test_searches_by_attribute_have_an_error_rate_that_is_part_of_the_set_up(tmp_path):
    plain = EvaluationConfig(out=tmp_path, objects="mug")
    command = dataclasses.replace(plain, attributes=True, attribute_error_rate=0.25)
    trial = trial_of(command)
    assert trial.world.attribute_errors.rate == 0.25
    assert catalogue_of(command).colours
    assert not catalogue_of(plain).colours
    assert trial_of(plain).world.attribute_errors.rate == 0.0, "whatever the rate would be"
    hashes = {config_hash(one, method_named("ippon")) for one in (trial, trial_of(plain))}
    assert len(hashes) == 2
    kept = settings_of(command, trial, ("ippon",), "test")["fixed"]
    assert kept["attribute_error_rate"] == 0.25
    assert "attribute_error_rate" not in settings_of(plain, trial_of(plain), (), "test")["fixed"]
    with pytest.raises(ValueError, match=r"the rate lies in 0 to 0\.5"):
        trial_of(dataclasses.replace(command, attribute_error_rate=0.7))
