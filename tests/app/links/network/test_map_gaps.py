import logging

import pytest

from app.links.network import inbox as inbox_module
from app.links.network.inbox import Inbox
from app.links.network.map_gaps import MapGaps


class _Link:
    openings = 0


@pytest.fixture
def link():
    return _Link()


@pytest.fixture
def inbox(monkeypatch):
    monkeypatch.setattr(inbox_module, "_LIMIT", 1)
    return Inbox(["map"])


@pytest.fixture
def gaps(link, inbox):
    return MapGaps(lambda: link.openings, inbox)


def _open_again(link, _):
    link.openings += 1


def _drop(_, inbox):
    inbox.put("map", b"")
    inbox.put("map", b"")


@pytest.mark.parametrize("miss", [_open_again, _drop])
def test_what_was_missed_is_told_once_and_a_map_asked_for_after_it_covers_it(
    miss, gaps, link, inbox
):
    assert not gaps.are_new()
    miss(link, inbox)
    assert gaps.are_new()
    assert not gaps.are_new()
    assert not gaps.are_filled()
    gaps.note_fetched(gaps.now())
    assert gaps.are_filled()


@pytest.mark.parametrize("miss", [_open_again, _drop])
def test_a_map_does_not_cover_what_was_missed_after_its_request(miss, gaps, link, inbox):
    asked_at = gaps.now()
    miss(link, inbox)
    gaps.note_fetched(asked_at)
    assert not gaps.are_filled()


def test_only_dropped_messages_are_logged(gaps, link, inbox, caplog):
    with caplog.at_level(logging.WARNING):
        _open_again(link, inbox)
        gaps.are_new()
        assert not caplog.messages
        _drop(link, inbox)
        gaps.are_new()
    assert caplog.messages == ["1 messages were dropped: fetching the whole map"]
