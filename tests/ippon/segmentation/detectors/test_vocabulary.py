"""What a closed vocabulary knows, and what it says of the rest."""

import pytest

from ippon.guidance.language.naming import resolve_object, same_object
from ippon.segmentation.detectors.coco import (
    ALSO,
    COCO_80,
    COCO_91,
    NO_CLASS,
    SAME,
    synonyms_of_class,
)
from ippon.segmentation.detectors.vocabulary import (
    ClosedVocabulary,
    closed_vocabulary,
    unsupported_reason,
)
from ippon.vocabulary import LABORATORY_40, MATTERPORT_40

COCO = ClosedVocabulary.of(COCO_80)
NOT_READ_AS_WRITTEN = {"traffic_light", "parking_meter", "hot_dog"}
"""Words that the text of a goal turns into others: a hot dog is a dog that is hot."""


def test_the_numbers_of_coco_are_those_of_its_categories():
    assert (len(COCO_80), len(COCO_91), len(set(COCO_80))) == (80, 91, 80)
    assert [COCO_91[k] for k in (1, 47, 62, 67, 72, 90)] == [
        "person", "cup", "chair", "dining_table", "tv", "toothbrush",
    ]  # fmt: skip
    assert tuple(name for name in COCO_91 if name != NO_CLASS) == COCO_80


@pytest.mark.parametrize("vocabulary", [MATTERPORT_40, LABORATORY_40, ()])
def test_a_person_who_asks_for_a_class_is_answered_by_it(vocabulary):
    for name in COCO_80:
        if name in NOT_READ_AS_WRITTEN:
            continue
        ooi = resolve_object(name.replace("_", " "), vocabulary).canonical
        assigned = COCO.assign(vocabulary or ("wall",), ooi)
        assert assigned.ooi == ooi, name
        assert assigned.label_of_class[COCO_80.index(name)] == ooi


def test_synonyms_are_those_of_the_words_that_people_ask_with():
    unknown = {"motorbike", "aeroplane", "doughnut", "tennis_racquet", "microwave_oven"}
    for first, *rest in SAME:
        for other in rest:
            assert other in unknown or same_object(first, other), (first, other)
    assert set(ALSO) <= {name for group in SAME for name in group} | set(COCO_80)


def test_labels_are_the_requested_ones_that_are_known():
    assigned = COCO.assign(("wall", "sofa", "table", "fridge", "appliances"), "mug")
    assert assigned.labels == ("sofa", "table", "fridge", "mug")
    assert assigned.ooi == "mug"
    told = dict(zip(COCO_80, assigned.label_of_class, strict=True))
    assert told["couch"] == "sofa"
    assert told["dining_table"] == "table"
    assert told["refrigerator"] == "fridge"
    assert told["oven"] is None
    assert told["cup"] == "mug"
    assert told["person"] is None


def test_the_object_of_interest_comes_before_common_labels():
    assigned = COCO.assign(("tv", "chair"), "monitor")
    assert (assigned.labels, assigned.ooi) == (("chair", "monitor"), "monitor")
    assigned = COCO.assign(("tv", "monitor"), "tv")
    assert (assigned.labels, assigned.ooi) == (("tv",), "tv")


def test_further_objects_of_interest_come_before_common_labels_too():
    assigned = COCO.assign((*MATTERPORT_40, "desk", "mug"), "keys", also=("desk", "mug"))
    told = dict(zip(COCO_80, assigned.label_of_class, strict=True))
    assert (told["dining_table"], told["cup"], assigned.ooi) == ("desk", "mug", None)
    assert "table" not in assigned.labels
    assigned = COCO.assign((*MATTERPORT_40, "mug"), "cup", also=("mug",))
    assert assigned.label_of_class[COCO_80.index("cup")] == "cup"


def test_classes_are_told_by_names_that_are_read_as_what_they_answer_to():
    custom = ClosedVocabulary(
        ("ding17", "cup", "couch", "", "kram"),
        (("mug",), ("cup", "coffee_cup"), ("sofa", "settee"), (), ("mug", "beaker")),
    )
    assert custom.told_names == ("mug", "cup", "sofa/settee", "mug/beaker")
    assert set(synonyms_of_class("mug/beaker")) >= {"mug", "beaker"}
    assert COCO.told_names == COCO.names


