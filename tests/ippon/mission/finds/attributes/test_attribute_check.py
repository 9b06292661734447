import dataclasses

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.guidance.language.goals.goal import Attribute
from ippon.mission.finds.attributes.attribute_check import (
    AttributeCheck,
    AttributeCheckConfig,
    attributes_text,
    by_model,
    contradiction,
    seen_attributes,
)
from ippon.mission.snapshot import Find, JudgedAttribute
from ippon.observation import Heatmap
from ippon.simulation.homes.config import MUG_COLORS

CONFIG = AttributeCheckConfig()
CAMERA = PinholeCamera(width=64, height=48, fx=60.0, fy=60.0, cx=31.5, cy=23.5)
MUG = Find(
    position_world=(0.0, 0.0, 1.0), size_m=(0.2, 0.2, 0.2), probability=0.99, voxels=8, box_px=None
)
RED, NOT_RED = (
    Attribute(kind="colour", value="red"),
    Attribute(kind="colour", value="red", negated=True),
)


def _frame(color, shown=(12, 20)):
    """A frame of a camera at the origin that looks along z, with a mug of a colour ahead."""
    height, width = shown
    image = np.full((48, 64, 3), MUG_COLORS["green"], np.uint8)
    labels = np.zeros((48, 64, 2), np.uint8)
    labels[..., 0] = 255
    rows = slice(24 - height // 2, 24 + height // 2)
    columns = slice(32 - width // 2, 32 + width // 2)
    image[rows, columns] = MUG_COLORS[color]
    labels[rows, columns] = (0, 255)
    return Frame(
        stamp_ns=0,
        color=image,
        depth=np.full((48, 64), 1.0, np.float32),
        camera=CAMERA,
        T_world_camera=np.eye(4),
        T_world_base=np.eye(4),
        tilt_rad=0.0,
        heatmap=Heatmap(labels=("table",), ooi="mug", probabilities=labels),
        contact=False,
    )


def _judge(attribute, *colors, **shown):
    check = AttributeCheck(CONFIG, "mug", [attribute], 0.1)
    for color in colors:
        check.observe(_frame(color, **shown), [MUG])
    (judged,) = check.judge(MUG)
    return judged


def test_the_named_colour_is_right_and_another_is_wrong_by_the_pixels_of_the_find():
    right = _judge(RED, *["red"] * 5)
    assert (right.verdict, right.by, right.seen) == ("right", "images", "red")
    wrong = _judge(RED, *["white"] * 5)
    assert (wrong.verdict, wrong.seen) == ("wrong", "white")
    assert contradiction([wrong], "mug") == "a mug, but it is white"
    assert seen_attributes([right]) == ("red",)
    assert seen_attributes([wrong]) == ("white",)


def test_what_is_denied_is_judged_the_other_way():
    assert _judge(NOT_RED, *["white"] * 5).verdict == "right"
    wrong = _judge(NOT_RED, *["red"] * 5)
    assert wrong.verdict == "wrong"
    assert contradiction([wrong], "mug") == "a mug, but it is red"


def test_a_find_out_of_view_adds_no_image():
    check = AttributeCheck(CONFIG, "mug", [RED], 0.1)
    beside = dataclasses.replace(MUG, position_world=(5.0, 0.0, 1.0))
    for _ in range(9):
        check.observe(_frame("red"), [beside])
    assert check.judge(beside)[0].verdict == "unchecked"


def test_a_few_images_of_another_colour_do_not_decide():
    assert _judge(RED, *["red"] * 6, *["white"] * 3).verdict == "right"


@pytest.mark.parametrize(
    ("attribute", "colors", "shown"),
    [
        (RED, ["red"] * 4, (12, 20)),
        (RED, ["red"] * 9, (2, 2)),
        (Attribute(kind="colour", value="colourful"), ["red"] * 9, (12, 20)),
        (Attribute(kind="owner", value="Anna's"), ["red"] * 9, (12, 20)),
    ],
)
def test_what_cannot_be_judged_is_unchecked(attribute, colors, shown):
    assert _judge(attribute, *colors, shown=shown).verdict == "unchecked"


def _sized(label, value, metres, others=()):
    check = AttributeCheck(CONFIG, label, [Attribute(kind="size", value=value)], 0.1)
    of = [dataclasses.replace(MUG, size_m=(m, 0.2, 0.2)) for m in (metres, *others)]
    (judged,) = check.judge(of[0], of[1:])
    return judged.verdict


def test_sizes_are_judged_by_the_usual_one_or_by_the_others():
    assert _sized("basket", "large", 0.8) == "right"
    assert _sized("basket", "small", 0.8) == "wrong"
    assert _sized("basket", "large", 0.3) == "wrong"
    assert _sized("basket", "large", 0.6) == "unchecked", "of the usual size"
    assert _sized("sofa", "large", 0.6) == "unchecked", "its usual size is not known"
    assert _sized("mug", "large", 0.2) == "unchecked", "the map is too coarse for it"
    assert _sized("chair", "big", 1.2, others=(0.8, 0.7)) == "right"
    assert _sized("chair", "tiny", 0.8, others=(0.8,)) == "unchecked"
    assert _sized("chair", "medium", 0.8, others=(0.8,)) == "unchecked"


def test_a_model_judges_what_is_left_and_only_by_a_yes():
    owner = JudgedAttribute(value="Anna's", kind="owner")
    wooden = JudgedAttribute(value="wooden", kind="material")
    red = JudgedAttribute(value="red", kind="colour", verdict="right", by="images")
    judged = by_model([wooden, owner, red], "yes", "gemma")
    assert [one.by for one in judged] == ["gemma", "", "images"], "no image shows whose it is"
    assert by_model([wooden, owner, red], "no", "gemma") == (wooden, owner, red)


def test_texts_name_what_was_checked_and_what_was_not():
    red = JudgedAttribute(value="red", kind="colour", verdict="right", by="images")
    unsure = JudgedAttribute(value="blue", kind="colour")
    owner = JudgedAttribute(value="Anna's", kind="owner")
    assert attributes_text([red]) == "red: checked"
    assert attributes_text([unsure, owner]) == "colour, “Anna's” not checked"
    assert attributes_text([red, owner]) == "red: checked; “Anna's” not checked"
    assert attributes_text([]) == ""
    assert contradiction([red, owner], "mug") is None
    large = JudgedAttribute(value="red", kind="colour", verdict="wrong", by="images")
    assert contradiction([large], "apple") == "an apple, but it is not red"


def test_limits_that_contradict_each_other_are_rejected():
    with pytest.raises(ValueError, match="shares must grow"):
        AttributeCheckConfig(right_share=0.1)
    with pytest.raises(ValueError, match="ratios must grow"):
        AttributeCheckConfig(small_ratio=2.0)
    with pytest.raises(ValueError, match="min_images lies in 1 to images"):
        AttributeCheckConfig(min_images=50)
