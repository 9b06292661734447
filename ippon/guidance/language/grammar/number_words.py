"""Numbers of several words: "twenty-two", "two hundred and five"."""

import re
from typing import Final

_UNITS: Final = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
_TEENS: Final = (
    "ten", "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen", "seventeen",
    "eighteen", "nineteen",
)  # fmt: skip
_TENS: Final = ("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")
NUMBER_WORDS: Final = {word: value for value, word in enumerate((*_UNITS, *_TEENS), start=1)} | {
    word: 10 * value for value, word in enumerate(_TENS, start=2)
}
_UNIT, _TEN = f"(?:{'|'.join(_UNITS)})", f"(?:{'|'.join(_TENS)})"
_BELOW_HUNDRED = rf"(?:{_TEN}(?:[- ]{_UNIT})?|{'|'.join(_TEENS)}|{_UNIT})"
_NUMBER = re.compile(
    rf"\b(?:(?:an?|{_UNIT}) hundred(?:(?: and)? {_BELOW_HUNDRED})?|{_TEN}[- ]{_UNIT}|"
    r"seventy|eighty|ninety|zero)\b(?![-'’])",
    re.IGNORECASE,
)


def in_digits(text: str) -> str:
    """Return a text with its numbers of several words, and those without a name, in digits."""
    return _NUMBER.sub(_digits, text)


def _digits(match: re.Match[str]) -> str:
    total = 0
    for word in re.split("[- ]", match.group().lower()):
        total = max(total, 1) * 100 if word == "hundred" else total + NUMBER_WORDS.get(word, 0)
    return str(total)
