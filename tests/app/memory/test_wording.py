from datetime import UTC, datetime

import pytest

from app.memory.wording import said_place, said_time


def ns(*when):
    return int(datetime(*when, tzinfo=UTC).timestamp()) * 1_000_000_000


NOW = (2026, 11, 25, 9, 30)


@pytest.mark.parametrize(
    ("at", "said"),
    [
        (NOW, "just now"),
        ((2026, 11, 25, 9, 29), "1 minute ago"),
        ((2026, 11, 25, 9, 18), "12 minutes ago"),
        ((2026, 11, 25, 7, 5), "today 07:05"),
        ((2026, 11, 24, 18, 40), "yesterday 18:40"),
        ((2026, 11, 23, 18, 40), "Monday 18:40"),
        ((2026, 11, 18, 18, 40), "18 November 18:40"),
        ((2025, 11, 25, 9, 30), "25 November 2025 09:30"),
        ((2026, 11, 25, 10, 0), "today 10:00"),
    ],
)
def test_times_are_said_as_people_do(at, said):
    assert said_time(ns(*at), ns(*NOW), UTC) == said


def test_a_place_is_a_room_and_metres():
    at = (3.21, -1.0, 3.84)
    assert said_place("kitchen", at, 3.0) == "kitchen, at (3.2, -1.0), 0.8 m high"
    assert said_place("", at, 3.0) == "at (3.2, -1.0), 0.8 m high"
    assert said_place("kitchen", at) == "kitchen, at (3.2, -1.0), z = 3.8 m"
