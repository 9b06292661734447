"""Levels and labels, with a stand-in for the model and a real map."""

from types import SimpleNamespace

import numpy as np
import pytest

from app.links.network.requests import RequestRefusedError
from app.messages.control import (
    GuidanceRequest,
    PreviewRequest,
    SearchRequest,
    VocabularyRequest,
)
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.preview_service import PreviewService
from app.nodes.navigator.status_report import level_table
from ippon.guidance.levels import Level
from ippon.guidance.prior import PROVIDER, EmbeddedPrior
from ippon.mission.inspection import Preview
from ippon.rooms.named_rooms import RoomName
from ippon.vocabulary import MATTERPORT_40
from tests.app.memory.test_memory_file import thing
from tests.app.nodes.navigator.conftest import MODEL, Model, levels, run_next, search


def test_navigation_starts_on_the_prior_and_swaps_when_the_answer_comes(open_office):
    office = open_office(Model())
    search(office)
    assert levels(office)["sofa"] is Level.CERTAIN
    (note,) = office.guidance.notes()
    assert note == f"asking {MODEL}; using the embedded prior until then"
    table = level_table(office.goals.active())
    assert (table.provider, table.asking, table.prompt) == (PROVIDER, MODEL, "")
    revision = office.mission.voxel_map.revision
    office.model.may_answer.release()
    run_next(office)
    assert set(levels(office).values()) == {Level.NEAR}
    assert office.mission.voxel_map.revision > revision
    table = level_table(office.goals.active())
    assert (table.provider, table.asking, table.elapsed_ms) == (MODEL, "", 1234.0)
    assert (table.prompt, table.reply) == ("the question", "the answer")
    assert office.events == [("guidance", f"levels of {MODEL} after 1234 ms")]
    assert office.guidance.notes() == ()


def test_the_model_hears_what_the_operator_said(open_office):
    office = open_office(Model())
    search(office, "my red hat", "on the sofa")
    asked = office.model.asked.get(timeout=120.0)
    assert asked == (
        "red hat",
        "on the sofa",
        MATTERPORT_40,
        "an apartment with different rooms",
    )


def test_a_model_that_fails_is_told_of(open_office):
    office = open_office(Model())
    office.model.failed = "HTTP 500"
    search(office)
    office.model.may_answer.release()
    run_next(office)
    assert office.guidance.notes() == ("no answer of the language model: HTTP 500",)
    assert office.events[0][1].endswith("the embedded prior answered instead")
    assert level_table(office.goals.active()).provider == PROVIDER


def test_without_the_model_the_names_of_rooms_stay_known(open_office):
    office, context = open_office(Model()), "in Anna's bedroom"
    office.guidance.room_names = lambda: (RoomName(x_m=0.0, y_m=0.0, name="Anna's bedroom"),)
    office.model.failed = "HTTP 500"
    search(office, "scarf", context)
    office.guidance.set_level(GuidanceRequest(label="bed", level="far"))
    run_next(office)
    before = office.goals.active().guidance
    assert before.notes == ()
    assert (
        before.levels().tolist()
        != EmbeddedPrior().levels("scarf", context, MATTERPORT_40).levels().tolist()
    )
    office.model.may_answer.release()
    run_next(office)
    after = office.goals.active().guidance
    assert after.rows == before.rows
    assert after.notes == (f"{MODEL}: HTTP 500; the embedded prior answered instead",)


def test_what_the_model_said_before_it_failed_stays_and_is_said_to(open_office):
    office = open_office(Model())
    search(office)
    office.model.may_answer.release()
    run_next(office)
    before = level_table(office.goals.active())
    office.model.failed = "HTTP 500"
    office.guidance.consult(office.goals.active().goal.goal_id)
    office.model.may_answer.release()
    run_next(office)
    after = level_table(office.goals.active())
    assert (after.provider, after.rows, after.reply) == (MODEL, before.rows, before.reply)
    note = f"{MODEL}: HTTP 500; its levels from before stay"
    assert office.goals.active().guidance.notes == (note,)
    assert office.events[-1] == ("guidance", note)


@pytest.mark.parametrize("by", ["label", "preview"])
def test_later_levels_of_the_prior_know_the_names_of_rooms_too(open_office, by):
    office, context = open_office(), "in Anna's bedroom"
    names = (RoomName(x_m=0.0, y_m=0.0, name="Anna's bedroom"),)
    office.guidance.room_names = lambda: names
    search(office, "scarf", context)
    if by == "label":
        office.guidance.add_label(VocabularyRequest(label="wardrobe"))
        run_next(office)
        row = office.goals.active().guidance.rows[-1]
        alone, known = (
            EmbeddedPrior().levels("scarf", context, ("wardrobe",), rooms).rows[0]
            for rooms in ((), ("anna's bedroom",))
        )
        assert alone.level is not known.level
        assert row == known
        return
    found = Preview(now="a", then="b", before=None, after=None)
    preview = PreviewService(office.goals, SimpleNamespace(ask=lambda *_: found))
    assert preview.preview(PreviewRequest(context=context)).changed != []
    preview.room_names = lambda: names
    assert preview.preview(PreviewRequest(context=context)).changed == []


def test_another_context_changes_only_what_it_says_of_the_levels(open_office):
    office = open_office(Model())
    search(office, "hat", "on the sofa")
    office.guidance.set_level(GuidanceRequest(label="bed", level="certain"))
    run_next(office)
    office.model.may_answer.release()
    run_next(office)
    found = Preview(now="a", then="b", before=None, after=None)
    preview = PreviewService(office.goals, SimpleNamespace(ask=lambda *_: found))
    assert preview.preview(PreviewRequest(context="on the sofa")).changed == []
    changed = preview.preview(PreviewRequest(context="on the bed")).changed
    assert "bed: certain to certain" not in changed
    assert not any(one.startswith("bed:") for one in changed), "the operator set it"
    assert "sofa: near to average" in changed


