"""How people ask: phrases that ask, phrases of courtesy, and phrases that correct."""

import re
from importlib.resources import files
from typing import Final, cast

import yaml

from ippon.guidance.language.context_words import GONE_SINCE, RELATIONS
from ippon.guidance.language.goals.goal import Order


def _load() -> dict[str, list[str]]:
    text = (files("ippon.guidance.tables.speech") / "phrases.yaml").read_text(encoding="utf-8")
    # The base loader leaves every word a string: "no" and "on" are words here.
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    return cast("dict[str, list[str]]", yaml.load(text, Loader=loader))  # noqa: S506


_TABLE: Final = _load()
PREPOSITIONS: Final = RELATIONS | {
    "closest to": "near",
    "nearest to": "near",
    "nearest": "near",
    "furthest from": "away from",
    "farthest from": "away from",
    "adjacent to": "next to",
    "leaning against": "next to",
    "somewhere other than": "outside",
    "anywhere other than": "outside",
}
"""Prepositions of the context, and some that only stand in requests."""
_END: Final = r"(?=$|[\s,.!?;:'\"…)\]–—”]|-(?!\w))"
"""A phrase ends with a word."""


_PERSON: Final = (
    r"(?:(?:(?:my|our|the|a|an|his|her|their|one of (?:my|our|the)|mrs?|ms|miss|dr|doctor|"
    r"aunt|uncle|nurse|professor|officer) \w+"
    r"(?: (?!(?:you|i|we|he|she|they)\b)\w+)??|guest|patient|customer|visitor|client|resident)"
    r"(?: (?:in|at|from|on|of|by|with) (?:(?:the|a|my|our) )?\w+"
    r"(?: (?:\d+\w?|one|two|three|four|five|six|seven|eight|nine|ten))?"
    r"| next door| upstairs| downstairs| over (?:there|here))?)"
)
"""Who does something, and where: "the lady in room 7"."""
_OWNER: Final = rf"(?:\w+ )?(?:\w+['’]s|{'|'.join(_TABLE['owners'])})"


def _any(name: str) -> str:
    patterns = "|".join(_TABLE[name])
    return f"(?:{patterns.replace('{person}', _PERSON).replace('{owner}', _OWNER)})"


