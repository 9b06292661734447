"""What a detector is, and which names it uses."""

import pytest

from app.messages.cdr import MessageError, encode, header, make
from app.messages.perception.detector_info import (
    decode_detector_name,
    decode_label_names,
    encode_detector_name,
    encode_label_names,
)


def info(*classes):
    return encode(
        "vision_msgs/msg/LabelInfo", header=header(7, ""), threshold=0.0,
        class_map=[make("vision_msgs/msg/VisionClass", class_id=k, class_name=n)
                   for k, n in classes],
    )  # fmt: skip


def test_names_and_network_come_back():
    assert decode_label_names(encode_label_names(["cup", "tv"], 7)).names == {0: "cup", 1: "tv"}
    assert decode_detector_name(encode_detector_name(" yolo11n ", 7)) == "yolo11n"


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (info(), "1 to 5000 names; got 0"),
        (info((1, "")), "number 1 has 0"),
        (info((1, "x" * 81)), "number 1 has 81"),
        (info((1, "cup"), (1, "tv")), "number 1 is both 'cup' and 'tv'"),
    ],
)
def test_names_that_are_none(payload, text):
    with pytest.raises(MessageError, match=text):
        decode_label_names(payload)


def test_a_network_without_a_name():
    with pytest.raises(MessageError, match="in 1 to 80 characters; got 0"):
        decode_detector_name(encode_detector_name("  ", 7))


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage):
    survives_damage(decode_label_names, info((1, "cup"), (2, "tv"), (3, "chair")))
