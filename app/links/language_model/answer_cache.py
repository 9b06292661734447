"""Answers of language models on disk, by prompt and model."""

import hashlib
import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from ippon.atomic_file import replace_file
from ippon.guidance.levels import LabelLevel, Level

LOGGER = logging.getLogger(__name__)

_VERSION = 1
MAX_FILES = 2000
"""More are removed, the oldest first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CachedAnswer:
    """A stored answer."""

    rows: tuple[LabelLevel, ...]
    prompt: str
    """The exact question."""
    reply: str


class AnswerCache:
    """One file for each answer; damaged files and other formats count as absent."""

    def __init__(self, folder: Path, *, endpoint: str, model: str) -> None:
        self._folder = folder
        self._scope = (_VERSION, endpoint, model)

    def load(self, question: str, vocabulary: Sequence[str]) -> CachedAnswer | None:
        """Read the answer to a question; None where there is none for exactly this vocabulary."""
        try:
            text = self._file(question).read_text(encoding="utf-8")
            kept = cast("dict[str, Any]", json.loads(text))
            answer = CachedAnswer(
                rows=tuple(
                    LabelLevel(label=str(label), level=Level.parse(level), reason=str(reason)[:200])
                    for label, level, reason in kept["rows"]
                ),
                prompt=str(kept["prompt"]),
                reply=str(kept["reply"]),
            )
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            return None
        same = tuple(row.label for row in answer.rows) == tuple(vocabulary)
        return answer if same else None

    def store(self, question: str, answer: CachedAnswer) -> None:
        """Store an answer; failures are logged."""
        file = self._file(question)
        kept = {
            "model": self._scope[-1],
            "prompt": answer.prompt,
            "reply": answer.reply,
            "rows": [[row.label, row.level.name, row.reason] for row in answer.rows],
        }
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            replace_file(file, json.dumps(kept).encode())
            self._remove_oldest()
        except OSError as error:
            LOGGER.warning("the answer was not cached in %s: %s", file.parent, error.strerror)

    def _remove_oldest(self) -> None:
        files = list(self._folder.glob("*.json"))
        if len(files) <= MAX_FILES:
            return
        files.sort(key=lambda file: file.stat().st_mtime_ns)
        for file in files[: len(files) - MAX_FILES]:
            file.unlink(missing_ok=True)

    def _file(self, question: str) -> Path:
        key = json.dumps([*self._scope, question])
        return self._folder / f"{hashlib.sha256(key.encode()).hexdigest()}.json"