ASKED: Final = re.compile(
    rf"\b{_any('ask')}(?: for (?:me|us))?"
    r"(?: (?:up|down|along|back|out|in|around|over)(?= (?:the|a|an|my|our|his|her|their|some|all|"
    r"that|this|another|two|three|four|every|\d+)\b))?"
    r"(?: (?:the |one |this |these |two |three |following )*"
    r"(?:object|item|target|thing)s?(?=\s*:))?"
    r"\s*:?\s+(?=\S)",
    re.IGNORECASE,
)
"""What asks for the object that follows."""
PADDING: Final = re.compile(_any("padding") + _END, re.IGNORECASE)
"""Courtesy, what only asks, and what refers to an object that was named."""
TAIL: Final = re.compile(_any("tail") + _END, re.IGNORECASE)
"""What follows an object and says nothing of it."""
TASK: Final = re.compile(
    r"(?:and |then |and then |please )+(?:put|place|set|lay|bring|carry|take|give|hand|throw|wash|"
    r"clean|open|close|fill|empty|charge|water|feed|turn|switch|pick|move|drop|pour|hang|leave) "
    r"(?:it|them|him|her)\b[^.,;!?]*",
    re.IGNORECASE,
)
"""What shall be done with the object, which a search does not do."""
DECLINED: Final = re.compile(
    r"(?:(?:don't|dont|do not|please don't|never|stop|no need to|you needn't)"
    r" (?:look(?:ing)?|search(?:ing)?|find(?:ing)?|fetch(?:ing)?|bring(?:ing)?|get|locate)"
    r"|(?:i|we) (?:don't|dont|do not|didn't|did not) (?:want|need|mean|ask for|require)"
    r"|never mind|nevermind|forget(?: about)?|skip|ignore|leave(?: out)?|keep|mind|watch out for|"
    r"beware of|(?:be )?careful (?:of|with|around)|avoid|"
    r"(?:don't|do not) (?:touch|wake|disturb|step on|break|move)|without \w+ing)"
    r"(?: for| me)*\s+"
    r"(?:(?=the |a |an |my |our |any |his |her |their |that |this )|(?<=\bme )(?=\w))",
    re.IGNORECASE,
)
"""What says which object not to search for."""
PLACE_DECLINED: Final = re.compile(
    r"(?:don't|dont|do not|no need to|no (?:point|use)(?: in)?|skip|never mind|forget|avoid|"
    r"(?:you|we) (?:(?:need|must|should)(?:n't| not)|(?:don't|do not) (?:need|have) to)|"
    r"(?:stay|keep|steer)(?: away| clear)?(?: out)?(?= of| from))"
    r"(?: (?:bother|look|search|check|go|try|about|of|from|enter)(?:ing)?)*"
    r"(?: (?:with|in|into|on|at|to|inside|around|through|under|behind|near|beside|above))* +"
    r"(?=(?:the|my|our|your|his|her|upstairs|downstairs|outside|outdoors)\b)",
    re.IGNORECASE,
)
"""What says which room not to search."""
_LOOKING: Final = (
    r"(?:(?:bring|get|take|move|drive) yourself|make your way|go|drive|navigate|walk|head|move|run|"
    r"pop|nip|dash|hurry|rush|hop|step|look|check|search|try|inspect|scan|explore|comb|patrol|come|proceed|return|"
    r"peek|peep|rummage|glance|root|dig|"
    r"(?:take|have|do) (?:a|an|another)(?: \w+)? (?:look|peek|peep|search|rummage|glance|hunt|dig|"
    r"root|check))"
)
_THERE: Final = (
    r"(?:(?:and )?(?:(?:i|we) (?:think|believe|guess|bet) )?(?:there(?:['’]s| is| are| was| were|"
    r" should be| must be| might be| may be| will be)|you(?:['’]ll| will| should| can| might)"
    r"(?: probably)? (?:find|see)))"
)
ONCE_FOUND: Final = re.compile(
    r"(?:after|once|when|as soon as) (?:you(?:'ve| have)?|having) "
    r"(?:found|find|got|get|fetched|fetch|located|locate|picked up|collected)"
    r"\s+(?=(?:the|my|our|his|her|a|an) )",
    re.IGNORECASE,
)
"""What says which object comes first."""
UNLESS_FOUND: Final = re.compile(
    r"if (?:(?:you|we) (?:can't|cannot|can not|don't|do not|couldn't) (?:find|see|get|locate)"
    r"\s+(?=(?:the|my|our|his|her|a|an|any) )|there(?:'s| is| are)(?:n't| not| no)(?: any| an?)? "
    r"(?=[\w ]{2,30}(?:,| then\b)))",
    re.IGNORECASE,
)
"""What says in place of which object another will do."""
GO: Final = re.compile(
    rf"\b(?P<look>{_LOOKING})(?: over| down| up| straight| out| through| around| round| back)*"
    r"(?: (?:in|to|into|on|at|inside|under|of))? "
    r"(?P<place>(?:between [^.,;!?]{2,40}? and (?!then |find |get |bring |look |see |take ))?"
    r"[^.,;!?]{2,60}?)"
    rf"(?:,? (?P<end>and(?: then)?|for)\b |(?P<there>,? (?={_THERE} )))",
    re.IGNORECASE,
)
"""A place to go to before the object: "go to the kitchen and", "search the shelf for"."""
LOOK: Final = re.compile(
    r"(?:(?:please|just|so|then|and|but|better) )*(?:(?:see|check|look) (?:if|whether) (?:there|it|"
    r"they)(?:['’]s| is| are)(?: any| some| one)?|look|check|try|search|(?:have|take) a look)"
    r"(?: again| over| down| up)*\s+(?=\S)",
    re.IGNORECASE,
)
"""What says after an object where to look for it."""
SEVERAL: Final = re.compile(
    r"\b(?:look|check|search|try|inspect|explore|comb)(?: in| into| through| around)* "
    r"(?P<places>(?!for )[^.;!?]{2,90}?),? for ",
    re.IGNORECASE,
)
"""Several places before the object: "check the hall, the study and then the attic for"."""
LOOKED: Final = re.compile(
    r"(?:i|we)(?:'ve| have)?(?: already| also| just)? (?:looked|searched|checked|been)\b"
    r"[^.;!?]{2,80}? for ",
    re.IGNORECASE,
)
_TELLER = (
    rf"(?:i|we|he|she|they|i've|we've|i have|somebody|someone|{_PERSON}|"
    r"must have|may have|might have|"
    r"(?!that|which|who|what|where|when|if|find|get|every|each|all)\w+"
    r"(?= (?:\w+ ){1,3}(?:the|my|our|his|her|their|an?|some) ))"
)
_MEANWHILE = (
    r"(?: must have| may have| have| has| had| gone and| just| probably| also| last| always|"
    r" usually| normally)*"
)
_DID: Final = (
    r"leaves?|left|forgot|forgotten|put|placed|dropped|laid|stored|hid|took|taken|hidden|moved|"
    r"stole|stolen|borrowed|nicked|pinched|swiped|stashed|lost|misplaced|handed in|turned in|"
    r"dragged|threw|thrown|tossed|pushed|kicked|knocked|hung|parked|carried|chucked|stuck|shoved|"
    r"stuffed|tucked|packed|rolled|brought|wheeled|locked|tidied"
)
TOLD: Final = re.compile(
    r"\b(?!\w+ (?:far|top|bottom|front|rear|back|upper|lower|middle) left\b)"
    r"(?!\w+ \w+ (?:is|are|was|were)\b)"
    rf"{_TELLER}{_MEANWHILE} (?:last had|ha[ds](?= (?:my|our|his|her|their) "
    r"(?!breakfast|lunch|dinner|supper|brunch|tea\b))|has got(?= (?:the|my|our|his|her|their) )|"
    r"had(?= (?:the|my|our|his|her) \w+(?: \w+)? last\b|"
    r"[^.;!?]{,40}, (?:\w+ ){,3}find (?:it|them))|used|wore|saw|"
    r"(?:keeps?|kept)(?! \w+ing\b)|was wearing|"
    rf"{_DID}|"
    r"(?:put|took|taken|threw|thrown|packed|tidied|cleared|locked|picked|brought|hung|chucked) "
    r"(?:away|back|out|down|up|off)(?= (?:the|my|our|his|her|their|a|an|some) ))\s+",
    re.IGNORECASE,
)
"""Who did what with the object that follows: "my sister borrowed"."""
_SAID: Final = r"(?:says?|said|swears?|swore|thinks?|thought|believes?|reckons?|told (?:me|us))"
TOLD_OF_IT: Final = re.compile(
    rf"(?:{_PERSON}|\w+){_MEANWHILE} (?:(?:{_DID}|keeps?|kept|ha[ds]|saw)"
    r"(?: (?:away|back|out|down|up|off))? (?:it|them)\b|"
    rf"{_SAID}(?: that)? (?:it|they)\b)",
    re.IGNORECASE,
)
"""Who did what with an object that is named elsewhere: "my wife left it"."""
DOING: Final = re.compile(
    rf"\b{_TELLER} (?:was|were|has been|have been|had been)(?: just| busy)? "
    r"(?!(?:look|search|hunt|wonder|hop|try|think|go|com|sitt|ly|stand|sleep|wait|walk|runn|hid|liv|"
    r"stay|hang|ask|call)ing\b)\w+ing "
    r"(?:\w+ (?=with ))?(?:(?:with|on|in|from|out of|at|through) )*"
    r"(?=(?:the|my|our|his|her|their|a|an|some) )",
    re.IGNORECASE,
)
"""What somebody was doing with the object that follows: "the kids were playing with"."""
_GONE = (
    r"(?:gone(?! (?:cold|off|bad|flat|dead|out|sour|mouldy)\b)|missing|lost|misplaced|escaped|"
    r"disappeared|vanished|stolen|nowhere)"
)
GONE: Final = re.compile(
    r"(?:'s|is|are|was|were|has|have|got)?(?: just| now| all| been| both)*"
    rf" ?(?:gone missing|went missing|nowhere to be (?:found|seen)|{_GONE}|been (?:moved|taken|"
    r"borrowed|nicked|pinched)(?: by (?:somebody|someone))?(?! to| from| into| by))\b"
    r"(?: again| now)*",
    re.IGNORECASE,
)
GONE_SENTENCE: Final = re.compile(
    rf"\b(?:my|our|the|his|her|their)(?: \w+){{1,4}}?(?:(?:'s| is| are| was| has| have)"
    rf"(?: been| now)* (?:{_GONE}|not there)| (?:isn't|aren't|wasn't|weren't) (?:there|here)\b"
    r"| (?:ought to|should|must|has to|have to) be (?:there|here|somewhere)\b)",
    re.IGNORECASE,
)
GONE_NOW: Final = re.compile(
    rf"(?:(?:but|and|yet) )?(?:now )?({GONE_SINCE}(?: (?:now|again|already))*)"
    r"(?=\s*(?:$|[.,;:!?…)]))",
    re.IGNORECASE,
)
"""What says that an object is no longer where it was."""
NOT_WHERE: Final = re.compile(
    r"(?:(?:but |and )?(?:it|they|he|she|which|that)\b ?)?(?:(?:is|are|was|were)"
    r"(?:n['’]t| not| no longer)|['’](?:s|re) not)(?: anymore| any more)? where (?:\w+ ){1,2}?"
    r"(?:(?:always|usually|normally|last|should|must|ought to|have|has|had|had to|thought) ){0,2}"
    r"(?:\w+)(?: (?:it|them|him|her)\b)?,?",
    re.IGNORECASE,
)
"""What says that an object is not where it was left."""
_DAY = r"(?:mon|tues|wednes|thurs|fri|satur|sun)day"
_PART_OF_DAY = r"morning|afternoon|evening|night"
_HOUR = r"(?:\d\d?|one|two|three|four|five|six|seven|eight|nine|ten|eleven|twelve|noon)"
TIME: Final = re.compile(
    rf"(?:from |since )?(?:(?:at|(?<!, )around) {_HOUR}(?: o'clock| ?[ap]m)?(?=$|[.,;!?])|"
    rf"(?:early |late )?yesterday(?: (?:{_PART_OF_DAY}))?|just now|"
    rf"earlier(?: today| on)?|(?:last|this|the other|on|every) (?:{_PART_OF_DAY}|day|week|weekend|"
    rf"month|year|spring|summer|autumn|winter|{_DAY})(?: (?:{_PART_OF_DAY}))?|"
    r"(?:a|an|\d+|a few|some|a couple of|one|two|three|four|five|six|seven|eight|nine|ten|twelve|"
    r"fifteen|twenty|thirty|half an) "
    r"(?:second|minute|hour|day|week|month|year)s? ago|"
    r"(?:at|(?:before|after|during|since)(?: the| my| our)?) (?:breakfast|lunch|dinner|supper|work|"
    r"school|noon|night|midnight|midday|dawn|dusk|bedtime|lunchtime|teatime|dinnertime|break|"
    r"meeting|lesson|class|match|game|shift|party|wedding|concert|show))"
    r"(?![\w'’]),?",
    re.IGNORECASE,
)
"""When it was."""
SAME: Final = re.compile(
    r"^(?:(?:find|look for|search for|bring me|do|get)(?: me)? )?(?:(?:exactly )?the same(?: thing|"
    r" one| object| again| as before| as last time| as yesterday)*|same(?: thing| again| as before|"
    r" as last time| one)+|again|once more|one more time|(?:search|look|try|do (?:it|that)|find it|"
    r"find them|look for it|search for it|look for them)(?: once more| again| one more time)+|"
    r"repeat(?: that| it| the (?:last )?search)?|find (?:it|them)|as before|like before|(?:the )?"
    r"(?:last|previous) (?:one|thing|object)(?: again)?|what i asked (?:for )?before|try again)"
    r"(?:,? (?:please|as before|again|as last time))*[\s.!?]*$",
    re.IGNORECASE,
)
CODE: Final = re.compile(
    r"[{}<>\\|]|\w\([^)]*\)\.|\(\)|://|__|--\s*$|;\s*--|\bdrop table\b|\bselect \*", re.IGNORECASE
)
"""What no sentence holds, and code does."""
SAYS: Final = re.compile(
    rf"(?:(?:i|we|he|she|they|{_PERSON}|"
    r"(?:(?:my|the|our|mrs?|ms|dr|doctor|uncle|aunt|auntie) )?\w+)(?: just| also)? "
    r"(?:told (?:me|us)|said|swore|"
    r"(?:say|think|believe|claim|swear|reckon|bet|guess|suppose|suspect|assume|expect|imagine|hope)"
    r"(?:e?s)?|thought|believed|reckoned)|rumou?r has it|according to (?:my |the |our )?\w+,?|"
    r"maybe|perhaps|possibly|probably|apparently|chances are|my (?:guess|bet) is|"
    r"(?:i )?could(?:'ve| have)? (?:swear|sworn)|could it be|"
    r"(?:pretty|fairly|quite) (?:sure|certain)|it(?:'s| is) (?:quite )?(?:possible|likely)|"
    r"there(?:'s| is) a (?:good )?chance|"
    r"(?:i'm|i am|we're|we are|(?:(?:my|the|our) )?\w+(?:['’]s| is))(?: \w+)?? "
    r"(?:sure|certain|convinced|positive))(?: that)? "
    r"(?=(?:i|you|he|she|we|they|her|his|my|our|their|the|a|an|some|there|there's) )",
    re.IGNORECASE,
)
"""Who says what follows."""

