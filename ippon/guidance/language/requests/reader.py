"""Reading of a sentence from left to right: goals, what describes them, and the context."""

from collections.abc import Sequence
from dataclasses import replace

from ippon.guidance.language.context_words import ABSTRACT, RELATIONS
from ippon.guidance.language.goals import clauses
from ippon.guidance.language.goals.absence import read_all_gone
from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.goals.goal import Goal, Relation
from ippon.guidance.language.goals.modifiers import read_modifier
from ippon.guidance.language.goals.references import is_only_stated
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import listed_kind
from ippon.guidance.language.grammar.determiners import NUMBERS, count_again, is_person_at
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.phrases import PRONOUNS
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.relation_phrase import read_relation
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.lists.goal_list import (
    MAX_DRAFTS,
    read_goals,
    read_modifiers,
    separator,
    stands_alone,
)
from ippon.guidance.language.lists.left_out import skip_left_out
from ippon.guidance.language.lists.list_order import read_each, read_first_of, settle_each
from ippon.guidance.language.requests.asides import skip_aside
from ippon.guidance.language.requests.asked import read_asked
from ippon.guidance.language.requests.corrections import read_correction
from ippon.guidance.language.requests.courtesy import (
    skip_announcement,
    skip_asking,
    skip_courtesy,
)
from ippon.guidance.language.requests.declined import drop_rooms, not_this
from ippon.guidance.language.requests.earlier import read_after, read_before
from ippon.guidance.language.requests.leading_places import (
    read_hint,
    read_place_again,
    read_place_first,
)
from ippon.guidance.language.requests.told import read_told
from ippon.guidance.language.words import is_mass, word_set

_SUBJECTS = word_set(
    "it its it's they they're them he she he's she's i i'm i've we we've you somebody someone mum "
    "mom dad my the there that this which who because since as when while after before so but "
    "maybe perhaps probably possibly last yesterday usually normally often or and not don't if "
    "until for to with where what though although try check start look please "
    "left put fell was were must had took"
)
"""Words that begin what is told beside a request."""


_ALL = (
    "all of them", "every one of them", "all", "as many as you can", "as many as you can find",
    "as many as possible", "as many as there are",
)  # fmt: skip


def _is_event(said: Utterance, phrase: NounPhrase) -> bool:
    """Tell whether no thing is named: "lunch is at one", "happy Friday", "the cat is cute"."""
    if any(one.kind == "owner" for one in phrase.attributes):
        return False
    stated = said.word(phrase.end) in ("is", "are") and not said.breaks(phrase.end)
    if phrase.head.rpartition(" ")[2] in ABSTRACT and (stated or not phrase.known):
        return True
    kind = listed_kind(said.word(phrase.end + 1))
    ready = kind in ("condition", "feel") and not phrase.determined and is_mass(phrase.head)
    return stated and phrase.end + 2 == len(said) and (ready or kind == "quality")


