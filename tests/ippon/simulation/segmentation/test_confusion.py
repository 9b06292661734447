import numpy as np
import pytest

from ippon.simulation.segmentation import confusion
from ippon.simulation.segmentation.confusion import affinity, ooi_affinity
from ippon.vocabulary import MATTERPORT_40


def test_every_look_alike_is_a_known_label():
    for _, group in confusion._LOOK_ALIKES:
        assert set(group) <= set(MATTERPORT_40)
        assert len(set(group)) == len(group)


@pytest.mark.parametrize("category", MATTERPORT_40)
def test_every_label_is_confused_with_others_only(category):
    weights = affinity(category, MATTERPORT_40)
    assert weights[MATTERPORT_40.index(category)] == 0.0
    assert (np.delete(weights, MATTERPORT_40.index(category)) > 0.0).all()


@pytest.mark.parametrize(
    ("category", "look_alike", "other"),
    [
        ("table", "counter", "toilet"),
        ("chair", "stool", "window"),
        ("bed", "sofa", "sink"),
        ("cabinet", "chest_of_drawers", "plant"),
        ("tv", "picture", "bed"),
        ("shower", "bathtub", "tv"),
        ("curtain", "blinds", "stool"),
    ],
)
def test_similar_labels_are_confused_most(category, look_alike, other):
    weights = affinity(category, MATTERPORT_40)
    names = list(MATTERPORT_40)
    assert weights[names.index(look_alike)] > 5.0 * weights[names.index(other)]


def test_the_goal_is_seen_in_its_like_and_in_things_without_a_name():
    hats = frozenset({"clothes"})
    assert ooi_affinity("clothes", hats) > 5.0 * ooi_affinity("wall", hats)
    assert ooi_affinity("objects", frozenset()) > 5.0 * ooi_affinity("wall", frozenset())
