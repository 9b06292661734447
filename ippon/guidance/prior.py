"""The embedded prior: proximity levels from the knowledge table, without a network."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from ippon.guidance.context_rating import rate_by_claims
from ippon.guidance.knowledge import Entry, Knowledge, load_knowledge
from ippon.guidance.language.context import Claim, read_context
from ippon.guidance.language.mentions import room_phrases
from ippon.guidance.language.naming import ResolvedObject, resolve_object
from ippon.guidance.language.words import singular, tokenize
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.guidance.rating import Rating, rate
from ippon.vocabulary import canonical_label, in_words

PROVIDER = "embedded prior"


class EmbeddedPrior:
    """Levels from the knowledge table: fast, deterministic, and the fallback of other providers."""

    def __init__(self) -> None:
        self._knowledge: Knowledge = load_knowledge()

    def warm_up(self) -> None:
        """Load the library for plurals in advance, which takes about a second."""
        singular("gazebos")

    def levels(
        self,
        ooi: ResolvedObject | str,
        context: str,
        vocabulary: Sequence[str],
        rooms: Collection[str] = (),
    ) -> Guidance:
        """Rate the proximity of every common object to the goal (Sec. Semantic Guidance).

        Args:
            ooi: The goal, as typed or resolved.
            context: The operator's context; may be empty.
            vocabulary: Labels of the common objects.
            rooms: Names of the map's rooms, as words in lower case; they say nothing of levels.

        Raises:
            ValueError: `ooi` contains no word.
        """
        goal = resolve_object(ooi, vocabulary) if isinstance(ooi, str) else ooi
        reading = read_context(context, vocabulary, ooi=goal.concept or goal.canonical, rooms=rooms)
        claims = tuple(replace(c, room=None) if c.room in rooms else c for c in reading.claims)
        claims = tuple(
            claim
            for claim in claims
            if claim.place not in rooms and not (claim.negated and _of_person(claim, context))
        )
        entry = self._entry(goal)
        rows = tuple(self._row(label, entry, goal, claims) for label in vocabulary)
        return Guidance(
            ooi=goal.canonical,
            context=context,
            provider=PROVIDER,
            rows=rows,
            notes=(*self._notes(goal, entry, claims), *reading.notes),
        )

    def _row(
        self,
        label: str,
        entry: Entry | None,
        goal: ResolvedObject,
        claims: tuple[Claim, ...],
    ) -> LabelLevel:
        landmark = self._knowledge.find(in_words(canonical_label(label)))
        if label == goal.canonical:
            rating = Rating(level=Level.CERTAIN, reason="this is what you are looking for")
        elif landmark is None:
            rating = Rating(level=Level.AVERAGE, reason=f"nothing is known about {in_words(label)}")
        elif claims:
            rating = rate_by_claims(entry, landmark, claims, self._knowledge)
        elif entry is None:
            rating = Rating(level=Level.AVERAGE, reason=f"nothing is known about {goal.display}")
        else:
            rating = rate(entry, landmark, self._knowledge)
        return LabelLevel(label=label, level=rating.level, reason=rating.reason)

    def _entry(self, goal: ResolvedObject) -> Entry | None:
        exact = self._knowledge.find(in_words(goal.canonical))
        if exact is not None:
            return exact
        thing = self._knowledge.thing(goal.concept) if goal.concept else None
        return Entry(label=goal.canonical, thing=thing) if thing else None

    def _notes(
        self, goal: ResolvedObject, entry: Entry | None, claims: tuple[Claim, ...]
    ) -> list[str]:
        notes: list[str] = []
        if goal.known and goal.suggestion:
            notes.append(f"“{goal.display}” was read as “{goal.suggestion}”")
        if entry is None:
            text = f"nothing is known about “{goal.display}”"
            if goal.suggestion:
                text = (
                    f"nothing is known about “{goal.display}” (did you mean “{goal.suggestion}”?)"
                )
            rest = "only your own words count" if claims else "every level is average"
            notes.append(f"{text}: {rest}")
        return notes


def _of_person(claim: Claim, context: str) -> bool:
    """Tell whether a claim is about one room of its type: "not in Anna's bedroom"."""
    before = " ".join(token.word for token in tokenize(context[: claim.end]))
    return claim.kind == "room" and any(before.endswith(room) for room in room_phrases(before))
