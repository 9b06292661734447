"""The words of the console in one language: a table by key in `web_assets/words/`.

Keys that begin with `said.` are the sentences of the navigator: in the English table as the code
has them, with names for the values (see `Sayings`). Those that begin with `name.` and `room_type.`
are what people call a label and a type of room, which are English everywhere else: only what is
shown is translated. A further language is one more file there, named by its tag (BCP 47); what it
has no name for is shown in English.
"""

import functools
import html
import json
import re
from collections import Counter
from collections.abc import Iterable
from importlib import resources
from typing import Final

from app.errors import UsageError
from app.messages.status import GoalStatus, name_of
from app.view.sayings import Sayings
from ippon.guidance.language.words import generic
from ippon.vocabulary import canonical_label, in_words

SAID: Final = "said."
"""Keys of the texts that come from the navigator."""
NAME: Final = "name."
"""Keys of the names of labels."""
ROOM_TYPE: Final = "room_type."
ATTRIBUTE: Final = "attribute."
_MARK: Final = re.compile(r"\{\{([\w.]+)\}\}")


class LanguageError(UsageError):
    """There is no table of a language; the text lists those that there are."""


class Words:
    """The words of one language.

    Args:
        language: Tag of the language, such as "en".

    Raises:
        LanguageError: There is no such table.
    """

    def __init__(self, language: str) -> None:
        self.language = language
        self._table = _table(language)
        # In English a label is its own name, and what an operator has typed stays as it is.
        is_named = language != "en"
        self._names = self._table if is_named else {}
        self._plurals = _plurals(self._table) if is_named else {}
        pairs = (
            (text, self._table[key]) for key, text in _table("en").items() if key.startswith(SAID)
        )
        self.sayings: Final = Sayings(pairs if language != "en" else (), self)

    def __call__(self, key: str, /, **values: object) -> str:
        """Return the text of a key with its values filled in."""
        return self._table[key].format(**values)

    def knows(self, key: str) -> bool:
        """Return whether there is a text of a key."""
        return key in self._table

    def said(self, text: str) -> str:
        """Return what the navigator says, which is English; a text that is not known as it came."""
        return self.sayings(text)

    def count(self, key: str, n: int, /, **values: object) -> str:
        """Return the text for one or for several."""
        return self(f"{key}.{'one' if n == 1 else 'other'}", n=n, **values)

    def name(self, label: str) -> str:
        """Return what people call a label; a text that is none that is known as it came."""
        key = canonical_label(label)
        return self._names.get(NAME + self._plurals.get(key, key), in_words(label))

    def room(self, name: str) -> str:
        """Return what people call a type of room; the name of a room as it came."""
        return self._names.get(ROOM_TYPE + canonical_label(name), name.replace("_", " "))

    def attribute(self, value: str) -> str:
        """Return the word for a colour or a size; another attribute as it came."""
        return self._names.get(f"{ATTRIBUTE}{value}", value)

    def goal(self, goal: GoalStatus) -> str:
        """Return the name of what is searched for, or the requester's own words for it."""
        return self.name(name_of(goal))

    def numbered(self, goal: GoalStatus, number: int) -> str:
        """Return the name of one find of several: "chair 2" also where chairs are searched for."""
        return f"{self.name(goal.object)} {number}"

    def find(self, goal: GoalStatus, number: int) -> str:
        """Return the name of a find: of several, one thing with its number, where it has one."""
        return self.numbered(goal, number) if goal.count != 1 and number else self.goal(goal)

    def choices(self, labels: Iterable[str]) -> dict[str, str]:
        """Return labels by their names, in alphabetic order, for a list to choose from.

        Labels of one name are told apart by the label itself.
        """
        names = {label: self.name(label) for label in labels}
        count = Counter(names.values())
        shown = {
            name if count[name] == 1 else f"{name} ({in_words(label)})": label
            for label, name in names.items()
        }
        return dict(sorted(shown.items(), key=lambda one: one[0].casefold()))

    def number(self, value: float, digits: int = 0) -> str:
        """Return a number as the language writes it."""
        return f"{value:.{digits}f}".replace(".", self("number.decimal"))

    def percent(self, share: float, digits: int = 0) -> str:
        """Return a share, 0 to 1, in percent."""
        return self("panel.percent", n=self.number(100.0 * share, digits))

    def page(self, template: str) -> str:
        """Fill the marks `{{key}}` of a page; `{{language}}` and `{{words}}` are tag and table."""

        def filled(mark: re.Match[str]) -> str:
            key = mark[1]
            if key == "language":
                return html.escape(self.language)
            return self._script() if key == "words" else html.escape(self(key))

        return _MARK.sub(filled, template)

    def _script(self) -> str:
        """Return what the scripts of a page need of the table, as JSON inside HTML."""
        names = () if self._names else (NAME, ROOM_TYPE, ATTRIBUTE)
        apart = ("panel.", "report.", SAID, *names)
        table = {key: text for key, text in self._table.items() if not key.startswith(apart)}
        # The scripts know the endings -s and -es themselves.
        table |= {
            NAME + plural: self._table[NAME + label]
            for plural, label in self._plurals.items()
            if plural not in (f"{label}s", f"{label}es")
        }
        packed = json.dumps({"language": self.language, "table": table}, ensure_ascii=False)
        return packed.replace("<", "\\u003c")


def languages() -> tuple[str, ...]:
    """Return the languages that there are tables of."""
    folder = resources.files("web_assets") / "words"
    names = (file.name for file in folder.iterdir())
    return tuple(sorted(name.removesuffix(".json") for name in names if name.endswith(".json")))


@functools.cache
def _table(language: str) -> dict[str, str]:
    if language not in languages():
        raise LanguageError(
            f"there are no words in {language!r}; the languages are {', '.join(languages())}"
        )
    file = resources.files("web_assets") / "words" / f"{language}.json"
    return json.loads(file.read_text("utf-8"))


def _plurals(table: dict[str, str]) -> dict[str, str]:
    """Return the labels by the plurals of their English names, which the navigator uses, too."""
    labels = [key.removeprefix(NAME) for key in table if key.startswith(NAME)]
    return {
        plural: label
        for label in labels
        if (plural := canonical_label(generic(in_words(label)).rpartition(" ")[0])) not in labels
    }


ENGLISH: Final = Words("en")
