import re
from dataclasses import replace
from urllib.parse import urljoin

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.links.language_model.interface import RULES, SentenceAnswer
from app.links.language_model.sentence_reading import as_reading
from app.messages.status import (
    Event,
    FindReport,
    GoalStatus,
    LevelRow,
    LevelTable,
    StreamStatus,
)
from app.nodes.console.fleet.robot_paths import path_of
from app.nodes.console.panels import markup
from app.nodes.console.panels.find_markup import (
    candidate,
    counted_find,
    counted_head,
    find_card,
    not_found,
)
from app.view.colors import COLOR_MODES, legend, tree_legend
from app.view.model.candidates import Candidate
from app.view.model.picture_store import StoredPicture
from app.view.model.voxel_pictures import VoxelPicture
from app.view.words import ENGLISH, Words
from ippon.camera import PinholeCamera
from ippon.guidance.language.goals.goal import Attribute, Goal, Relation, Request
from ippon.guidance.language.requests.sentence import read_request


def test_exports_are_those_of_the_robot_whose_page_it_is():
    for base in ("/", path_of("site/b")):
        page = f"http://robot{base}view/?darkMode"
        links = re.findall(r'href="([^"]+)"', markup.exports(ENGLISH))
        assert [urljoin(page, link) for link in links] == [
            f"http://robot{base}api/export/{name}"
            for name in ("map.ply", "trail.csv", "figures.csv")
        ]


ATTACKS = [
    "<img src=x onerror=alert(1)>",
    '"><script>alert(1)</script>',
    "' onmouseover='alert(1)",
    "</table></div><svg onload=alert(1)>",
    "javascript:alert(1)",
    "a\x00b\x1b[31mc\u202egnp.exe",
]

# What our own code writes; everything else in the output must be text.
OWN_TAGS = {
    "div", "p", "b", "span", "table", "tr", "td", "th", "thead", "tbody", "i", "ul", "ol", "li",
    "dl", "dt", "dd", "time", "br",
}  # fmt: skip


PLACE = Candidate(point_world=(2.4, 5.2, 0.6), probability=0.41, label=2, picture=None)


def _assert_harmless(html):
    assert set(re.findall(r"<\s*/?\s*([a-zA-Z0-9]+)", html)) <= OWN_TAGS
    for attributes in re.findall(r"<[a-z]+([^>]*)>", html):
        names = re.findall(r'([a-z-]+)="[^"]*"', attributes)
        assert set(names) <= {"class", "style", "data-state", "data-late", "data-kind", "data-mode"}
        assert re.sub(r'\s*[a-z-]+="[^"]*"', "", attributes).strip() == ""
    assert not re.search(r"[\x00-\x1f\u202a-\u202e]", html)


@pytest.mark.parametrize("text", ATTACKS)
def test_no_text_from_outside_becomes_markup(text, stage):
    goal = GoalStatus(goal_id=1, object=text, context=text)
    table = LevelTable(
        goal_id=1,
        object=text,
        context=text,
        provider=text,
        elapsed_ms=1.0,
        rows=[LevelRow(label=text, level="near", reason=text)],
        notes=[text],
        asking=text,
        prompt=f"{text}\n{text}",
        reply=text,
    )
    find = FindReport(
        goal_id=1, object=text, position_world=(0.0, 0.0, 0.0), size_m=(1.0, 1.0, 1.0),
        probability=1.0, voxels=1,
    )  # fmt: skip
    status = stage.status_of(why=text, goal=goal, robot=text)
    for html in (
        markup.now(status, ENGLISH),
        markup.answer(text, ok=False),
        markup.goals([goal], [goal], ENGLISH),
        find_card(find, ENGLISH, name=find.object),
        counted_head([text], 3, ENGLISH),
        counted_find(text, (1.0, 2.0, 0.5), ENGLISH),
        markup.levels(table, ENGLISH),
        markup.reasons(table, ENGLISH),
        markup.conversation(table, ENGLISH),
        markup.warnings([text]),
        markup.figures(status, 3, ENGLISH),
        markup.streams([StreamStatus(name=text, age_s=None, rate_hz=0.0)], ENGLISH),
        not_found(text, 3, ENGLISH),
        candidate(1, PLACE, None, text, 0, ENGLISH),
        markup.event_log([Event(stamp_ns=1, kind="error", text=text)], 0, ENGLISH),
    ):
        _assert_harmless(html)


def test_what_was_understood_is_shown_with_what_is_not_used():
    said = "the red mug next to the white sink, not in the kitchen, then two chairs for the quokka"
    answer = SentenceAnswer(read_request(said), RULES, "", "", "no answer within 8 s")
    html = markup.understood(as_reading(answer, 1.0), ENGLISH)
    _assert_harmless(html)
    text = re.sub(r"<[^>]+>", " ", html)
    words = " ".join(text.split())
    assert words.startswith("Look for mug red next to white sink not in kitchen then chair × 2")
    assert "“next to white sink” guides the search" in words
    assert "Read by rules: no answer within 8 s" in words


@pytest.mark.parametrize(
    ("language", "chips"),
    [("en", ["mug", "all", "red", "not large"]), ("de", ["Becher", "alle", "rot", "nicht groß"])],
)
def test_what_was_understood_is_said_in_the_language_of_the_page(language, chips):
    attributes = (
        Attribute(kind="colour", value="red"),
        Attribute(kind="size", value="large", negated=True),
    )
    goal = Goal(object="mug", display="mug", count="all", attributes=attributes)
    answer = SentenceAnswer(Request(goals=(goal,), doubtful=False), RULES, "", "", "")
    html = markup.understood(as_reading(answer, 1.0), Words(language))
    assert re.findall(r'"ip-chip">([^<]+)<', html) == chips


