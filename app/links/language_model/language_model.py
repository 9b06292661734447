"""Proximity levels from a language model, with the embedded prior to fall back on."""

import base64
import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.links.language_model.answer_cache import AnswerCache, CachedAnswer
from app.links.language_model.chat import ChatConfig, ChatEndpoint, ChatError, Message, ResponseForm
from app.links.language_model.interface import RULES, LevelsAnswer, ObjectNames, SentenceAnswer
from ippon.guidance.language.goals.goal import Goal, Request
from ippon.guidance.language.naming import ResolvedObject, resolve_object
from ippon.guidance.language.requests.sentence import read_request
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.guidance.prompts.label_prompt import SCENE_SCHEMA, build_scene_prompt, parse_scene_reply
from ippon.guidance.prompts.level_prompt import (
    ParsedReply,
    build_prompt,
    build_reminder,
    parse_reply,
    reply_schema,
)
from ippon.guidance.prompts.opinion_prompt import (
    OPINION_SCHEMA,
    build_opinion_prompt,
    parse_opinion_reply,
)
from ippon.guidance.prompts.picture_prompt import (
    PICTURE_PROMPT,
    PICTURE_SCHEMA,
    parse_picture_reply,
)
from ippon.guidance.prompts.request_prompt import (
    REQUEST_SCHEMA,
    build_request_prompt,
    parse_request_reply,
)
from ippon.mission.finds.second_opinion import Opinion

LOGGER = logging.getLogger(__name__)

MAX_WAIT_S = 5.0
"""The longest pause before the second attempt, whatever the endpoint asks for."""
_MIN_SHARE = 0.5
"""Minimum share of categories that an answer must rate; other answers are discarded."""


