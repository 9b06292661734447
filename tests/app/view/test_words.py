"""The tables of words are complete, and page and panels take every text from them."""

import ast
import json
import re
import string
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from app.messages.status import GoalStatus
from app.view import words
from app.view.words import (
    ATTRIBUTE,
    ENGLISH,
    NAME,
    ROOM_TYPE,
    LanguageError,
    Words,
    languages,
)
from ippon.guidance.knowledge import load_knowledge
from ippon.mission.finds.attributes.colour_regions import colour_name, lab_of
from ippon.segmentation.detectors.coco import COCO_91, NO_CLASS
from ippon.simulation.homes.furniture.small_objects import SMALL_THINGS
from ippon.simulation.homes.generator import generate_home
from ippon.vocabulary import LABORATORY_40, MATTERPORT_40, canonical_label

ROOT = Path(__file__).parents[3]
ASSETS = ROOT / "web_assets"
CONSOLE = ROOT / "app/nodes/console"
SPOKEN = [
    *sorted((CONSOLE / "panels").glob("*.py")),
    *sorted((CONSOLE / "calls").glob("call*.py")),
    CONSOLE / "link/panel_requests.py",
    CONSOLE / "link/versions.py",
    CONSOLE / "fleet/goal_assignment.py",
    ROOT / "app/view/bid_wording.py",
    CONSOLE / "scene/click_explanation.py",
    CONSOLE / "web/permissions.py",
]
"""Modules whose texts are for people."""
SCRIPTS = sorted(ASSETS.glob("*.js"))
PAGES = sorted(ASSETS.glob("*.html"))

TABLES = {name: json.loads((ASSETS / f"words/{name}.json").read_text()) for name in languages()}
NAMES = {"IPPON", "ROS"}
NAMES_OF = (NAME, ROOM_TYPE, ATTRIBUTE)
"""Keys of which a language may lack some."""
NOT_SHOWN = {
    # What viser's client says, to be replaced.
    "Collapse panel", "Expand panel",
    # Names of keys, of the browser's own interfaces, and of our messages.
    "Escape", "Enter", "Space", "Comma", "Period", "Home", "Shift", "Meta", "Hz",
}  # fmt: skip


def fields(text):
    return {name for _, name, _, _ in string.Formatter().parse(text) if name is not None}


@pytest.mark.parametrize("language", languages())
def test_a_language_has_every_key_with_the_same_values(language):
    table = {key: text for key, text in TABLES[language].items() if not key.startswith(NAMES_OF)}
    english = [key for key in TABLES["en"] if not key.startswith(NAMES_OF)]
    assert list(table) == english, "the same keys in the same order"
    for key, text in table.items():
        assert fields(text) == fields(TABLES["en"][key]), key
        assert text.strip(), key


def test_there_are_english_and_german_and_the_error_names_them():
    assert {"de", "en"} <= set(languages())
    with pytest.raises(LanguageError, match="no words in 'tlh'; the languages are de, en"):
        Words("tlh")


def _labels():
    """Return every label that the project knows by itself."""
    knowledge = load_knowledge()
    homes = {one.label for seed in range(3) for one in generate_home(seed).instances}
    known = {entry.label for entry in knowledge.phrases.values()} | set(knowledge.things)
    shipped = {*MATTERPORT_40, *LABORATORY_40, *COCO_91, *SMALL_THINGS, *homes, *known}
    return {canonical_label(label) for label in shipped - {NO_CLASS}}


@pytest.mark.parametrize("language", ["de", "en"])
def test_every_label_type_of_room_and_colour_has_a_name(language):
    table = TABLES[language]
    rooms = load_knowledge().room_types
    keys = {f"{NAME}{label}" for label in _labels()} | {f"{ROOM_TYPE}{room}" for room in rooms}
    colours = np.stack(np.meshgrid(*[np.arange(0, 256, 51)] * 3), axis=-1).reshape(-1, 1, 3)
    seen = {colour_name(lab_of(one)) for one in colours.astype(np.uint8)} - {""}
    assert len(seen) > 8
    keys |= {f"{ATTRIBUTE}{value}" for value in {*seen, "large", "small"}}
    assert keys - set(table) == set()
    assert {key for key in table if key.startswith(ROOM_TYPE)} <= keys
    if language == "en":
        named = {key: text for key, text in table.items() if key.startswith(NAMES_OF)}
        assert named == {key: key.partition(".")[2].replace("_", " ") for key in named}


