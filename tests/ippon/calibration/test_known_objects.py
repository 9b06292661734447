"""Files that say where objects are, and files that do not."""

import pytest

from ippon.calibration.known_objects import KnownObjects, KnownObjectsError

CUP = {"label": "Cup", "centre_world": [1, 2, 3], "about_m": 0.1}


def test_labels_are_canonical_and_notes_are_ignored():
    known = KnownObjects.parse(
        {"objects": [CUP], "complete_for": ["cup"], "absent": ["teddy bear"], "notes": "by eye"}
    )
    assert known.objects[0].label == "cup"
    assert known.objects[0].centre_world == (1.0, 2.0, 3.0)
    assert known.labels == ("cup", "teddy_bear")
    assert known.is_complete("cup")
    assert known.is_complete("teddy_bear")
    assert not known.is_complete("chair")


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ([], "known objects are"),
        ({}, "are all empty: list at least one"),
        ({"objects": {}}, "objects is a list; got dict"),
        ({"objects": [{"label": "cup"}]}, "objects[0]: 'centre_world' is missing"),
        (
            {"objects": [CUP | {"centre_world": [1, 2]}]},
            "objects[0]: centre_world is [x, y, z] in met",
        ),
        ({"objects": [CUP | {"centre_world": 1}]}, "objects[0]: centre_world is [x, y, z] in met"),
        ({"objects": [CUP | {"centre_world": [1, 2, float("nan")]}]}, "finite centre_world"),
        ({"objects": [CUP | {"about_m": 0}]}, "about_m within 0 to 20"),
        ({"objects": [CUP | {"about_m": 10**400}]}, "objects[0]: int too large"),
        ({"objects": [CUP | {"label": None}]}, "objects[0]: label is a text; got None"),
        ({"objects": ["cup"]}, "objects[0]"),
        ({"absent": "cup"}, "absent is a list of labels; got 'cup'"),
        ({"objects": [CUP], "absent": ["cup"]}, "cup: listed as absent"),
    ],
)
def test_invalid_files_of_known_objects_are_rejected(content, text):
    with pytest.raises(KnownObjectsError) as error:
        KnownObjects.parse(content)
    assert text in str(error.value)
