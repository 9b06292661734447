"""Function words of contexts: prepositions, negations, degrees of certainty."""

from ippon.guidance.language.words import word_set

RELATIONS: dict[str, str] = {
    "on": "on",
    "on top of": "on",
    "ontop of": "on",
    "onto": "on",
    "upon": "on",
    "atop": "on",
    "over": "on",
    "hanging from": "on",
    "down the side of": "next to",
    "down the back of": "behind",
    "in": "in",
    "inside": "in",
    "inside of": "in",
    "within": "in",
    "into": "in",
    "under": "under",
    "underneath": "under",
    "beneath": "under",
    "below": "under",
    "above": "above",
    "next to": "next to",
    "next too": "next to",
    "nextto": "next to",
    "besides": "next to",
    "beside": "next to",
    "by": "next to",
    "alongside": "next to",
    "against": "next to",
    "left of": "next to",
    "right of": "next to",
    "near": "near",
    "near to": "near",
    "nearby": "near",
    "close to": "near",
    "around": "near",
    "along": "near",
    "with": "near",
    "among": "near",
    "between": "between",
    "behind": "behind",
    "in front of": "in front of",
    "infront of": "in front of",
    "across from": "in front of",
    "opposite": "in front of",
    "opposite of": "in front of",
    "at": "at",
    "to": "to",
    "towards": "to",
    "through": "in",
    "where": "near",
    "from": "from",
    "off": "from",
    "out of": "from",
    "away from": "away from",
    "far from": "away from",
    "outside": "outside",
    "outside of": "outside",
    "other than": "outside",
    "other than in": "outside",
    "other than on": "outside",
    "except": "outside",
    "except in": "outside",
    "anywhere but": "outside",
    "anywhere but in": "outside",
    "anywhere but on": "outside",
    "anywhere except": "outside",
    "anywhere except in": "outside",
    "anywhere except on": "outside",
    "everywhere except in": "outside",
    "everywhere except on": "outside",
    "everywhere but": "outside",
    "everywhere but in": "outside",
    "everywhere but on": "outside",
    "everywhere except": "outside",
    "not far from": "near",
    "not far away from": "near",
} | {
    f"{held} to": "on"
    for held in word_set(
        "stuck taped pinned attached fixed glued clipped tied chained strapped fastened screwed "
        "nailed hooked"
    )
}
"""Preposition to relation, longest match first."""

NEGATIVE_RELATIONS = frozenset({"from", "away from", "outside"})
BESIDE = frozenset({"near", "next to", "between", "behind", "in front of", "under", "above"})
"""Relations to a room in which the object is not in it, and to a thing in which it is not on it."""

PARTS = word_set(
    "side sides top bottom foot head edge corner end back front left right middle center "
    "centre inside outside surface arm arms seat part area one some rest base legs leg lid "
    "compartment shelf drawer"
)
"""Nouns before "of the bed" that still give the place."""

NEGATIONS = word_set(
    "not no never nor neither nowhere without cannot isn't wasn't aren't weren't don't "
    "doesn't didn't can't couldn't won't wouldn't haven't hasn't hadn't isnt wasnt dont "
    "doesnt didnt cant couldnt wont havent hasnt hadnt unlikely impossible ain't nobody doubt "
    "shouldn't mustn't needn't mightn't"
)
RARELY = word_set("rarely seldom hardly barely")
"""They deny where a thing is left or is, and nothing else: "barely visible under the bed"."""
SEARCHED = word_set("looked checked searched tried inspected combed")
"""Past tense: the object is not where somebody has looked."""

MOVED = word_set("moved took taken take brought carried removed picked")
"""With these, "from the sofa" is where the object no longer is."""

MISSING = word_set("missing gone disappeared vanished stolen stole nicked pinched borrowed")
"""With these, too: "missing from the sofa"."""

GONE_SINCE = (
    r"(?:(?:it|they)(?:['’]s|['’]re|['’]ve| is| are| has| have)|its|theyre)"
    r"(?: (?:now|since|just|all|already))* (?:gone|disappeared|vanished|missing)"
)
"""Regular expression for "it's gone", behind the place where it was."""

SEARCHES = word_set("look check search try looked checked searched tried been")
"""With a negation, these name a place that is still to be searched."""