def test_a_label_is_called_by_its_name_and_other_words_stay_as_they_are():
    german = Words("de")
    assert [german.name(text) for text in ("chest_of_drawers", "dining table", "plants")] == [
        "Kommode", "Esstisch", "Pflanze",
    ]  # fmt: skip
    for text in ("Anna's mug", "red mug", "floom"):
        assert german.name(text) == text
    assert (german.room("laundry"), german.name("laundry")) == ("Waschküche", "Wäsche")
    assert german.room("Anna's room") == "Anna's room"
    assert (german.attribute("red"), german.attribute("broken")) == ("rot", "broken")
    assert ENGLISH.name("chest_of_drawers") == "chest of drawers"
    assert ENGLISH.name("Hat") == "Hat"
    goals = [
        GoalStatus(goal_id=1, object="tv"),
        GoalStatus(goal_id=2, object="tv", display="telly"),
    ]
    assert [german.goal(goal) for goal in goals] == ["Fernseher", "telly"]


def test_labels_of_one_name_are_told_apart_in_a_list():
    choices = Words("de").choices(["sink", "washbasin", "mirror", "coat_rack", "gizmo"])
    assert choices == {
        "Garderobe": "coat_rack",
        "gizmo": "gizmo",
        "Spiegel": "mirror",
        "Waschbecken (sink)": "sink",
        "Waschbecken (washbasin)": "washbasin",
    }
    assert list(choices)[:2] == ["Garderobe", "gizmo"]


def test_a_language_without_names_shows_the_labels(monkeypatch):
    bare = {key: text for key, text in TABLES["de"].items() if not key.startswith(NAMES_OF)}
    monkeypatch.setattr(
        words, "_table", lambda language: bare if language == "fr" else TABLES["en"]
    )
    french = Words("fr")
    assert french.name("dining_table") == "dining table"
    assert french.said("searching for plants") == "sucht „plants“"


def test_numbers_are_written_as_the_language_does():
    german = Words("de")
    assert ENGLISH.number(2.46, 1) == "2.5"
    assert german.number(2.46, 1) == "2,5"
    assert german.percent(0.41) == "41\u00a0%"
    assert german.count("goals.rejected", 1) == "1 Fund verworfen"


def test_a_page_carries_its_language_and_its_table_and_no_markup_of_it():
    page = Words("de").page('<html lang="{{language}}"><b title="{{page.help.hint}}">{{words}}')
    assert page.startswith('<html lang="de"><b title="Hilfe (?)">{"language": "de"')
    assert '"name.sofa": "Sofa"' in page
    assert '"name.knives": "Messer"' in page
    assert "name.sofas" not in page, "the scripts know this ending"
    assert "name.sofa" not in ENGLISH.page("{{words}}"), "the label is its name"
    assert "panel." not in page
    assert "said." not in page
    assert "<" not in page.split(">", 2)[2]


def _used():
    """Return the keys that are named in code and pages, and the beginnings of composed ones."""
    named, begun = set(), set()
    for path in [*SCRIPTS, *PAGES, *(ROOT / "app").rglob("*.py")]:
        text = path.read_text()
        marks = re.findall(r"\{\{([a-z_.]+)\}\}", text)
        quoted = re.findall(r"""["'`]([a-z_]+(?:\.[a-z_]+)+)["'`]""", text)
        named |= {key for key in [*marks, *quoted] if key in TABLES["en"]}
        begun |= set(re.findall(r"""["'`]([a-z_.]+\.)\$?\{""", text))
    return named, begun


def test_a_page_without_its_console_names_another_way_to_stop():
    for say in (ENGLISH, Words("de")):
        assert "ippon control stop" in say("veil.disconnected.hint")


