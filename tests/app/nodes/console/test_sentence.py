import pytest

from app.nodes.console.sentence import read_request


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("hat", ("hat", "")),
        ("  student   card ", ("student card", "")),
        ("my hat", ("hat", "")),
        ("find my hat, I left it on the sofa", ("hat", "I left it on the sofa")),
        ("Find the hat I left on the sofa", ("hat", "I left on the sofa")),
        ("please look for a coffee machine in the kitchen", ("coffee machine", "in the kitchen")),
        ("Where are my keys?", ("keys", "")),
        ("where's the remote, maybe under the cushion.", ("remote", "maybe under the cushion.")),
        ("I lost my student card; I just used it on the printer",
         ("student card", "I just used it on the printer")),
        ("hat, I left it on the sofa", ("hat", "I left it on the sofa")),
        ("bring me the toy elephant", ("toy elephant", "")),
        ("I can't find my glasses", ("glasses", "")),
        ("table lamp on wheels", ("table lamp on wheels", "")),
        ("", ("", "")),
    ],
)  # fmt: skip
def test_reads_object_and_context(typed, expected):
    assert read_request(typed) == expected
