"""What the navigator says has a translation in each language, and text of any kind is safe."""

import json
import re
import string
import time
from pathlib import Path

import pytest
import yaml

from app.view.sayings import MOST_CHARACTERS, Sayings
from app.view.words import ENGLISH, SAID, Words
from ippon.guidance.language.goals.goal import unchecked
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.requests.sentence import read_request
from ippon.guidance.prior import EmbeddedPrior
from ippon.vocabulary import MATTERPORT_40
from tests.app.view.spoken_templates import reads_like_text, templates
from tests.locations import ROOT

SPEAKING = [
    *(ROOT / "app/nodes/navigator").rglob("*.py"),
    *(ROOT / "ippon/mission").rglob("*.py"),
    *(
        ROOT / name
        for name in (
            "app/links/language_model/chat.py",
            "app/links/language_model/language_model.py",
            "app/links/language_model/sentence_reading.py",
            "app/links/network/requests.py",
            "app/links/rmw_zenoh/robot_link.py",
            "app/links/robot_streams/assembler.py",
            "app/links/robot_streams/clock_watch.py",
            "app/links/robot_streams/depth_match.py",
            "app/memory/room_names.py",
            "app/memory/wording.py",
            "app/messages/plain_text.py",
            "app/nodes/recorder.py",
            "app/recording/notes.py",
            "app/recording/reading/bag_files.py",
            "app/recording/reading/file_index.py",
            "app/recording/reading/mcap_records.py",
            "app/recording/reading/recording.py",
            "app/recording/reading/stored_file.py",
            "app/recording/timeline.py",
            "app/recording/writing/limits.py",
            "ippon/control/safety_filter.py",
            "ippon/guidance/context_rating.py",
            "ippon/guidance/language/context.py",
            "ippon/guidance/language/naming.py",
            "ippon/guidance/language/goals/goal.py",
            "ippon/guidance/language/lists/same_objects.py",
            "ippon/guidance/language/requests/sentence.py",
            "ippon/guidance/levels.py",
            "ippon/guidance/prior.py",
            "ippon/guidance/prompts/picture_prompt.py",
            "ippon/guidance/rating.py",
            "ippon/mapping/integration.py",
            "ippon/memory/notes.py",
            "ippon/memory/registration.py",
            "ippon/rooms/named_rooms.py",
            "ippon/rooms/said_rooms.py",
            "ippon/tracking/camera_tracker.py",
            "ippon/tracking/start_pose.py",
            "ippon/tracking/upright.py",
        )
    ),
]
"""Modules of which every text may reach an operator, but for those in `UNSAID`."""
PARTLY = [
    ROOT / name
    for name in (
        "app/links/language_model/interface.py",
        "app/links/network/session.py",
        "app/memory/memory_file.py",
        "app/messages/images.py",
        "app/nodes/replay.py",
        "app/recording/reading/sqlite_file.py",
        "ippon/guidance/language/languages.py",
        "ippon/guidance/prompts/request_prompt.py",
    )
]
"""Modules of which some texts do, beside SQL, questions to a language model and errors of the
command line."""
UNSAID = {
    # Words that are compared with those of a request or of an error, not said.
    "not found",
    "of with without for in on at from that which who by near under next made",
    "toy plush stuffed", "camera jumped", "rigid transform", "camera at",
    # Pieces of templates, which join names.
    "the {}", " or the ", " and it is ", "(named by you)",
    # Names of threads, of a search that is repeated, of a model and of what is noted of a stream.
    "memory writer", "map writer", "state writer", "stream conversion", "command mux",
    "command stream", "pose tracking", "clock comparison", "robot link",
    "saved search {}", "goal {}", "{} at {}", "{} lost",
    # Errors of a caller inside the program, and of files at its start.
    "no proximity level {}; the levels are {}",
    "a tour takes 2 to {} goals of different numbers; got {}",
    "guidance speaks of {} labels, the map of {}, or in another order",
    "memory begins searches for one goal; {} belongs to a tour",
    "{} holds no goals: {}; remove it",
    (
        "{} stays as it is: no image came with its pose within {} s{}. With a navigator without "
        "--map and --align, `ippon doctor --robot {}` says what the robot sends"
    ),
    "what is missing: {}", "; {}",
    # Formats of the log, and a type.
    "%s: %s; the embedded prior answers", "%s: no answer to the reminder: %s", "dict[str, Any]",
    # What a server said.
    "HTTP {}",
}  # fmt: skip
"""Texts of those modules that reach no operator, or that are no language."""
ASKING = "A robot is asked to find the thing that this picture shows."
"""Begin of a question to a language model."""
LISTED = "big large huge", "small little tiny"
SAYS = re.compile(r"RequestRefusedError\(\s*f?[\"']|_journal\.note\(|report_event\(|Action\(.*why=")
"""What a module does that says something to the operator."""

GERMAN = Words("de")
TABLES = ROOT / "ippon/guidance/tables"
REQUESTS = ROOT / "tests/ippon/guidance/language/requests/sentences.yaml"
NAMES = set(yaml.safe_load((TABLES / "speech/languages.yaml").read_text()))
"""Names of languages, which are part of a sentence."""
SENTENCES = yaml.safe_load((Path(__file__).parent / "german.yaml").read_text())


def said():
    """Return the English templates by key."""
    table = json.loads((ROOT / "web_assets/words/en.json").read_text())
    return {key: text for key, text in table.items() if key.startswith(SAID)}