class RequestReader:
    """Reads one sentence into `reading`."""

    def __init__(self, said: Utterance, previous: Sequence[Goal] = ()) -> None:
        self._said = said
        self.reading = Reading(said, previous)

    def read(self) -> Reading:
        """Read the whole sentence."""
        index = 0
        while index < len(self._said) and len(self.reading.drafts) < MAX_DRAFTS:
            index = max(self._step(index), index + 1)
        self.reading.drafts += self.reading.later
        if not self.reading.drafts:
            self._by_name()
        if index < len(self._said):
            self.reading.stray.append(self._said.said(index, len(self._said))[:200])
        drop_rooms(self.reading)
        settle_each(self.reading)
        for goal in self.reading.drafts:
            end = goal.phrase.end
            if is_only_stated(goal) and self._said.word(end) in ("is", "are"):
                self.reading.stray.append(self._said.said(end, end + 2))  # "The bar is open".
        return self.reading

    def _by_name(self) -> None:
        """Fall back on the first thing of the table that a sentence names."""
        said = self._said
        self.reading.stray += self.reading.before[:1]
        if said.word(0) in phrases.OTHER_TASKS or self.reading.declined is not None:
            return
        for index in range(len(said)):
            if said.word(index - 1) in RELATIONS:
                continue
            phrase = read_noun_phrase(said, index)
            named = phrase is not None and phrase.determined and phrase.known and phrase.head
            if phrase is not None and named and not is_room(phrase.head):
                self.reading.before = []
                read_goals(self.reading, index, "named")
                self.reading.drafts[0].note(said.said(0, len(said)))
                return

    # -- one step ------------------------------------------------------------------------------

    def _step(self, index: int) -> int:
        for read in (
            self._aside,
            self._corrected,
            self._declined,
            self._ordering,
            self._before,
            self._announced,
            self._placed_first,
            self._hinted,
            self._asked,
            self._told,
            self._courtesy,
            self._timed,
            self._described,
            self._listed,
            self._bare,
        ):
            end = read(index)
            if end > index:
                return end
        return self._context(index)

    def _aside(self, index: int) -> int:
        return skip_aside(self.reading, index)

    def _corrected(self, index: int) -> int:
        after = self._said.corrected(index, phrases.CORRECTIONS)
        if after == index:
            return index
        if not self.reading.drafts:
            if self._said.word(index) == "not" and not self._said.breaks(after):
                return index  # "Not that hammer".
            plain = after == index + 1 and self._said.word(after) != "not"
            return max(self._declined(index), index if plain else after)
        again = read_place_again(self.reading, after)
        if again > after:
            return again
        return read_correction(self.reading, index, skip_asking(self.reading, after))

    def _declined(self, index: int) -> int:
        return max(skip_left_out(self.reading, index), clauses.skip_declined(self.reading, index))

    def _ordering(self, index: int) -> int:
        first = read_first_of(self.reading, index)
        if first > index:
            return first
        length = self._said.starts(index, phrases.FIRST)
        if length and not self.reading.drafts and self._said.word(index + length) != "aid":
            return index + length
        length = self._said.starts(index, ("in that order", "in this order", "in order"))
        if length and self._said.ends(index + length):
            for goal in self.reading.drafts[self.reading.list_start + 1 :]:
                goal.order = "then"
            return index + length
        length = self._said.starts(index, phrases.SEPARATORS["or"])
        if length and self.reading.drafts:
            asked = self.reading.match(phrases.ASKED, index + length)
            if asked > index + length and read_noun_phrase(self._said, asked) is not None:
                self.reading.order = "or"
                return index + length
        length = self._said.starts(index, phrases.THEN)
        if length and self.reading.drafts:
            self.reading.order = "then"
            return index + length
        return index

    def _timed(self, index: int) -> int:
        """Read "last night" before an object."""
        end = index if self.reading.drafts else self.reading.match(phrases.TIME, index)
        if end > index:
            self.reading.before.append(self._said.said(index, end))
        return end

    def _placed_first(self, index: int) -> int:
        return read_place_first(self.reading, index)

    def _hinted(self, index: int) -> int:
        return read_hint(self.reading, index)

    def _before(self, index: int) -> int:
        return max(read_before(self.reading, index), read_after(self.reading, index))

    def _announced(self, index: int) -> int:
        return skip_announcement(self.reading, index)

    def _courtesy(self, index: int) -> int:
        return skip_courtesy(self.reading, index)

    def _asked(self, index: int) -> int:
        return read_asked(self.reading, index)

    def _told(self, index: int) -> int:
        return max(read_told(self.reading, index), read_all_gone(self.reading, index))

    def _described(self, index: int) -> int:
        """Read what is said of the objects before: "not upstairs", "the blue one"."""
        said = self._said
        counted = read_each(self.reading, index)
        if counted > index:
            return counted
        if not self.reading.drafts:
            return index
        room = read_noun_phrase(said, index) if said.ends(index) else None
        if room is not None and is_room(room.head) and said.ends(room.end):
            self.reading.drafts[-1].note(room.display)  # "Glue gun. Attic?"
            if "?" not in said.text:
                self.reading.drafts[-1].relate(Relation(relation="in", place=room.head))
            return room.end
        length = said.starts(index, _ALL)
        if length and said.ends(index + length):
            self.reading.drafts[-1].count = "all"
            return index + length
        if said.words(index, index + 3) == ["both", "of", "them"] and said.ends(index + 3):
            self.reading.drafts[-1].count = 2
            return index + 3
        counted = count_again(said, index + 1) if said.word(index) == "all" else 0
        if counted:
            self.reading.drafts[-1].count = NUMBERS[said.word(index + 1)]
            return index + 1 + counted  # "All four of them".
        counted = count_again(said, index) if said.breaks(index) else 0
        if counted > 1:
            self.reading.drafts[-1].count = NUMBERS[said.word(index)]
            return index + counted  # "Cups! Six of them".
        subject = said.word(index) in ("they", "they're", "both", "these")
        relation = read_relation(said, index)
        listed = self.reading.drafts[self.reading.list_start :]
        if relation is None and sum(one.display.endswith("s") for one in listed) == 1:
            subject = subject and not listed[-1].display.endswith("s")  # "My bag and my shoes".
        targets = listed if subject and listed else self.reading.drafts[-1:]
        if relation is not None and not clauses.ends_clause(said, relation.end):
            return index  # More is said, which the context tells.
        end = read_modifier(said, index, targets[-1])
        if end > index:
            for target in targets[:-1]:
                read_modifier(said, index, target)
            return read_modifiers(self.reading, end)
        return index

    # -- lists ---------------------------------------------------------------------------------

    def _listed(self, index: int) -> int:
        """Read another object of the list that came before: "and also my glasses"."""
        if not self.reading.drafts:
            return index
        following = separator(self.reading, index)
        if following is None:
            return index
        order, start, _ = following
        self.reading.order = order if self.reading.order is None else self.reading.order
        return read_goals(self.reading, start, "listed")

    def _bare(self, index: int) -> int:
        """Read a name without a verb: "my hat on the sofa", "my keys are missing"."""
        said = self._said
        word = said.word(index)
        if said.word(index) in ("not", "never", "neither"):
            return not_this(self.reading, index)
        if word in phrases.OTHER_TASKS:
            return index
        if word == "no" and index == 0 and not said.breaks(1) and said.word(2) != "than":
            return self._lacking(index)
        gone = self.reading.match(phrases.GONE_SENTENCE, index) > index
        first = not self.reading.drafts
        fresh = self.reading.order is not None or (index > 0 and said.ends(index))
        phrase = read_noun_phrase(said, index)
        if phrase is None or not (phrase.head or phrase.determined or self.reading.drafts):
            return index
        able = said.words(index - 2, index) in (["can", "you"], ["do", "you"], ["will", "you"])
        if _is_event(said, phrase) or (able and phrase.shared and not phrase.known):
            return index  # "Can you swim?"
        if phrase.shared and phrase.end == index + 1 and self._orders(phrase.end):
            return index  # "Iron the shirt".
        called = index == 0 and not phrase.known and phrase.end == 1 and said.breaks(1)
        asking = (phrases.ASKED, phrases.TOLD)
        if called and any(self.reading.match(one, 1) > 1 for one in asking):
            return 1  # "Nurse, where are my glasses?"
        if not first and not gone and not (fresh and (phrase.known or phrase.determined)):
            return index
        if not gone and not stands_alone(self.reading, index, phrase):
            return index
        return read_goals(self.reading, index, "bare")

    def _orders(self, index: int) -> bool:
        """Tell whether the word before is rather a verb: "throw away the papers"."""
        index += self._said.word(index) in ("away", "out", "up", "off", "down")
        article = self._said.word(index) in ("the", "my", "our", "his", "her", "their", "a", "an")
        return article and not self._said.breaks(index)

    def _lacking(self, index: int) -> int:
        """Read "no batteries in the drawer" as a request for some."""
        phrase = read_noun_phrase(self._said, index + 1)
        if phrase is None or not phrase.known or phrase.determined:
            return index
        if phrase.end == len(self._said) or self._said.word(index + 1) == "more":
            return index
        end = read_goals(self.reading, index + 1, "bare")
        for goal in self.reading.drafts:
            goal.relations = [replace(one, negated=True) for one in goal.relations]
        return end

    # -- context ---------------------------------------------------------------

    def _context(self, index: int) -> int:
        """Take a clause as told beside the request."""
        said = self._said
        told = not self.reading.drafts or said.breaks(index) or said.word(index) in _SUBJECTS
        told = told or index == 0 or is_person_at(said, index)
        end = clauses.clause_end(self.reading, index, whole=told)
        words = said.said(index, end)
        if all(word in PRONOUNS or word in ("and", "but", "so") for word in said.words(index, end)):
            return end
        if not self.reading.drafts:
            self.reading.before.append(said.said(self.reading.hedged.get(index, index), end))
            clauses.note_subject(self.reading, index, end)
            return end
        asked = self.reading.match(phrases.ASKED, index)
        asks = said.breaks(index) and asked > index + 1 and said.word(asked) not in ("it", "them")
        if asks and not any(read_relation(said, n, verbs=False) for n in range(index, end)):
            self.reading.stray.append(words)  # It asks for what no object was read of.
        if not told:
            self.reading.stray.append(words)
            return end
        clause = said.words(index, end)
        many = bool({"they", "they're", "them", "both"} & set(clause))
        clauses.state(
            self.reading,
            words,
            self.reading.drafts[self.reading.list_start :] if many else self.reading.drafts[-1:],
        )
        return end
