"""Saved searches: kept across restarts, run, deleted, and set aside when damaged."""

from types import SimpleNamespace

import pytest

from app.links.network.requests import RequestRefusedError
from app.messages.control import SavedSearches, SavedSearchRequest, SearchRequest, decode
from app.nodes.navigator.services.saved_search_service import MAX_SAVED, SavedSearchService
from ippon.guidance.language.goals.goal import Attribute


@pytest.fixture
def shelf(desk, tmp_path):
    path = tmp_path / "searches" / "ippon.json"
    published = []

    def start(path=path):
        topic = SimpleNamespace(put=lambda p: published.append(decode(p, SavedSearches)))
        service = SavedSearchService(desk.goals, topic, path)

        def ask(action, **fields):
            return service.change(SavedSearchRequest(action=action, **fields)).detail

        return ask

    return SimpleNamespace(start=start, path=path, published=published, desk=desk)


def shown(shelf):
    return [(one.saved_id, one.object, one.context) for one in shelf.published[-1].searches]


def test_saved_searches_outlive_a_restart_and_their_numbers_are_not_used_twice(shelf):
    ask = shelf.start()
    assert shown(shelf) == []
    assert ask("save", object=" my keys ", context="in the hall") == "my keys is saved"
    ask("save", object="mug")
    assert ask("save", object="mug") == "mug is saved already"
    again = shelf.start()
    assert shown(shelf) == [(1, "my keys", "in the hall"), (2, "mug", "")]
    assert again("delete", saved_id=2) == "mug is no longer saved"
    again("save", object="tv")
    assert shown(shelf) == [(1, "my keys", "in the hall"), (3, "tv", "")]
    with pytest.raises(RequestRefusedError, match="there is no saved search 2 any more"):
        again("run", saved_id=2)


def test_a_saved_search_is_run_once_at_a_time(shelf):
    ask = shelf.start()
    ask("save", object="mug", context="on the desk")
    assert ask("run", saved_id=1).startswith("looking for: mug, after 1 other goal")
    assert "goal 2 searches for it already" in ask("run", saved_id=1)
    mug = shelf.desk.queue.find(2)
    assert (mug.goal.object, mug.goal.context) == ("mug", "on the desk")
    assert shelf.desk.waiting() == [2]


def test_what_cannot_be_saved_says_why(shelf):
    ask = shelf.start()
    with pytest.raises(RequestRefusedError, match="the object is empty"):
        ask("save", object=" ")
    for number in range(MAX_SAVED):
        ask("save", object="mug", context=f"place {number}")
    with pytest.raises(RequestRefusedError, match="50 searches are saved; delete one first"):
        ask("save", object="tv")
    shelf.path.unlink()
    shelf.path.mkdir()
    with pytest.raises(RequestRefusedError, match=r"the searches are not kept in ippon\.json"):
        ask("delete", saved_id=1)
    assert len(shown(shelf)) == MAX_SAVED, "what is not kept is not changed"


@pytest.mark.parametrize("content", [b"{", b'{"searches": [{"object": "\xff"}]}'])
def test_a_damaged_file_is_set_aside(shelf, content):
    shelf.path.parent.mkdir()
    shelf.path.write_bytes(content)
    ask = shelf.start()
    assert "no searches were read from ippon.json" in shelf.published[-1].note
    assert "the file is kept as ippon.json.aside-1" in shelf.published[-1].note
    ask("save", object="mug")
    assert shown(shelf) == [(1, "mug", "")]
    assert (shelf.path.parent / "ippon.json.aside-1").read_bytes() == content


def test_a_goal_is_saved_with_its_count_and_what_tells_it_from_others(shelf):
    ask = shelf.start()
    blue = Attribute(kind="colour", value="blue", negated=True)
    wanted = SearchRequest(object="chairs", count=2, attributes=[blue], other=True)
    shelf.desk.goals.search(wanted)
    ask("save", object="chairs", goal_id=2)
    assert ask("save", object="chairs", goal_id=2) == "chairs is saved already"
    assert ask("save", object="chairs") == "chairs is saved", "one chair of any colour is another"
    shelf.desk.ask(2, "remove")
    shelf.start()("run", saved_id=1)
    goal = shelf.desk.queue.find(3).goal
    assert (goal.display, goal.count, goal.attributes, goal.other) == ("chairs", 2, (blue,), True)
    with pytest.raises(RequestRefusedError, match="there is no goal 99 any more"):
        ask("save", object="chairs", goal_id=99)
