"""Parameters of behaviors that cannot work are refused."""

import pytest

from ippon.mission.behaviors.config import (
    LookAroundConfig,
    RecoveryConfig,
    StepCloserConfig,
    TravelPitchConfig,
)


@pytest.mark.parametrize(
    ("config", "wrong", "text"),
    [
        (RecoveryConfig, {"stuck_after_s": 0.0}, "stuck_after_s must be above 0"),
        (RecoveryConfig, {"turn_s": -1.0}, "turn_s at least 0; got 2.5, 0.8, 0.2, -1.0"),
        (LookAroundConfig, {"overlap_fraction": 1.0}, "must lie in .0, 1. and"),
        (LookAroundConfig, {"tilt_tolerance_rad": 0.0}, "tilt_tolerance_rad be above 0"),
        (StepCloserConfig, {"share": 1.5}, "share must lie in 0 to 1; got 1.5"),
        (StepCloserConfig, {"near_m": 0.0}, "near_m, least_gain_m and most_s must be above 0"),
        (TravelPitchConfig, {"period_s": 0.0}, "period_s must be above 0; got 0.0"),
    ],
)
def test_parameters_without_meaning_are_refused(config, wrong, text):
    with pytest.raises(ValueError, match=text):
        config(**wrong)