def test_two_words_for_a_class_are_found_under_the_same_label():
    labels = (*MATTERPORT_40, "cup", "mug", "monitor", "hat")
    found = {name: COCO.label_for(name, labels) for name in ("cup", "mug", "monitor", "tv", "hat")}
    assert found == {"cup": "cup", "mug": "cup", "monitor": "tv", "tv": "tv", "hat": None}
    assert COCO.label_for("mug", (*MATTERPORT_40, "mug")) == "mug"


def test_unknown_objects_are_reported():
    assert COCO.assign(("chair",), "hat").ooi is None
    assert COCO.assign(("wall", "floor"), "hat").labels == ()
    assert COCO.unseen(("wall", "chair", "hat", "television")) == ("wall", "hat")
    assert not COCO.knows("")


@pytest.mark.parametrize(
    ("label", "near"),
    [
        ("desk_chair", ("chair",)),
        ("coffee_table", ("dining_table",)),
        ("beer_bottle", ("bottle",)),
        ("bakpack", ("backpack",)),
        ("keybord", ("keyboard",)),
        ("stuffed_bear", ("bear", "teddy_bear")),
        ("hat", ()),
    ],
)
def test_the_nearest_kinds_share_a_word_or_are_misspelt(label, near):
    assert COCO.nearest(label) == near


def test_an_unsupported_label_gets_alternatives():
    assert ClosedVocabulary.of(["cup", "office chair", "", "cup"]).unsupported_reason(
        "arm_chair"
    ) == (
        "this detector knows 2 kinds of thing and 'arm_chair' is none of them; nearest to it: "
        "office_chair; it knows: cup, office_chair; an open-vocabulary network "
        "(--segmentation.backend san or owlv2) takes any word"
    )
    many = ClosedVocabulary.of([f"thing {k}" for k in range(365)]).unsupported_reason("hat")
    assert "knows 365 kinds of thing" in many
    assert "thing_99 and 265 more; an open" in many


def test_a_detector_that_tells_two_kinds_apart_does_not_call_one_the_other():
    """Objects365 has desks beside dining tables, LVIS mugs beside cups."""
    fine = ClosedVocabulary.of(("cup", "mug", "dining table", "desk", "table", "sofa", "couch"))
    told = fine.assign(("wall", "table"), "mug")
    assert told.label_of_class == (None, "mug", "table", None, "table", None, None)
    assert fine.assign(("table",), "desk").label_of_class[2:5] == ("table", "desk", "table")
    assert fine.assign(("wall",), "sofa").label_of_class[5:] == ("sofa", "sofa")


def test_a_name_for_several_kinds_answers_to_each():
    objects_365 = ClosedVocabulary.of(("Monitor/TV", "Cabinet/shelf", "Handbag/Satchel"))
    told = objects_365.assign(("wall", "tv", "cabinet"), "handbag")
    assert told.label_of_class == ("tv", "cabinet", "handbag")
    assert objects_365.assign((), "monitor").ooi == "monitor"
    assert objects_365.knows("television")
    assert objects_365.names == ("monitor/tv", "cabinet/shelf", "handbag/satchel")


def test_only_closed_vocabularies_refuse():
    class Closed:
        vocabulary = COCO

    assert closed_vocabulary(Closed()) is COCO
    assert unsupported_reason(Closed(), "couch") is None
    assert "'hat' is none of them" in (unsupported_reason(Closed(), "hat") or "")
    assert closed_vocabulary(object()) is None
    assert unsupported_reason(object(), "hat") is None


def test_a_class_answers_to_its_own_name_first():
    assert synonyms_of_class("couch") == ("couch", "sofa", "settee")
    assert synonyms_of_class("television")[:4] == ("television", "tv", "monitor", "screen")
    assert synonyms_of_class("forklift") == ("forklift",)