def shape(text):
    """Return a template with nameless fields."""
    return "".join(
        literal + ("" if name is None else "{}")
        for literal, name, _, _ in string.Formatter().parse(text)
    )


def _is_said(text):
    return reads_like_text(text) and text not in UNSAID and not text.startswith((ASKING, *LISTED))


def test_every_text_of_the_navigator_has_an_entry():
    shapes = {shape(text) for text in said().values()}
    assert shapes >= NAMES
    missing = [
        f"{path.relative_to(ROOT)}:{line}: {text}"
        for path in SPEAKING
        for line, text in templates(path)
        if _is_said(text) and text not in shapes
    ]
    assert missing == []


def test_every_entry_is_a_text_of_the_code():
    spoken = {text for path in [*SPEAKING, *PARTLY] for _, text in templates(path)}
    spoken |= NAMES
    assert {text for text in said().values() if shape(text) not in spoken} == set()


def test_every_exception_is_a_text_of_the_code():
    assert {text for path in SPEAKING for _, text in templates(path)} >= UNSAID


def test_modules_that_say_something_are_listed():
    known = {*SPEAKING, *PARTLY}
    saying = {
        path
        for folder in ("app", "ippon")
        for path in (ROOT / folder).rglob("*.py")
        if SAYS.search(path.read_text())
    }
    assert {str(path.relative_to(ROOT)) for path in saying - known} == set()


SAMPLES = {
    "text": "waiting for a goal",
    "by": "qwen",
    "parts": "waiting for a goal",
    "list": "gizmo, gadget",
    "labels": "gizmo, gadget",
    "either": "gizmo",
    "rooms": "gazebo",
    "level": "near",
    "mode": "manual",
    "outcome": "found",
}


@pytest.mark.parametrize("key", said())
def test_each_text_is_told_from_the_others(key):
    """With values filled in, no other template takes it."""
    fields = {name for _, name, _, _ in string.Formatter().parse(said()[key]) if name}
    values = {
        name: "7" if len(name) == 1 else SAMPLES.get(name.partition("_")[0], "gizmo")
        for name in fields
    }
    words = {
        "waiting for a goal": "wartet auf ein Ziel",
        "near": "nah",
        "manual": "Manuell",
        "found": "gefunden",
    }
    german = {name: words.get(value, value) for name, value in values.items()}
    text = said()[key].format(**values)
    assert GERMAN.said(text) == GERMAN(key, **german)
    assert GERMAN.sayings.covers(text)


@pytest.mark.parametrize("pair", SENTENCES, ids=lambda pair: pair["english"][:40])
def test_sentences_in_german(pair):
    assert GERMAN.said(pair["english"]) == pair["german"]


def test_what_is_not_known_is_shown_as_it_came():
    for text in ("", "something else", "camera/depth: a stamp of 3 s is not a time", "mug"):
        assert GERMAN.said(text) == text
        assert not GERMAN.sayings.covers(text)
    assert GERMAN.said("robot profile: all is odd") == "Roboterprofil: all is odd"
    assert not GERMAN.sayings.covers("robot profile: all is odd")


def test_names_that_look_like_fields_or_sentences_stay_as_they_are():
    assert GERMAN.said("searching for {object} {0}") == "sucht „{object} {0}“"
    assert GERMAN.said("searching for waiting for a goal") == "sucht „waiting for a goal“"


def test_english_is_what_came():
    for text in said().values():
        assert ENGLISH.said(text) == text


@pytest.mark.parametrize(
    "rubbish",
    [
        "a" * 100_000,
        ": " * 50_000,
        "; , : . and (" * 8_000,
        "going to the viewpoint (): gain , s away" * 2_500,
        "what seemed to be " * 6_000 + ": going on",
        "{}" * 50_000,
    ],
)
def test_no_text_takes_long(rubbish):
    text = rubbish[:MOST_CHARACTERS]
    begin = time.process_time()
    assert GERMAN.said(rubbish) == rubbish
    GERMAN.said(text)
    GERMAN.said(text[:300])
    assert time.process_time() - begin < 1.0, (
        "a bound of the work, some hundred times what it takes"
    )


def test_two_fields_need_a_literal_between_them():
    with pytest.raises(ValueError, match="two fields follow each other"):
        Sayings([("{a}{b} found", "{a}{b}")], GERMAN)


@pytest.mark.parametrize(
    "wanted", ["hat", "toilet paper", "wall", "coffee tabel", "flibbertigibbet"]
)
def test_levels_have_reasons_and_notes_in_german(wanted):
    contexts = ("", "I think it is on the sofa", "maybe in the kitchen", "not in Anna's bedroom")
    goal = resolve_object(wanted, MATTERPORT_40)
    for context in contexts:
        levels = EmbeddedPrior().levels(goal, context, MATTERPORT_40)
        texts = {levels.provider, *levels.notes, *(row.reason for row in levels.rows)}
        assert {text for text in texts if not GERMAN.sayings.covers(text)} == set()


def test_readings_of_sentences_have_notes_in_german():
    blocks = yaml.safe_load(REQUESTS.read_text())
    lines = [line for block in blocks.values() for line in block.splitlines()]
    texts = set()
    for line in lines:
        request = read_request(line.partition(" => ")[0])
        texts |= {request.because, *(note for goal in request.goals for note in unchecked(goal))}
    assert len(texts) > 50
    assert {text for text in texts - {""} if not GERMAN.sayings.covers(text)} == set()
