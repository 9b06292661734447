import struct

import pytest
import zenoh.ext
from hypothesis import given
from hypothesis import strategies as st

from app.links.rmw_zenoh.protocol.attachment import (
    Attachment,
    decode_attachment,
    encode_attachment,
    gid_of,
)
from app.messages.cdr import MessageError
from tests.app.links.rmw_zenoh.protocol.published import CAPTURED_ATTACHMENT, CAPTURED_TOKEN

INT64 = st.integers(-(2**63), 2**63 - 1)
ATTACHMENTS = st.builds(
    Attachment, sequence=INT64, stamp_ns=INT64, gid=st.binary(min_size=16, max_size=16)
)


@given(ATTACHMENTS)
def test_an_attachment_comes_back(attachment):
    assert decode_attachment(encode_attachment(attachment)) == attachment


def test_a_captured_attachment_is_read_and_written_again():
    attachment = decode_attachment(CAPTURED_ATTACHMENT)
    assert attachment.sequence == 27
    assert 1.7e18 < attachment.stamp_ns < 1.9e18
    assert encode_attachment(attachment) == CAPTURED_ATTACHMENT


def test_the_publisher_of_a_captured_message_is_that_of_its_token():
    assert decode_attachment(CAPTURED_ATTACHMENT).gid == gid_of(CAPTURED_TOKEN)


@given(ATTACHMENTS)
def test_it_is_what_the_serialization_of_zenoh_itself_writes(attachment):
    values = (
        zenoh.ext.Int64(attachment.sequence),
        zenoh.ext.Int64(attachment.stamp_ns),
        attachment.gid,
    )
    written = zenoh.ext.z_serialize(values)
    assert encode_attachment(attachment) == written.to_bytes()


def test_older_versions_name_each_value():
    gid = bytes(range(16))
    old = (
        b"\x0fsequence_number" + struct.pack("<q", 5)
        + b"\x10source_timestamp" + struct.pack("<q", 7) + b"\x0asource_gid\x10" + gid
    )  # fmt: skip
    assert decode_attachment(old) == Attachment(sequence=5, stamp_ns=7, gid=gid)


@pytest.mark.parametrize(
    "payload", [b"", bytes(33), bytes(77), CAPTURED_ATTACHMENT[:-1], CAPTURED_ATTACHMENT + b"\0"]
)
def test_what_is_no_attachment_is_refused(payload):
    with pytest.raises(MessageError, match="attachment of rmw_zenoh"):
        decode_attachment(payload)
