import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.guidance.language.sentence import MAX_OBJECT_CHARS, is_name, read_query

SURE = [
    ("find my hat, I think I left it on the sofa", "hat", "I think I left it on the sofa"),
    ("Find the bed", "bed", ""),
    ("hat", "hat", ""),
    ("Where is my red mug?", "red mug", ""),
    ("where's the tv", "tv", ""),
    ("where did I put my keys? I came home an hour ago", "keys", "I came home an hour ago"),
    (
        "I can't find my glasses, they might be on the nightstand",
        "glasses",
        "they might be on the nightstand",
    ),
    ("please look for the remote control near the tv", "remote control", "near the tv"),
    ("my hat on the sofa", "hat", "on the sofa"),
    ("I left my phone in the kitchen", "phone", "I left my phone in the kitchen"),
    ("Can you bring me the water bottle from the fridge", "water bottle", "from the fridge"),
    ("robot, search for a pair of scissors please", "pair of scissors", ""),
    ("go to the toilet", "toilet", ""),
    (
        "I lost my wallet yesterday in the living room",
        "wallet",
        "yesterday in the living room",
    ),
    ("my keys are missing", "keys", ""),
    ("My hat is gone, it was on the coat rack", "hat", "it was on the coat rack"),
    ("Have you seen the cat?", "cat", ""),
    ("toy elephant", "toy elephant", ""),
    ("I need a cup of coffee", "cup of coffee", ""),
    ("It's on the sofa. Find my hat!", "hat", "It's on the sofa."),
    ("fetch the book lying on the table", "book", "lying on the table"),
    (
        "I'm looking for my shoes; they're usually by the front door",
        "shoes",
        "they're usually by the front door",
    ),
    (
        "my mom forgot her reading glasses somewhere near the couch",
        "reading glasses",
        "my mom forgot her reading glasses somewhere near the couch",
    ),
    ("Get the frying pan", "frying pan", ""),
    ("I want you to find a plant", "plant", ""),
    ("find the coat on the coat rack", "coat", "on the coat rack"),
    ("someone took my umbrella", "umbrella", "someone took my umbrella"),
    ("looking for hat - left on sofa", "hat", "left on sofa"),
    ("Find the TV remote. I was watching a movie.", "TV remote", "I was watching a movie"),
    (
        "find hat I left it on the sofa yesterday",
        "hat",
        "I left it on the sofa yesterday",
    ),
    ("I'd like to know where my backpack is", "backpack", ""),
    (
        "please find my phone, it's not in the bedroom",
        "phone",
        "it's not in the bedroom",
    ),
    (
        "Where could my passport be? Usually it is in the drawer of the desk.",
        "passport",
        "Usually it is in the drawer of the desk",
    ),
    ("Find me the hat that I left on the sofa", "hat", "that I left on the sofa"),
    ("Where did my son leave his teddy bear?", "teddy bear", ""),
    ("Find: hat. Context: on the sofa", "hat", "on the sofa"),
    ("search hat", "hat", ""),
    ("what happened to my mug", "mug", ""),
    ("have you any idea where the scissors went", "scissors", ""),
    ("Search the kitchen for a knife", "knife", "Search the kitchen."),
    ("look on the sofa for my hat", "hat", "look on the sofa."),
    ("go to the kitchen and find a mug", "mug", "go to the kitchen."),
    ("Look for keys in the hallway", "keys", "in the hallway"),
    ("find the cup on the left of the sink", "cup", "on the left of the sink"),
    ("Find a bottle of water", "bottle of water", ""),
]


@pytest.mark.parametrize(("sentence", "object_", "context"), SURE)
def test_sentences(sentence: str, object_: str, context: str) -> None:
    query = read_query(sentence)
    assert (query.object, query.context) == (object_, context)
    assert not query.doubtful


@pytest.mark.parametrize(
    "sentence",
    [
        "",
        "???",
        "find it",
        "find something to drink",
        "i want to sit down",
        "can u find my fone",
        "asdf qwer",
        "look for the thing that holds umbrellas",
        "show me the way to the bathroom",
        "Wo ist mein Hut?",
        "Find my hat and then the keys",
        "find the refridgerator",
    ],
)
def test_doubtful_readings_are_marked(sentence: str) -> None:
    assert read_query(sentence).doubtful


def test_a_second_object_is_no_place_of_the_first() -> None:
    query = read_query("Find my hat and then the keys")
    assert (query.object, query.context) == ("hat", "")


@given(sentence=st.text(max_size=300))
@settings(deadline=None)
def test_any_text_is_read(sentence: str) -> None:
    query = read_query(sentence)
    assert len(query.object) <= MAX_OBJECT_CHARS
    assert query.object or query.doubtful


@pytest.mark.timeout(20)
@pytest.mark.parametrize("word", ["find ", "i ", "where did a ", "look for ", "my hat left "])
def test_a_very_long_sentence_is_read_in_bounded_time(word: str) -> None:
    assert len(read_query(word * 5000).object) <= MAX_OBJECT_CHARS


@pytest.mark.parametrize("text", ["where did the quokka go after lunch", "get did the hat run"])
def test_half_a_sentence_is_no_name(text):
    assert read_query(text).doubtful


@pytest.mark.parametrize("text", ["hat", "red hat", "coffee machine", "toy elephant", " hat "])
def test_a_name_needs_no_reading(text):
    assert is_name(text)


@pytest.mark.parametrize("text", ["find hat", "my keys", "hat on the sofa", "flurbl gadget"])
def test_more_or_less_than_a_name_is_read(text):
    assert not is_name(text)
