"""Messages in another language: every text for people is translated, and nothing else changes."""

import typing

import msgspec
import pytest

from app.messages.control import Accepted, SearchAccepted
from app.messages.driving import DriveStatus
from app.messages.status import Event, FindAttribute, FindReport, LevelRow, LevelTable
from app.view.spoken import TEXTS, spoken
from app.view.words import ENGLISH, Words

GERMAN = Words("de")
FIND = FindReport(
    goal_id=1,
    object="mug",
    position_world=(1.0, 2.0, 0.8),
    size_m=(0.1, 0.1, 0.1),
    probability=0.9,
    voxels=12,
    attributes=[FindAttribute(value="red", kind="colour", verdict="right", by="images")],
)


@pytest.mark.parametrize("kind", TEXTS, ids=lambda kind: kind.__name__)
def test_the_fields_that_are_named_exist_and_hold_texts(kind):
    types = typing.get_type_hints(kind)
    for name in TEXTS[kind]:
        parts = typing.get_args(types[name]) or (types[name],)
        assert any(part is str or part in TEXTS for part in parts), name


def test_texts_are_translated_inside_of_messages_too():
    table = LevelTable(
        goal_id=1,
        object="mug",
        context="on the table",
        provider="embedded prior",
        elapsed_ms=1.0,
        rows=[LevelRow(label="table", level="near", reason="mugs are often on the table")],
        notes=["every level is average"],
    )
    german = spoken(table, GERMAN)
    assert german.provider == "eingebaute Tabelle"
    assert german.rows == [LevelRow(label="table", level="near", reason="Becher: oft auf „Tisch“")]
    assert german.notes == ["alle Stufen sind mittel"]
    assert (german.object, german.context) == ("mug", "on the table")
    drive = spoken(DriveStatus(intervention="stopped: obstacle 0.20 m ahead"), GERMAN)
    assert drive.intervention == "angehalten: Hindernis 0,20 m voraus"
    assert spoken(FIND, GERMAN).attributes[0].by == "Bilder"


def test_what_people_wrote_is_no_text_of_the_navigator():
    accepted = SearchAccepted(goal_id=1, object="paused", position=0, notes=["paused"])
    assert spoken(accepted, GERMAN) == msgspec.structs.replace(accepted, notes=["pausiert"])


def test_english_messages_and_those_without_texts_are_the_same_objects():
    event = Event(stamp_ns=0, kind="found", text="found mug")
    assert spoken(event, ENGLISH) is event
    assert spoken(event, GERMAN).text == "„Becher“ gefunden"
    empty = FIND.attributes[0]
    assert spoken(b"bytes", GERMAN) == b"bytes"
    assert spoken(empty.verdict, ENGLISH) == "right"
    assert spoken(Accepted(detail="confirmed"), GERMAN) == Accepted(detail="bestätigt")
