from app.links.rmw_zenoh.losses import LossCount
from app.links.rmw_zenoh.protocol.attachment import Attachment


def message(sequence, publisher=b"a"):
    return Attachment(sequence=sequence, stamp_ns=0, gid=publisher * 16)


def test_gaps_of_each_publisher_are_counted():
    count = LossCount()
    for sequence in (5, 6, 8, 9):
        count.add(message(sequence))
        count.add(message(100 + sequence, b"b"))
    assert count.take_share() == 2 / 10
    assert count.take_share() == 0.0


def test_a_publisher_that_begins_again_has_lost_nothing():
    count = LossCount()
    for sequence in (900, 1, 2, 3, 10**9):
        count.add(message(sequence))
    assert count.take_share() == 0.0
