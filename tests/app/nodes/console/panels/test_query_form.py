"""The fields of a search, of which each browser has its own."""

import itertools
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from app.messages.control import SentenceReading
from app.nodes.console.link.commands import StartedSearch
from app.nodes.console.panels import query_form
from app.nodes.console.panels.search import SearchPanel
from app.view.words import ENGLISH
from ippon.guidance.language.goals.goal import Goal


class Client:
    """A browser of viser whose fields are typed in and whose button is pressed."""

    def __init__(self):
        self.gui = self
        self.fields, self.submits = {}, []

    def add_form(self, _):
        form = MagicMock()
        form.on_submit.side_effect = self.submits.append
        form.__enter__.return_value = form
        return form

    def add_text(self, label, value, hint):
        field = SimpleNamespace(value=value, typed=[])
        field.on_update = field.typed.append
        self.fields[label] = field
        return field

    def add_button(self, *_, **__):
        return MagicMock()

    def type(self, label, text):
        field = self.fields[ENGLISH(label)]
        field.value = text
        for tell in field.typed:
            tell(None)

    def search(self):
        for submit in self.submits:
            submit(None)


@pytest.fixture
def actions():
    actions = MagicMock(say=ENGLISH, recorded=False)
    numbers = itertools.count(7)
    actions.search.side_effect = lambda wanted, *_, **__: StartedSearch(wanted, next(numbers))
    return actions


@pytest.fixture
def panel(actions, monkeypatch):
    monkeypatch.setattr(query_form, "ignore_disconnect", lambda _: nullcontext())
    return SearchPanel(MagicMock(), actions)


def test_each_browser_searches_for_what_it_has_typed(panel, actions):
    kept = []
    one, other = Client(), Client()
    panel.open_form(one, None, kept.append)
    panel.open_form(other, None, lambda _: None)
    one.type("field.find", "towel")
    one.type("panel.search.context", "in the bathroom")
    other.type("field.find", "keys")
    other.search()
    assert actions.search.call_args.args == ("keys", "", query_form.USUAL_SCENARIO)
    one.search()
    assert actions.search.call_args.args[:2] == ("towel", "in the bathroom")
    assert kept[-1] == ("towel", "in the bathroom", query_form.USUAL_SCENARIO)


def test_a_draft_stands_in_the_fields(panel, actions):
    client = Client()
    panel.open_form(client, ("mug", "in the kitchen", "an office"), lambda _: None)
    client.search()
    assert actions.search.call_args.args == ("mug", "in the kitchen", "an office")


@pytest.mark.parametrize(
    ("typed", "asked"),
    [
        ("mug", ("mug", "in the flat, on the sofa")),
        ("my keys, they are in the bedroom", ("my keys, they are in the bedroom", "in the flat")),
    ],
)
def test_the_context_of_a_doubtful_reading_stays_with_its_object(panel, typed, asked):
    client = Client()
    form = panel.open_form(
        client, ("my thing on the sofa", "in the flat", "a home"), lambda _: None
    )
    form.propose("thing", "in the flat, on the sofa")
    client.type("field.find", typed)
    assert form.asked() == (*asked, "a home")
    assert form.question == form.asked()


def test_a_doubtful_reading_waits_for_the_browser_that_asked(panel, actions):
    one, other = Client(), Client()
    for client in one, other:
        panel.open_form(client, None, lambda _: None)
        client.type("field.find", "a mug or maybe a cup")
    goal = MagicMock(context="", order="and", attributes=(), count=1, refers_to="", object="mug")
    reading = MagicMock(doubtful=True, because="Which one?", unused=(), notes=(), note="")
    reading.goals = [goal, goal]
    actions.read.return_value = reading
    panel._understood = MagicMock()
    query_form_markup = "app.nodes.console.panels.search.markup.understood"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(query_form_markup, lambda *_: "")
        patch.setattr("app.nodes.console.panels.search.replace", lambda goal, **_: goal)
        patch.setattr("app.nodes.console.panels.search.search_name", lambda goal: goal.object)
        one.search()
        other.search()
        assert actions.read.call_count == 2, "the other browser has seen no reading of its own"
        assert not actions.search.called
        other.search()
    assert actions.search.call_count == 2


