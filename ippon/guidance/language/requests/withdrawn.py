"""Words that take a whole request back, or say that it shall not be done."""

import re
from typing import Final

from ippon.guidance.language.goals.drafts import Reading

_VERBS: Final = (
    r"(?:fetch(?:ing)?|bring(?:ing)?|get(?:ting)?|locat(?:e|ing)|carry(?:ing)?|pick(?:ing)? up|"
    r"(?:look|search|hunt)(?:ing)? for)"
)
_DENIED: Final = re.compile(
    r"(?<!why )\b(?:do not|don't|must not|mustn't|should not|shouldn't|need not|needn't|"
    r"by no means|(?<!can )never|nobody|no longer|(?:did not|didn't) (?:say|ask|mean|want|tell)|"
    r"not (?:want|going to|allowed to|to|necessary|a good idea)|(?:under|in) no circumstances|"
    r"refrain|forbidden|anything but|cancel|abort|quit|call off)"
    r"(?! (?:know|knows|remember|recall|forget|mind|hesitate|you|we|can|could)\b)"
    r"(?: (?!(?:and|but|or|then|so|if|because|where|until|just|how|why)\b)[\w']+){0,6}?"
    rf" (?:find(?:ing)?|{_VERBS})\b(?! (?:it|them) (?:there|in|on))"
    r"|\byou(?:'d| would| had)?(?: better| rather)? "
    rf"(?:cannot|not|can't|won't|didn't|wouldn't|(?:can|will|did|would) not) {_VERBS}\b"
    r"|\b(?:not|mustn't|shouldn't|can't|cannot|never) be (?:brought|fetched|found|touched|moved)\b",
    re.IGNORECASE,
)
"""What says that something shall not be searched for: "under no circumstances bring"."""
_TAKEN_BACK: Final = re.compile(
    r"(?:[,.;:!?…()–—-]\s*|\b(?:and|but|oh|or|no|actually|sorry|wait|please),? )"
    r"(?:(?:or |on second thoughts?,? |no,? |oh,? |actually,? |sorry,? |wait,? |please )*"
    r"(?:never ?mind|(?:forget|cancel|scratch|ignore|drop|leave|skip)(?: about)? (?:it|that|this)|"
    r"cancel|abort|stop|(?:don't|do not)(?: bother(?: any more)?| do (?:it|that)|"
    r" (?:look|search)(?: for (?:it|them))?| (?:find|get|bring|fetch) (?:it|them))?|"
    r"(?:there is )?no need|too late|"
    r"(?:(?:i|we|she|he|they)(?:'ve| have| has)?(?: just| already)* )?(?:just |already )*"
    r"(?:found|got|have) (?:it|them|him|her|one)|not (?:needed|necessary))"
    r"(?:[\s,.;!?…]+(?:thanks?|thank you|sorry|please|now|already|any ?more|actually|after all|"
    r"then|myself|too|yet|cheers|bye))*)[\s.,;!?…)]*$",
    re.IGNORECASE,
)
"""What takes the request before it back and asks for nothing else: "never mind, I found it"."""


def withdrawn(reading: Reading) -> list[str]:
    """Return the words by which a person says not to search for what was read."""
    text = reading.said.text
    found = [] if reading.declined is not None else [_DENIED.search(text)]
    found.append(_TAKEN_BACK.search(text))
    return [match.group().strip(" ,.;:!?…()–—-") for match in found if match is not None]