FIXED: Final = tuple(
    phrase
    for name in ("then", "and", "or", "first", "excluding", "having", "lacking", "made", "topic")
    for phrase in _TABLE[name]
)
"""Fixed phrases that say how what follows belongs to what stands before."""
THEN: Final = tuple(_TABLE["then"])
SEPARATORS: Final[dict[Order, tuple[str, ...]]] = {
    "then": THEN,
    "or": tuple(_TABLE["or"]),
    "and": tuple(_TABLE["and"]),
}
"""What stands between objects, by the order that it says."""
FIRST: Final = tuple(_TABLE["first"])
CORRECTIONS: Final = tuple(_TABLE["corrections"])
OWNERS: Final = frozenset(_TABLE["owners"])
"""Owners that are written without their apostrophe."""
STRONG: Final = frozenset(_TABLE["strong"])
"""First words of what asks, wherever in a sentence it stands."""
OTHER_TASKS: Final = frozenset(_TABLE["other_tasks"])
"""First words of what is no request for an object."""
PRONOUNS: Final = frozenset(_TABLE["pronouns"])
STOP: Final = frozenset(_TABLE["stop"])
"""Words that end a noun phrase."""
EXCLUDING: Final = tuple(_TABLE["excluding"])
"""What follows is not meant."""
HAVING: Final = tuple(_TABLE["having"])
"""What follows belongs to the object."""
LACKING: Final = tuple(_TABLE["lacking"])
"""What follows is missing from the object."""
MADE: Final = tuple(_TABLE["made"])
"""A material follows."""
TOPIC: Final = tuple(_TABLE["topic"])
"""What it shows, tells or is called follows."""
SIDES: Final = tuple(_TABLE["sides"])
"""Which one of several, by where it stands among them."""
