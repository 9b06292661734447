import msgspec
import pytest

from app.messages.body import BodyConfiguration
from app.messages.control import (
    ContextText,
    ControlRequest,
    ErrorReply,
    FeedbackRequest,
    SavedSearches,
    SearchRequest,
    decode,
    encode,
)
from app.messages.driving import DriveStatus, PaintedRegions
from app.messages.lease import LeaseStatus
from app.messages.memory import MapAlignment
from app.messages.recording import RecordingStatus
from app.messages.status import Event, FarEvidenceCells, LevelTable, SegmentationLabels, Status


def test_request_round_trip() -> None:
    request = SearchRequest(object="hat", context="on the sofa")
    assert decode(encode(request), SearchRequest) == request


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (b"", "truncated"),
        (b"\xff\xfe", "JSON is malformed"),
        (b'{"object": "\xff"}', "not JSON: 'utf-8' codec"),
        (b"[]", "Expected `object`, got `array`"),
        (b"{}", "missing required field `object`"),
        (b'{"object": ""}', "length >= 1"),
        (b'{"object": 3}', r"Expected `str`, got `int` - at `\$.object`"),
        (b'{"object": "hat", "contxt": "sofa"}', "unknown field `contxt`"),
        (b'{"object": "' + b"h" * 81 + b'"}', "length <= 80"),
        (b'{"object": "hat", "context": "' + b"x" * 10_000 + b'"}', "length <= 2000"),
    ],
)
def test_malformed_request_says_what_is_wrong(payload: bytes, message: str) -> None:
    with pytest.raises(msgspec.DecodeError, match=message):
        decode(payload, SearchRequest)


def test_a_message_that_is_nested_without_end_is_malformed() -> None:
    deep = b'{"unknown": ' + 100_000 * b"["
    with pytest.raises(msgspec.DecodeError, match="not JSON: maximum recursion"):
        decode(deep, BodyConfiguration)


def test_a_request_without_new_fields_is_read_by_earlier_versions() -> None:
    assert encode(SearchRequest(object="hat")) == b'{"object":"hat"}'
    assert encode(ControlRequest(action="stop")) == b'{"action":"stop"}'
    assert encode(FeedbackRequest(verdict="confirm")) == b'{"verdict":"confirm"}'
    assert decode(b'{"object":"hat"}', SearchRequest) == SearchRequest(object="hat")


def test_what_a_later_version_adds_to_a_published_message_is_ignored() -> None:
    event = decode(b'{"stamp_ns": 1, "kind": "error", "text": "full", "mood": "bad"}', Event)
    assert event == Event(stamp_ns=1, kind="error", text="full")
    for kind in (Status, LevelTable, LeaseStatus, RecordingStatus, MapAlignment, PaintedRegions,
                 SavedSearches, SegmentationLabels, FarEvidenceCells):  # fmt: skip
        assert not kind.__struct_config__.forbid_unknown_fields, kind
    drive = decode(encode(DriveStatus(mode="manual"))[:-1] + b',"mood":"bad"}', DriveStatus)
    assert drive == DriveStatus(mode="manual")


def test_every_message_has_a_schema() -> None:
    schema = msgspec.json.schema(Status)
    assert "Timings" in schema["$defs"]
    assert msgspec.json.schema(ErrorReply)
    assert msgspec.json.schema(ContextText)["maxLength"] == 2000