@pytest.mark.parametrize("language", languages())
def test_every_button_that_resumes_has_the_name_that_texts_call_it(language):
    table = TABLES[language]
    resume = table["page.resume"]
    assert table["panel.search.resume"] == resume
    for key in (
        "notice.stopped.text",
        "notice.paused.text",
        "said.drive.drives_there_after_resume",
        "said.stream.stopped_press_resume_to",
    ):
        assert resume in table[key], key


def test_every_key_is_used():
    named, begun = _used()
    begun |= {"reply.looking", *(f"{key}." for key in ("calls.permission", "webhook"))}
    begun |= {"said.", *NAMES_OF}  # See test_sayings, and the labels above.
    left = {
        key
        for key in TABLES["en"]
        if key not in named and key.rpartition(".")[0] not in {k.rstrip(".") for k in begun}
    }
    left = {key for key in left if not key.endswith((".one", ".other", ".text", ".hint"))}
    left = {key for key in left if not any(key.startswith(start) for start in begun)}
    assert left == set()


def test_every_key_that_is_named_is_in_the_table():
    for path in [*SCRIPTS, *PAGES, *SPOKEN]:
        text = path.read_text()
        asked = re.findall(r"""\b(?:say|_words|words)\(\s*["']([a-z_.]+)["']""", text)
        asked += re.findall(r"\{\{([a-z_.]+)\}\}", text)
        unknown = {key for key in asked if key not in TABLES["en"]} - {"language", "words"}
        unknown = {key for key in unknown if f"{key}.other" not in TABLES["en"]}
        assert unknown == set(), path.name


class _Texts(HTMLParser):
    """Texts and attributes of a page that a person may see or hear."""

    def __init__(self):
        super().__init__()
        self.texts = []
        self._tag = ""

    def handle_starttag(self, tag, attrs):
        self._tag = tag
        shown = ("title", "aria-label", "placeholder", "alt")
        self.texts += [value for name, value in attrs if name in shown and value]

    def handle_data(self, data):
        if self._tag not in ("script", "style", "kbd"):
            self.texts.append(data)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_a_page_has_no_text_of_its_own(path):
    page = _Texts()
    page.feed(path.read_text())
    own = [re.sub(r"\{+\w[\w.]*\}+", "", text).strip() for text in page.texts]
    assert [text for text in own if re.search(r"[A-Za-z]{2}", text) and text not in NAMES] == []


def _reads_like_text(literal):
    """Whether a literal looks like words for a person: two words, or one with a capital letter."""
    plain = re.sub(r"\$?\{[^{}]*\}", "", literal)
    plain = re.sub(r"<code>.*?</code>|<[^<>]*>|^[^<]*>|<[^>]*$", " ", plain).strip()
    return plain not in NOT_SHOWN and bool(
        re.search(r"[A-Za-z]{3,}[,:;]? [a-zA-Z]{2,}", plain) or re.fullmatch(r"[A-Z][a-z]+", plain)
    )


CODE = re.compile(
    r"(?:querySelector(?:All)?|closest|matchMedia|ask|make|font|Error|[sS]tyle|Message)\b.*"
)
"""Parts of lines whose literals are selectors, styles and names of classes."""


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_a_script_has_no_text_of_its_own(path):
    lines = (re.sub(r"(^| )//.*", "", line) for line in path.read_text().splitlines())
    shown = "\n".join(CODE.sub("", line) for line in lines)
    literals = ["".join(found) for found in re.findall(r'"([^"\n]*)"|`([^`\n]*)`', shown)]
    assert [text for text in literals if _reads_like_text(text)] == []


@pytest.mark.parametrize("path", SPOKEN, ids=lambda path: path.stem)
def test_a_panel_has_no_text_of_its_own(path):
    tree = ast.parse(path.read_text())
    docs = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    own = [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and id(node) not in docs
        and _reads_like_text(node.value)
    ]
    assert [text for text in own if not text.startswith("call %d")] == []
