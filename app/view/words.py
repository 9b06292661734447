"""The words of the console in one language: a table by key in `web_assets/words/`.

Keys that begin with `said.` are the sentences of the navigator: in the English table as the code
has them, with names for the values (see `Sayings`). A further language is one more file there,
named by its tag (BCP 47).
"""

import functools
import html
import json
import re
from importlib import resources
from typing import Final

from app.errors import UsageError
from app.view.sayings import Sayings

SAID: Final = "said."
"""Keys of the texts that come from the navigator."""
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
        apart = ("panel.", "report.", SAID)
        table = {key: text for key, text in self._table.items() if not key.startswith(apart)}
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


ENGLISH: Final = Words("en")
