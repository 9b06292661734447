"""The fields of a search, of which each browser has its own."""

from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from app.nodes.console.panels import query_form
from app.nodes.console.panels.search import SearchPanel
from app.view.words import ENGLISH


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
    actions.search.return_value = ""
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
