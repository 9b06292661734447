import math

import pytest

from ippon.evaluation.episode import EpisodeLimits


def test_an_episode_has_an_image_and_an_end():
    assert EpisodeLimits(time_step_s=0.1, steps_per_frame=2, max_time_s=500.0).frames == 2500
    with pytest.raises(ValueError, match=r"less than the time between two images, 0\.2 s"):
        EpisodeLimits(time_step_s=0.1, steps_per_frame=2, max_time_s=0.05)
    for limit in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="must be positive"):
            EpisodeLimits(max_time_s=limit)