def _reading(*goals, doubtful=False):
    return SentenceReading(
        goals=[Goal(display=goal["object"], **goal) for goal in goals], doubtful=doubtful,
        because="Cups, or maybe mugs?", unused=[], notes=[], language="", provider="rules",
        elapsed_ms=1.0,
    )  # fmt: skip


def _asking(panel, wanted, scenario):
    client = Client()
    panel.open_form(client, (wanted, "", scenario), lambda _: None)
    return client


def test_a_search_of_another_browser_changes_none_that_is_being_read(panel, actions):
    one = _asking(panel, "the keys and the hat, please", "a flat")
    other = _asking(panel, "mug", "an office")

    def read(_):
        other.search()
        one.search()
        return _reading({"object": "keys"}, {"object": "hat"})

    actions.read.side_effect = read
    one.search()
    actions.read.assert_called_once_with("the keys and the hat, please")
    mug, keys, hat = actions.search.call_args_list
    assert mug.args == ("mug", "", "an office")
    assert keys.args == ("keys", "", "a flat")
    assert hat.args == ("hat", "", "a flat")
    assert hat.kwargs["joins"] == 8, "the keys, not the mug"
    question = ("the keys and the hat, please", "", "a flat")
    assert panel._last._asked[question].goals == {8, 9}


def test_two_browsers_that_search_at_once_join_goals_of_their_own(panel, actions):
    one = _asking(panel, "the keys and the hat, please", "a flat")
    other = _asking(panel, "mug", "an office")
    actions.read.return_value = _reading({"object": "keys"}, {"object": "hat"})
    search = actions.search.side_effect

    def search_meanwhile(wanted, *args, **kwargs):
        started = search(wanted, *args, **kwargs)
        if wanted == "keys":
            other.search()
        return started

    actions.search.side_effect = search_meanwhile
    one.search()
    asked = [(call.args[0], call.kwargs["joins"]) for call in actions.search.call_args_list]
    assert asked == [("keys", None), ("mug", None), ("hat", 7)]


def test_a_doubtful_reading_outlives_the_search_of_another_browser(panel, actions):
    one = _asking(panel, "two cups, or maybe mugs", "a flat")
    other = _asking(panel, "hat", "an office")
    goal = {"object": "cup", "count": 2, "refers_to": "other"}
    actions.read.return_value = _reading(goal, doubtful=True)
    one.search()
    assert one.fields[ENGLISH("field.find")].value == "cup"
    other.search()
    one.search()
    hat, cup = actions.search.call_args_list
    assert hat.args[0] == "hat"
    assert cup.args == ("cup", "", "a flat")
    assert (cup.kwargs["count"], cup.kwargs["other"]) == (2, True)
    assert actions.read.call_count == 1


def test_a_doubtful_reading_is_shown_when_its_words_stand_in_the_fields(panel, actions):
    one = _asking(panel, "two cups, or maybe mugs", "a flat")
    seen = []

    class Shown:
        def __setattr__(self, name, text):
            seen.append((bool(text), one.fields[ENGLISH("field.find")].value))

    panel._understood = Shown()
    actions.read.return_value = _reading({"object": "cup", "count": 2}, doubtful=True)
    one.search()
    assert seen == [(False, "two cups, or maybe mugs"), (True, "cup")], "it may be corrected now"


def test_a_doubtful_reading_is_gone_once_its_words_are_changed(panel, actions):
    one = _asking(panel, "two cups, or maybe mugs", "a flat")
    actions.read.return_value = _reading({"object": "cup", "count": 2}, doubtful=True)
    one.search()
    one.type("field.find", "mug")
    one.search()
    one.type("field.find", "cup")
    one.search()
    assert [call.kwargs["count"] for call in actions.search.call_args_list] == [1, 1]
