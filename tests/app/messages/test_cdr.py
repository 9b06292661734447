import pytest

from app.messages import keys
from app.messages.cdr import MessageError, decode, encode, header, make, stamp_ns_of, typestore


def test_every_key_has_a_known_type():
    for typename in keys.ROS_TYPES.values():
        assert typename in typestore().fielddefs


@pytest.mark.parametrize("typename", ["ippon_msgs/msg/Heatmap", "vision_msgs/msg/Detection3DArray"])
def test_own_types_have_a_ros_type_hash(typename):
    assert typestore().hash_rihs01(typename).startswith("RIHS01_")


def test_type_hash_of_a_standard_message_is_that_of_ros():
    # As published by ROS 2 for std_msgs/msg/String.
    expected = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    assert typestore().hash_rihs01("std_msgs/msg/String") == expected


def test_bytes_are_little_endian_cdr():
    assert encode("std_msgs/msg/Float64", data=1.0) == b"\0\1\0\0" + b"\0" * 6 + b"\xf0\x3f"


def test_big_endian_is_read_too():
    assert decode(b"\0\0\0\0" + b"\x3f\xf0" + b"\0" * 6, "std_msgs/msg/Float64").data == 1.0


@pytest.mark.parametrize("stamp_ns", [0, 1, 999_999_999, 1_000_000_000, 1_732_150_000_123_456_789])
def test_stamps_keep_their_nanoseconds(stamp_ns):
    assert stamp_ns_of(header(stamp_ns, "map")) == stamp_ns


def test_a_stamp_that_is_no_time_is_refused():
    wrong = make("builtin_interfaces/msg/Time", sec=-1, nanosec=0)
    with pytest.raises(MessageError, match="is not a time"):
        stamp_ns_of(make("std_msgs/msg/Header", stamp=wrong, frame_id=""))


def test_errors_say_what_was_expected():
    with pytest.raises(MessageError, match=r"not a std_msgs/msg/Float64 \(3 bytes\)"):
        decode(b"abc", "std_msgs/msg/Float64")
    with pytest.raises(MessageError, match="at most 10 are accepted"):
        decode(b"\0\1\0\0" + b"\0" * 8, "std_msgs/msg/Float64", max_bytes=10)
