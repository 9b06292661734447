"""CLIP's byte-pair encoding of text."""

import gzip
import html
import unicodedata
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
import regex
from numpy.typing import NDArray

from ippon.segmentation.errors import CheckpointError

CONTEXT: Final = 77
MERGES: Final = 49152 - 256 - 2
FILE_NAMES: Final = ("bpe_simple_vocab_16e6.txt.gz", "merges.txt")
_END_OF_WORD: Final = "</w>"
_WORD: Final = regex.compile(
    r"'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+", regex.IGNORECASE
)


class ClipTokenizer:
    """Conversion of text to CLIP's token numbers."""

    def __init__(self, merges: Sequence[tuple[str, str]]) -> None:
        """Number the tokens: bytes, bytes that end a word, merges, start, end.

        Args:
            merges: Pairs of tokens that are merged, in order of priority.
        """
        self._bytes = _byte_symbols()
        symbols = [self._bytes[b] for b in _printable_first()]
        tokens = [*symbols, *(s + _END_OF_WORD for s in symbols), *(a + b for a, b in merges)]
        self._number = {token: k for k, token in enumerate(tokens)}
        self._rank = {pair: k for k, pair in enumerate(merges)}
        self.start = len(tokens)
        self.end = len(tokens) + 1
        self._pieces_of = lru_cache(maxsize=4096)(self._pieces)

    @classmethod
    def load(cls, path: Path) -> "ClipTokenizer":
        """Read the list of merges, as OpenAI's `.txt.gz` or as Hugging Face's `merges.txt`.

        Raises:
            CheckpointError: The file is missing or not a list of merges.
        """
        try:
            packed = path.read_bytes()
            text = (gzip.decompress(packed) if path.suffix == ".gz" else packed).decode()
        except (OSError, EOFError, ValueError) as error:
            raise CheckpointError(f"cannot read CLIP's merges from {path}: {error}") from error
        # The first line is the format's version; OpenAI's file has more merges than CLIP uses.
        lines = [line for line in text.split("\n")[1:] if line][:MERGES]
        pairs = [(p[0], p[1]) for p in (line.split() for line in lines) if len(p) == 2]
        if len(pairs) != MERGES:
            raise CheckpointError(
                f"{path} has {len(pairs)} merges; CLIP's list has {MERGES}: is it one of "
                f"{' or '.join(FILE_NAMES)}?"
            )
        return cls(pairs)

    def encode(self, texts: Sequence[str]) -> NDArray[np.int64]:
        """Return (N, 77) int64 token numbers, padded with 0; longer texts are cut."""
        rows = np.zeros((len(texts), CONTEXT), dtype=np.int64)
        for row, text in zip(rows, texts, strict=True):
            numbers = self._numbers(text)[: CONTEXT - 2]
            row[: len(numbers) + 2] = [self.start, *numbers, self.end]
        return rows

    def _numbers(self, text: str) -> list[int]:
        clean = html.unescape(html.unescape(unicodedata.normalize("NFC", text)))
        words = _WORD.findall(" ".join(clean.split()).lower())
        return [self._number[piece] for word in words for piece in self._pieces_of(word)]

    def _pieces(self, word: str) -> tuple[str, ...]:
        """Merge the bytes of a word, always the pair of highest priority first."""
        symbols = [self._bytes[b] for b in word.encode()]
        pieces = [*symbols[:-1], symbols[-1] + _END_OF_WORD]
        while len(pieces) > 1:
            best = min(
                pairwise(pieces),
                key=lambda pair: self._rank.get(pair, MERGES),
            )
            if best not in self._rank:
                break
            pieces = _merged(pieces, best)
        return tuple(pieces)


def _merged(pieces: list[str], pair: tuple[str, str]) -> list[str]:
    merged: list[str] = []
    k = 0
    while k < len(pieces):
        together = tuple(pieces[k : k + 2]) == pair
        merged.append("".join(pair) if together else pieces[k])
        k += 2 if together else 1
    return merged


def _printable_first() -> list[int]:
    """Return the bytes in CLIP's order: printable ones, then the rest."""
    printable = [*range(ord("!"), ord("~") + 1), *range(0xA1, 0xAD), *range(0xAE, 0x100)]
    return [*printable, *sorted(set(range(256)) - set(printable))]


def _byte_symbols() -> dict[int, str]:
    """Return a printable character for each byte."""
    order = _printable_first()
    printable = 188
    return {b: chr(b if k < printable else 256 + k - printable) for k, b in enumerate(order)}
