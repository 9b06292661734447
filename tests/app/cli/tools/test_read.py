import json

import pytest

from app.cli.main import run


@pytest.fixture(autouse=True)
def no_model(monkeypatch):
    for name in ("IPPON_LLM_MODEL", "IPPON_LLM_BASE_URL", "OPENAI_BASE_URL", "IPPON_API_KEY"):
        monkeypatch.delenv(name, raising=False)


def read(capsys, *arguments):
    status = run(["read", *arguments])
    return status, capsys.readouterr().out


def test_goals_as_json(capsys):
    status, out = read(capsys, "the red mug next to the sink, then two chairs", "--json")
    answer = json.loads(out)
    mug, chair = answer["goals"]
    assert status == 0
    assert (mug["object"], mug["display"]) == ("mug", "red mug")
    assert mug["attributes"] == [{"kind": "colour", "value": "red", "negated": False}]
    assert mug["relations"] == [
        {"relation": "next to", "place": "sink", "negated": False, "attributes": []}
    ]
    assert mug["context"] == "next to the sink"
    assert (chair["object"], chair["count"], chair["order"]) == ("chair", 2, "then")
    assert (answer["doubtful"], answer["because"], answer["provider"]) == (False, "", "rules")
    assert (
        "“next to sink” guides the search, but a find is not checked for it yet" in answer["notes"]
    )


def test_a_table_for_people(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    status, out = read(capsys, "all plates but not the blue ones, not in the kitchen")
    assert status == 0
    row = next(line for line in out.splitlines() if "plate" in line)
    assert [part.strip() for part in row.split("│")[1:-2]] == [
        "plate", "all", "not blue", "not in kitchen"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("sentence", "text"),
    [
        ("suche meinen Hut auf dem Sofa", "this looks like German"),
        ("suche meinen Hut auf dem Sofa", "--llm.model"),
        ("find it", "there was none"),
        ("😀", "there is no word in it"),
        ("x" * 10000, "longer than the name of an object"),
    ],
)
def test_without_an_object_the_reason_is_said(capsys, sentence, text):
    status, out = read(capsys, sentence)
    assert status in (0, 1)
    assert text in " ".join(out.split())


def test_another_language_has_no_object_and_status_1(capsys):
    status, out = read(capsys, "wo ist mein Hut", "--json")
    answer = json.loads(out)
    assert (status, answer["goals"], answer["language"]) == (1, [], "German")


def test_a_reference_to_the_request_before(capsys):
    status, out = read(capsys, "the other one", "--previous", "a red mug", "--json")
    (goal,) = json.loads(out)["goals"]
    assert (status, goal["object"], goal["refers_to"]) == (0, "mug", "other")


def test_nothing_is_refused(capsys):
    assert run(["read", " "]) == 2
    assert "no sentence given; for example" in capsys.readouterr().err


def test_a_model_that_does_not_answer_leaves_it_to_the_rules(capsys):
    arguments = ["--llm.model", "m", "--llm.base-url", "http://127.0.0.1:9/v1"]
    status, out = read(capsys, "my keys and my wallet", "--json", *arguments)
    answer = json.loads(out)
    assert status == 0
    assert [goal["object"] for goal in answer["goals"]] == ["keys", "wallet"]
    assert answer["provider"] == "rules"
    assert answer["note"]