class LanguageModel:
    """Asks a language model; answers itself from the embedded prior where that fails.

    `levels` blocks for up to three requests: call it in a separate thread, start with the prior,
    and replace its levels when the answer arrives.
    """

    def __init__(
        self,
        config: ChatConfig,
        *,
        cache_dir: Path | None = None,
        prior: EmbeddedPrior | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._config = config
        self._endpoint = ChatEndpoint(config, clock=clock)
        self._cache = (
            AnswerCache(cache_dir, endpoint=config.base_url, model=config.model)
            if cache_dir is not None
            else None
        )
        self._prior = prior or EmbeddedPrior()
        self._clock = clock
        self._closed = threading.Event()

    @property
    def name(self) -> str:
        """Provider as the console shows it."""
        return f"{self._config.model} at {self._config.host}"

    def close(self) -> None:
        """Cancel a pending request and refuse further ones."""
        self._closed.set()
        self._endpoint.close()

    def levels(
        self,
        ooi: ResolvedObject | str,
        context: str,
        vocabulary: Sequence[str],
        *,
        scenario: str = "",
    ) -> LevelsAnswer:
        """Rate the proximity of every common object to the goal.

        Does not raise for errors of the endpoint.

        Args:
            ooi: The goal, as typed or resolved.
            context: The operator's words; may be empty.
            vocabulary: Labels of the common objects.
            scenario: Where the search takes place, such as "a robotics lab"; may be empty.

        Raises:
            ValueError: `ooi` holds no word.
        """
        start = self._clock()
        goal = resolve_object(ooi, vocabulary) if isinstance(ooi, str) else ooi
        question = build_prompt(goal.display, context, scenario, vocabulary)
        cached = self._cache.load(question, vocabulary) if self._cache else None
        if cached is not None:
            return LevelsAnswer(
                guidance=self._guidance(goal, context, cached.rows, ()),
                prompt=cached.prompt,
                reply=cached.reply,
                elapsed_ms=1e3 * (self._clock() - start),
                from_cache=True,
                failed="",
            )
        asked = _Conversation(goal.display, context, scenario, tuple(vocabulary))
        failed = ""
        try:
            parsed = self._shown(self._ask(asked))
            guidance = self._complete(goal, context, vocabulary, parsed)
            if self._cache and not parsed.missing:
                shown = self._endpoint.without_key(asked.reply)
                kept = CachedAnswer(rows=parsed.rows, prompt=asked.prompt, reply=shown)
                self._cache.store(question, kept)
        except ChatError as error:
            failed = str(error)
            LOGGER.warning("%s: %s; the embedded prior answers", self.name, failed)
            guidance = self._fall_back(goal, context, vocabulary, failed)
        return LevelsAnswer(
            guidance=guidance,
            prompt=asked.prompt or question,
            reply=self._endpoint.without_key(asked.reply),
            elapsed_ms=1e3 * (self._clock() - start),
            from_cache=False,
            failed=failed,
        )

    def read_request(self, sentence: str, previous: Sequence[Goal] = ()) -> SentenceAnswer:
        """Read what one sentence asks for, by rules where the model does not answer."""
        prompt = build_request_prompt(sentence, previous)
        reply, failed = "", ""
        try:
            self._check_open()
            question: list[Message] = [{"role": "user", "content": prompt}]
            reply = self._endpoint.ask(lambda _: question, REQUEST_SCHEMA).text
            request = parse_request_reply(reply, sentence, previous)
            reply = self._endpoint.without_key(reply)
            if request is not None and request.goals:
                return SentenceAnswer(request, self.name, prompt, reply, "")
            failed = (
                "its answer could not be read" if request is None else "the model found no object"
            )
        except ChatError as error:
            failed = str(error)
        return SentenceAnswer(read_request(sentence, previous), RULES, prompt, reply, failed)

    def read_picture(self, jpeg: bytes) -> SentenceAnswer:
        """Name the object that a picture shows; asked once, never raises.

        Args:
            jpeg: The picture.
        """
        reply = ""
        try:
            reply = self._ask_of_image(jpeg, PICTURE_PROMPT, PICTURE_SCHEMA)
            request = parse_picture_reply(reply)
            reply = self._endpoint.without_key(reply)
            failed = "" if request is not None else "its answer names no object, or several"
        except ChatError as error:
            request, failed = None, str(error)
        if request is None:
            because = f"{self.name} did not name what the picture shows: {failed}"
            request = Request(goals=(), doubtful=True, because=because)
        return SentenceAnswer(request, self.name, PICTURE_PROMPT, reply, "")

    def name_objects(self, jpeg: bytes, vocabulary: Sequence[str]) -> ObjectNames:
        """Name things in an image that a vocabulary lacks; asked once, never raises.

        Args:
            jpeg: The image.
            vocabulary: Labels of the map.
        """
        try:
            reply = self._ask_of_image(jpeg, build_scene_prompt(vocabulary), SCENE_SCHEMA)
        except ChatError as error:
            return ObjectNames((), str(error))
        return ObjectNames(parse_scene_reply(reply, vocabulary))

    def second_opinion(self, jpeg: bytes, display: str) -> Opinion:
        """Judge whether the middle of an image shows an object; asked once, never raises.

        Args:
            jpeg: The image.
            display: The object with what tells it from others, in the operator's words.
        """
        try:
            reply = self._ask_of_image(jpeg, build_opinion_prompt(display), OPINION_SCHEMA)
        except ChatError as error:
            return Opinion(verdict="none", text=f"{self.name}: {error}")
        read = parse_opinion_reply(reply)
        if read is None:
            return Opinion(verdict="none", text=f"{self.name} answered none of yes, no and unsure")
        return Opinion(verdict=read[0], text=self._endpoint.without_key(read[1]), by=self.name)

    def _ask_of_image(self, jpeg: bytes, prompt: str, schema: dict[str, Any]) -> str:
        url = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
        content: list[dict[str, Any]] = [
            {"type": "text", "text": prompt},
            {"type": "image_url", "image_url": {"url": url}},
        ]
        self._check_open()
        question: list[Message] = [{"role": "user", "content": content}]
        return self._endpoint.ask(lambda _: question, schema).text

    def _ask(self, asked: "_Conversation") -> ParsedReply:
        """Ask; repeat after a failure, and ask again for omitted categories."""
        try:
            parsed = self._attempt(asked)
        except ChatError as error:
            if not error.retry or self._closed.wait(min(error.wait_s, MAX_WAIT_S)):
                raise
            parsed = self._attempt(asked)
        if not parsed.missing:
            return parsed
        try:
            more = asked.remind(self._endpoint, parsed.missing)
        except ChatError as error:
            LOGGER.info("%s: no answer to the reminder: %s", self.name, error)
            return parsed
        return _merge(parsed, more, asked.vocabulary)

    def _check_open(self) -> None:
        if self._closed.is_set():
            raise ChatError("the provider was closed", retry=False)

    def _attempt(self, asked: "_Conversation") -> ParsedReply:
        self._check_open()
        parsed = asked.ask(self._endpoint)
        if len(parsed.rows) < _MIN_SHARE * len(asked.vocabulary):
            text = f"the answer rates {len(parsed.rows)} of {len(asked.vocabulary)} categories"
            raise ChatError(text, retry=True)
        return parsed

    def _shown(self, parsed: ParsedReply) -> ParsedReply:
        """Return levels whose reasons can be shown and kept."""
        clean = self._endpoint.without_key
        rows = (replace(row, reason=clean(row.reason)) for row in parsed.rows)
        return replace(parsed, rows=tuple(rows), unknown=tuple(map(clean, parsed.unknown)))

    def _complete(
        self,
        goal: ResolvedObject,
        context: str,
        vocabulary: Sequence[str],
        parsed: ParsedReply,
    ) -> Guidance:
        rated = {row.label: row for row in parsed.rows}
        rows = tuple(
            rated.get(label)
            or LabelLevel(label=label, level=Level.AVERAGE, reason="the model left it out")
            for label in vocabulary
        )
        notes: list[str] = []
        if parsed.missing:
            notes.append(f"the model left out: {', '.join(parsed.missing)}; taken as average")
        if parsed.unknown:
            notes.append(
                f"the model rated categories that were not requested: {', '.join(parsed.unknown)}"
            )
        return self._guidance(goal, context, rows, tuple(notes))

    def _guidance(
        self,
        goal: ResolvedObject,
        context: str,
        rows: tuple[LabelLevel, ...],
        notes: tuple[str, ...],
    ) -> Guidance:
        return Guidance(
            ooi=goal.canonical, context=context, provider=self.name, rows=rows, notes=notes
        )

    def _fall_back(
        self, goal: ResolvedObject, context: str, vocabulary: Sequence[str], failed: str
    ) -> Guidance:
        answer = self._prior.levels(goal, context, vocabulary)
        note = f"{self.name}: {failed}; the embedded prior answered instead"
        return Guidance(
            ooi=answer.ooi,
            context=context,
            provider=answer.provider,
            rows=answer.rows,
            notes=(note, *answer.notes),
        )


class _Conversation:
    """Questions and answers for one goal."""

    def __init__(self, name: str, context: str, scenario: str, vocabulary: tuple[str, ...]) -> None:
        self.vocabulary = vocabulary
        self.prompt = ""
        self.reply = ""
        self._goal = (name, context, scenario)

    def _messages(self, form: ResponseForm) -> list[Message]:
        reply = "lines" if form == "text" else "json"
        self.prompt = build_prompt(*self._goal, self.vocabulary, reply=reply)
        return [{"role": "user", "content": self.prompt}]

    def ask(self, endpoint: ChatEndpoint) -> ParsedReply:
        answer = endpoint.ask(self._messages, reply_schema(self.vocabulary))
        self.reply = answer.text
        return parse_reply(answer.text, self.vocabulary)

    def remind(self, endpoint: ChatEndpoint, missing: Sequence[str]) -> ParsedReply:
        first = self.reply

        def messages(form: ResponseForm) -> list[Message]:
            return [
                *self._messages(form),
                {"role": "assistant", "content": first},
                {"role": "user", "content": build_reminder(missing)},
            ]

        answer = endpoint.ask(messages, reply_schema(missing))
        self.reply = f"{first}\n\n{answer.text}"
        return parse_reply(answer.text, missing)


def _merge(first: ParsedReply, more: ParsedReply, vocabulary: Sequence[str]) -> ParsedReply:
    rated = {row.label: row for row in (*first.rows, *more.rows)}
    asked = frozenset(vocabulary)
    return ParsedReply(
        rows=tuple(rated[label] for label in vocabulary if label in rated),
        missing=more.missing,
        unknown=tuple(
            dict.fromkeys(name for name in (*first.unknown, *more.unknown) if name not in asked)
        ),
    )
