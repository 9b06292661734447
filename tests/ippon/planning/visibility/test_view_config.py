"""Parameters of views that cannot work are refused."""

import math

import pytest

from ippon.planning.visibility.view_config import RegionConfig, StalenessConfig, ViewConfig


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"yaw_bins": 50}, "multiple of heading_stride"),
        ({"unknown_occupied": 0.0}, "in \\(0, 1]"),
        ({"termination_depth_m": -0.1}, "at least 0"),
        ({"termination_threshold": 1.0}, "must lie in"),
        ({"termination_depth_m": math.inf}, "finite"),
        ({"image_fraction": 1.1}, "image_fraction must lie in \\(0, 1]; got 1.1"),
        ({"framing_hold": -0.1}, "framing_hold and framing_centre_weight must be at least 0"),
    ],
)
def test_rasters_and_probabilities_that_cannot_work_are_refused(values, text):
    with pytest.raises(ValueError, match=text):
        ViewConfig(**values)


def test_a_preference_that_means_its_opposite_is_refused():
    with pytest.raises(ValueError, match="avoided_weight must lie in"):
        RegionConfig(avoided_weight=2.0)
    with pytest.raises(ValueError, match="preferred_weight be finite and at least 1"):
        RegionConfig(preferred_weight=0.5)


def test_a_threshold_that_every_block_exceeds_is_refused():
    with pytest.raises(ValueError, match="must be above 0; got 24"):
        StalenessConfig(occupied_voxels=0.0)
