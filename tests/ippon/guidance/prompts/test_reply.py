"""What is taken from a reply: the answer after the model's thoughts, and its first JSON object."""

import json

import pytest

from ippon.guidance.prompts.label_prompt import parse_scene_reply
from ippon.guidance.prompts.opinion_prompt import MAX_REPLY, parse_opinion_reply
from ippon.guidance.prompts.picture_prompt import parse_picture_reply
from ippon.guidance.prompts.reply import answer_of, object_in
from ippon.guidance.prompts.request_prompt import parse_request_reply

DOUBT = "It may be {a bowl}, or so. " * MAX_REPLY
THOUGHTS = (
    f'<think>{DOUBT} {{"answer": "no", "name": "bowl", "sure": false}}</think>\n\n',
    f'{DOUBT} {{"answer": "no", "name": "bowl", "sure": false}}</think>\n\n',
    f"<thinking>{DOUBT}</thinking>",
)


@pytest.mark.parametrize("thought", THOUGHTS)
def test_thoughts_are_no_answer(thought):
    assert parse_opinion_reply(f'{thought}{{"answer": "yes"}}') == ("yes", "")
    assert parse_opinion_reply(f"{thought}yes") == ("yes", "")
    (goal,) = parse_picture_reply(f'{thought}{{"name": "red mug", "sure": true}}').goals
    assert goal.display == "red mug"
    request = parse_request_reply(f'{thought}{{"goals": [{{"object": "mug"}}]}}', "find my mug")
    assert [one.object for one in request.goals] == ["mug"]
    assert parse_scene_reply(f'{thought}{{"things": ["desk"]}}', ("bed",)) == ("desk",)


def test_a_reply_that_ends_in_its_thoughts_holds_no_answer():
    thought = '<think>{"answer": "yes"} would be too soon'
    assert answer_of(thought).strip() == ""
    assert parse_opinion_reply(thought) is None


def test_the_first_object_of_an_answer():
    assert object_in('Here it is: {"a": {"b": 1}} {"a": 2}') == {"a": {"b": 1}}
    for answer in ("", "no", "[1]", '{"a": ', "{" * 5000, '{"a": ' + "9" * 5000 + "}"):
        assert object_in(answer) is None
    assert object_in(json.dumps({"a": "}"})) == {"a": "}"}
