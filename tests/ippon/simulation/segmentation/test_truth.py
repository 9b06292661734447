import pytest

from ippon.simulation.scene import Instance
from ippon.simulation.segmentation.truth import detectable_labels, true_label
from ippon.vocabulary import MATTERPORT_40

HAT = Instance(
    node="clothes.0", category="clothes", label="Sun hat", aabb_min=(0, 0, 0), aabb_max=(1, 1, 1)
)


@pytest.mark.parametrize(
    ("ooi", "labels", "expected"),
    [
        ("sun_hat", ("clothes",), "sun_hat"),
        ("clothes", ("clothes",), "clothes"),
        ("shoe", ("clothes",), "clothes"),
        ("shoe", ("clothes", "sun_hat"), "sun_hat"),
        (None, ("chair",), None),
    ],
)
def test_the_object_of_interest_comes_first_then_the_noun_then_the_category(ooi, labels, expected):
    assert true_label(HAT, labels, ooi) == expected


def test_the_predicate_decides_which_objects_match_the_goal():
    assert true_label(HAT, (), "headgear") is None
    assert true_label(HAT, (), "headgear", lambda name, _: name == "sun_hat") == "headgear"


def test_a_detector_is_asked_for_things_alone_and_once():
    told = detectable_labels(MATTERPORT_40, "tv")
    assert told[-1] == "tv"
    assert told.count("tv") == 1
    assert not {"wall", "floor", "ceiling", "objects", "others", "furniture"} & set(told)
    assert "wall" in detectable_labels(MATTERPORT_40, "wall")
    assert detectable_labels(("wall",), None) == ()


def test_further_objects_of_interest_come_before_the_common_labels():
    assert true_label(HAT, ("clothes",), "shoe", also=("mug", "sun_hat")) == "sun_hat"
    assert true_label(HAT, ("clothes",), "shoe", also=("mug",)) == "clothes"
    told = detectable_labels(MATTERPORT_40, "hat", ("mug", "tv", "hat"))
    assert told[-3:] == ("mug", "tv", "hat")
    assert told.count("tv") == 1
