import math

from ippon.mission.finds.termination_threshold import is_small, lowest_m, termination_voxels


def test_larger_objects_need_more_voxels() -> None:
    assert (
        termination_voxels("bed", "bed", 0.1)
        > termination_voxels("plant", "plant", 0.1)
        > termination_voxels("hat", None, 0.1)
        >= 1.0
    )


def test_an_instance_of_a_common_object_is_as_large_as_it() -> None:
    assert termination_voxels("armchair", "chair", 0.1) == termination_voxels("chair", None, 0.1)


def test_surface_voxels_scale_with_the_square_of_their_number() -> None:
    assert termination_voxels("bed", "bed", 0.05) == 4 * termination_voxels("bed", "bed", 0.1)


def test_furniture_is_not_small_and_what_stands_on_it_is() -> None:
    assert not is_small("armchair", "chair")
    assert not is_small("tv", None)
    assert is_small("hat", None)


def test_what_stands_begins_above_the_floor() -> None:
    standing = [(name, None) for name in ("bed", "toilet", "sofa", "plant", "tv")]
    assert {lowest_m(*one) for one in (*standing, ("armchair", "chair"))} == {0.1}


def test_what_is_small_begins_on_the_floor() -> None:
    assert {lowest_m(label, None) for label in ("hat", "mug", "book", "parrot")} == {0.0}


def test_what_lies_flat_may_be_in_the_floor() -> None:
    flat = [
        ("shower", None),
        ("yoga_mat", "gym_equipment"),
        ("roomba", "appliances"),
        ("carpet", "floor"),
        ("floor", None),
        ("bath_mat", None),
    ]
    assert {lowest_m(label, category) for label, category in flat} == {-math.inf}