def test_another_context_is_about_the_kind_of_a_thing_with_a_name(open_office):
    office = open_office()
    orders = GoalService(office.goals, office.guidance, stop_latch=None, operations=None)
    orders.things = lambda: (thing(7, label="mug", name="Rosie"),)
    office.goals.add(orders.plan(SearchRequest(object="Rosie", context="on the sofa")))
    office.goals.next()
    found = Preview(now="a", then="b", before=None, after=None)
    preview = PreviewService(office.goals, SimpleNamespace(ask=lambda *_: found))
    assert preview.preview(PreviewRequest(context="on the sofa")).changed == []


def test_a_tour_has_no_preview_and_says_so(open_office):
    office = open_office()
    for n, name in enumerate(("hat", "mug")):
        planned = office.guidance.plan(SearchRequest(object=name), 0.0)
        office.goals.add(planned, joins=1 if n else None)
    office.goals.next()
    preview = PreviewService(office.goals, SimpleNamespace(ask=lambda *_: None))
    with pytest.raises(RequestRefusedError, match="in a search for several objects"):
        preview.preview(PreviewRequest(context="on the sofa"))


def test_an_answer_for_a_goal_that_is_over_is_dropped(open_office):
    office = open_office(Model())
    search(office, "hat")
    office.goals.conclude("cancelled")
    office.mission.goals.cancel_goal()
    search(office, "toilet", "")
    before = office.goals.active().guidance
    office.model.asked.get(timeout=120.0)
    office.model.may_answer.release()
    run_next(office)
    assert office.goals.active().guidance is before
    assert office.events == []


def test_a_goal_that_waits_gets_its_answer_too(open_office):
    office = open_office(Model())
    search(office, "hat")
    search(office, "mug", start=False)
    office.model.may_answer.release(2)
    run_next(office)
    run_next(office)
    office.goals.conclude("found")
    waiting = office.guidance.fitted(office.goals.next()[0])
    assert waiting.guidance.provider == MODEL
    # What is not searched for yet is no news.
    assert len(office.events) == 1


def test_what_the_operator_sets_wins_over_later_answers(open_office):
    office = open_office(Model())
    with pytest.raises(RequestRefusedError, match="there is no goal"):
        office.guidance.set_level(GuidanceRequest(label="bed", level="certain"))
    search(office)
    with pytest.raises(
        RequestRefusedError, match="unknown common object 'spaceship'; there are wall"
    ):
        office.guidance.set_level(GuidanceRequest(label="spaceship", level="certain"))
    for label, level in (("chest of drawers", "far"), ("bed", "near"), ("bed", "far")):
        office.guidance.set_level(GuidanceRequest(label=label, level=level))
        run_next(office)
    assert levels(office)["bed"] is Level.FAR
    assert office.events[-1] == ("level_changed", "bed is far: set by the operator")
    office.model.may_answer.release()
    run_next(office)
    rows = {row.label: row for row in office.goals.active().guidance.rows}
    assert (rows["bed"].level, rows["bed"].reason) == (Level.FAR, "set by the operator")
    assert rows["chest_of_drawers"].level is Level.FAR
    assert rows["sofa"].level is Level.NEAR
    index = MATTERPORT_40.index("bed")
    assert office.mission.voxel_map._layers.levels[index] == Level.FAR


def test_a_level_for_a_goal_that_is_over_changes_nothing(open_office):
    office = open_office()
    search(office)
    office.guidance.set_level(GuidanceRequest(label="bed", level="certain"))
    office.goals.conclude("found")
    search(office, "mug")
    before = office.goals.active().guidance
    run_next(office)
    assert office.goals.active().guidance is before


def test_each_goal_of_a_tour_gets_its_own_answer(open_office):
    office = open_office(Model())
    for n, name in enumerate(("hat", "mug")):
        planned = office.guidance.plan(SearchRequest(object=name), 0.0)
        place = office.goals.add(planned, joins=1 if n else None)
        office.guidance.consult(place.goal_id)
    tour = [office.guidance.fitted(one) for one in office.goals.next()]
    office.mission.goals.set_goals([(one.goal, one.guidance) for one in tour])
    before = [one.guidance for one in office.mission.goals.tour.searches]
    office.model.may_answer.release()
    run_next(office)
    after = [one.guidance for one in office.mission.goals.tour.searches]
    assert [a is b for a, b in zip(before, after, strict=True)].count(False) == 1
    office.model.may_answer.release()
    run_next(office)
    ends = [one.guidance for one in office.mission.goals.tour.searches]
    assert [guidance.ooi for guidance in ends] == ["hat", "mug"]
    assert {row.level for guidance in ends for row in guidance.rows} == {Level.NEAR}


def test_closing_ends_the_model(open_office):
    office = open_office(Model())
    search(office)
    office.guidance.close()
    assert office.model.closed


def test_fitting_keeps_answers_and_edits(open_office):
    office = open_office()
    search(office, "hat", "")
    office.guidance.set_level(GuidanceRequest(label="bed", level="certain"))
    run_next(office)
    before = office.goals.active()
    office.guidance.add_label(VocabularyRequest(label="bookcase"))
    run_next(office)
    after = office.goals.active().guidance
    assert after.rows[:40] == before.guidance.rows
    alone = EmbeddedPrior().levels("hat", "", (*MATTERPORT_40, "bookcase"))
    assert after.rows[40].level is alone.rows[40].level
    assert np.array_equal(after.levels(), office.mission.voxel_map._layers.levels)