NEUTRAL = (
    "don't know",
    "do not know",
    "dont know",
    "not sure",
    "not certain",
    "can't remember",
    "cannot remember",
    "can not remember",
    "don't remember",
    "do not remember",
    "didn't remember",
    "don't recall",
    "can't recall",
    "no idea",
    "no clue",
    "not only",
    "why not",
    "if not",
    "couldn't say",
    "can't say",
    "wouldn't be surprised",
    "don't forget",
    "didn't put it away",
    "did not put it away",
    "looked like",
    "couldn't be anywhere else",
    "no doubt",
    "a doubt",
    "nobody knows",
    "nobody remembers",
    "shouldn't have trouble",
    "shouldn't have any trouble",
    "shouldn't be hard",
    "shouldn't be too hard",
    "shouldn't be difficult",
    "shouldn't be a problem",
    "shouldn't it",
    "shouldn't they",
)
"""Phrases that contain a negation or "looked" but deny no place."""

DOUBTS = word_set(
    "maybe perhaps might mightn't could possibly sometimes whether if unless may wonder"
)
DOUBT_PHRASES = ("not sure", "not certain", "don't know", "do not know", "can be", "no idea")
BELIEFS = word_set(
    "think believe guess suppose probably likely assume suspect presumably seem seems "
    "apparently should shouldn't must reckon bet imagine thinks believes guesses supposes assumes "
    "suspects reckons bets imagines"
)
HABITS = word_set("usually normally often typically generally mostly regularly habitually commonly")
HABIT_PHRASES = ("tend to", "tends to", "used to", "most of the time", "as a rule", "as usual")
STALE_PHRASES = (
    "last week",
    "last month",
    "last year",
    "last summer",
    "last winter",
    "long ago",
    "long time ago",
    "days ago",
    "weeks ago",
    "months ago",
    "years ago",
    "a while ago",
    "ages ago",
    "the other day",
)

CLAUSE_WORDS = word_set("but however although though because")
SUBJECTS = word_set("i i'm i've it it's its he he's she she's they they're we we've")
"""After "and", "so" and "since" these begin a statement: "and I think it's on the bed"."""

CLAUSE_STARTS = word_set(
    "don't i i'm i've it it's he she we they you my his her our their this that there but so "
    "then maybe perhaps probably possibly check try look please because while when after "
    "before last yesterday not usually normally often sometimes somebody someone nobody mum "
    "mom dad"
)
"""A comma before one of these ends a clause."""

ABSENT_PHRASES = (
    "not there",
    "isn't there",
    "wasn't there",
    "aren't there",
    "weren't there",
    "not there anymore",
    "isn't anymore",
    "gone now",
    "no longer there",
    "couldn't find it there",
    "didn't find it there",
    "nothing there",
    "don't think so",
    "today not",
    "not today",
    "not this time",
    "not now",
    "don't go there",
    "do not go there",
    "don't look there",
)
"""A clause without a place that retracts the claims of the clause before it."""

SUGGESTIONS = (
    "check",
    "check out",
    "try",
    "look at",
    "search",
    "inspect",
    "see",
    "visit",
    "go to",
    "start with",
    "explore",
)

ABSTRACT = word_set(
    "lunch breakfast dinner supper nap room rooms morning evening afternoon night noon day week "
    "month year monday tuesday wednesday thursday friday saturday sunday time hand hands hour "
    "minute second way home house apartment flat hurry rush case fact moment place spot somewhere "
    "anywhere elsewhere everywhere nowhere there here it him her them me you us once all least "
    "most first last mind purpose accident mistake trip holiday holidays vacation today yesterday "
    "tomorrow tonight while mine yours work school party usual weekend birthday christmas pile "
    "mess top side back front middle corner end edge right left other same something someone that "
    "this which what where when who one two three next general particular order question plain "
    "sight view reach line display loan use charge danger trouble love january february march "
    "april may june july august september october november december spring summer autumn winter "
    "dark rain snow sun weather colour color size shape possible best new few some many years "
    "days months weeks ago percent"
)
"""Nouns after a preposition that are not places in a home."""

FILLERS = (
    BELIEFS
    | DOUBTS
    | HABITS
    | word_set(
        "i i'd say bet it it's its is was in and the a my our there be been probably definitely "
        "surely certainly sure of course left put forgot saw last yesterday today then also just "
        "only so very well hmm um eh please check try look"
    )
)
"""A clause of these and a place names the place: "the sofa, I guess"."""

ASIDES = (
    BELIEFS
    | DOUBTS
    | HABITS
    | word_set(
        "i i'm i'd it it's its is be but not sure certain don't do know say that really can't "
        "cannot remember exactly idea no clue bet would sadly sorry well hmm um"
    )
)
"""A clause of these only expresses certainty about the adjacent clause."""

KNOWING = word_set("sure certain know say remember idea clue")
"""Of an aside, what is denied up to one of these is knowledge, not a place."""

STOREYS = word_set("upstairs downstairs")
"""Words for floors of the building, which the map does not distinguish."""