def test_what_was_not_understood_is_said_once():
    because = "“At night” was not understood"
    goals = (Goal(object="cup", display="cup"),)
    request = Request(goals=goals, doubtful=True, because=because, unused=("at night",))
    answer = SentenceAnswer(request, RULES, "", "", "")
    assert markup.understood(as_reading(answer, 1.0), ENGLISH).count("not understood") == 1


@pytest.mark.parametrize("text", ATTACKS)
def test_no_text_of_a_sentence_becomes_markup(text):
    goal = Goal(
        object=text,
        display=text,
        attributes=(Attribute(kind="other", value=text),),
        relations=(Relation(relation=text, place=text),),
    )
    goals = tuple(replace(goal, context=f"at {n}") for n in range(9))
    request = Request(goals=goals, doubtful=True, because=text, unused=(text,))
    html = markup.understood(as_reading(SentenceAnswer(request, text, "", "", text), 1.0), ENGLISH)
    _assert_harmless(html)
    assert "and 1 more" in html


@given(st.text(max_size=900))
def test_escape_is_short_printable_and_without_markup(text):
    safe = markup.escape(text)
    assert not set(safe) & {"<", ">", '"', "'"}
    assert all(c.isprintable() for c in safe)


def test_levels_stand_in_the_order_of_nearness(stage):
    html = markup.levels(stage.proximity_of(), ENGLISH)
    places = [html.index(f"</i>{name}<") for name in ("certain", "near", "average", "far")]
    assert places == sorted(places)
    assert "embedded common sense" in html
    assert "bed, plant" in html


@pytest.mark.parametrize("mode", COLOR_MODES)
def test_every_mode_has_a_legend(mode):
    html = markup.legend(legend(mode, 2.0, ENGLISH))
    _assert_harmless(html)
    assert "ip-title" in html


def test_the_tree_legend_names_the_colours_of_the_paper():
    html = markup.legend(tree_legend(ENGLISH))
    assert "#ffffff" in html
    assert "ends the search" in html


def test_late_streams_stand_out():
    fresh = StreamStatus(name="a", age_s=0.1, rate_hz=5.0)
    late = StreamStatus(name="b", age_s=3.0, rate_hz=0.0, dropped=2)
    html = markup.streams([fresh, late], ENGLISH)
    assert 'data-late="0"><th>a' in html
    assert 'data-late="1"><th>b' in html


def test_what_is_wrong_is_said_line_by_line():
    html = markup.warnings(["no heatmap", "robot profile: <0.6 m"])
    assert html.count("ip-warning") == 2
    assert ">No heatmap<" in html
    assert "&lt;0.6 m" in html
    assert markup.warnings([]) == ""


def test_nothing_yet_is_said_in_words():
    assert "No data from the navigator yet" in markup.now(None, ENGLISH)
    assert "Start a search to see" in markup.levels(None, ENGLISH)
    assert markup.answer("", ok=True) == ""
    assert markup.goals([], [], ENGLISH) == ""


def test_goals_of_a_recording_are_not_offered_to_be_changed():
    goal = GoalStatus(goal_id=1, object="hat", outcome="cancelled")
    hint = markup.escape(ENGLISH("panel.goals.hint"))
    assert hint in markup.goals([], [goal], ENGLISH)
    assert hint not in markup.goals([], [goal], ENGLISH, recorded=True)


def test_a_find_that_no_way_leads_to_says_so(stage):
    goal = GoalStatus(goal_id=1, object="hat", outcome="out_of_reach")
    find = FindReport(
        goal_id=1, object="hat", position_world=(1.0, 2.0, 0.5), size_m=(0.3, 0.3, 0.2),
        probability=0.97, voxels=14, out_of_reach_m=1.4,
    )  # fmt: skip
    status = stage.status_of(state="found", goal=goal, find=find)
    assert "Found, out of reach: <b>hat</b>" in markup.now(status, ENGLISH)
    near = msgspec.structs.replace(find, out_of_reach_m=None)
    assert "Found: <b>hat</b>" in markup.now(
        stage.status_of(state="found", goal=goal, find=near), ENGLISH
    )
    assert "<span>out of reach, not confirmed</span>" in markup.goals([], [goal], ENGLISH)
    judged = msgspec.structs.replace(goal, confirmed=True)
    assert "<span>out of reach, confirmed</span>" in markup.goals([], [judged], ENGLISH)


def test_a_place_says_how_likely_where_when_and_what_else_it_may_be():
    picture = StoredPicture(
        number=1,
        stamp_ns=52_000_000_000,
        encoded=b"",
        camera=PinholeCamera.from_horizontal_fov(400, 250, 1.29),
        T_world_camera=np.eye(4),
    )
    seen = replace(PLACE, picture=VoxelPicture(picture=picture, u=5, v=5, depth_m=1.84))
    html = candidate(2, seen, b"jpeg", "coffee_table", 10_000_000_000, ENGLISH)
    for said in ("41% by the map", "most images show: coffee table", "at (2.4, 5.2) m, z = 0.6 m"):
        assert said in html
    assert "seen at 0:42 from 1.8 m" in html
    assert "data:image/jpeg;base64,anBlZw==" in html
    assert "before this search" in candidate(2, seen, b"jpeg", "", 60_000_000_000, ENGLISH)
    assert candidate(1, PLACE, None, "", 0, ENGLISH).count("no image") == 1, "said once"
