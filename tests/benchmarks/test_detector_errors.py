"""What a bar on the mean score of four views lets through."""

import numpy as np
import pytest

from ippon.simulation.segmentation.detector import ScoreConfig
from tests.benchmarks import detector_errors


def test_scores_of_four_views_follow_their_distribution(monkeypatch):
    monkeypatch.setattr(detector_errors, "DRAWN", 20_000)
    still = {"label_sigma": 0.5, "view_sigma": 0.0, "frame_sigma": 0.0}
    lasting = ScoreConfig(mean=0.0, thing_sigma=1.0, **still)
    scores = detector_errors._four_views(lasting, 0.0)
    assert np.median(scores) == pytest.approx(0.5, abs=0.01)
    # One logit is a score of 0.73, one standard deviation of the things.
    assert (scores < 1 / (1 + np.e)).mean() == pytest.approx(0.159, abs=0.01)
    higher = detector_errors._four_views(lasting, 2.0)
    assert np.median(higher) == pytest.approx(1 / (1 + np.exp(-1.0)), abs=0.01)
    flicker = ScoreConfig(mean=0.0, thing_sigma=0.0, **{**still, "frame_sigma": 1.0})
    assert detector_errors._four_views(flicker, 0.0).std() < 0.6 * scores.std()
