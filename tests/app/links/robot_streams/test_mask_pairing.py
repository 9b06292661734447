"""Boxes wait for masks only while masks come."""

from types import SimpleNamespace

from app.links.robot_streams.mask_pairing import MaskPairing


def at(stamp):
    return SimpleNamespace(stamp_ns=stamp)


def paired(complete):
    return [(one.stamp_ns, None if one.masks is None else one.masks.stamp_ns) for one in complete]


def test_without_masks_boxes_go_on_at_once():
    pairing = MaskPairing(5)
    assert paired(pairing.add_boxes(at(100))) == [(100, None)]
    assert paired(pairing.add_boxes(at(200))) == [(200, None)]


def test_masks_before_or_after_their_boxes():
    pairing = MaskPairing(5)
    assert pairing.add_masks(at(102)) == []
    assert paired(pairing.add_boxes(at(100))) == [(100, 102)]
    assert pairing.add_boxes(at(200)) == []
    assert paired(pairing.add_masks(at(200))) == [(200, 200)]


def test_masks_that_stop_coming_hold_nothing_up():
    pairing = MaskPairing(5)
    pairing.add_masks(at(100))
    pairing.add_boxes(at(100))
    assert pairing.add_boxes(at(200)) == []
    assert paired(pairing.add_boxes(at(300))) == [(200, None), (300, None)]
    assert paired(pairing.add_boxes(at(400))) == [(400, None)]


def test_masks_of_no_boxes_are_forgotten():
    pairing = MaskPairing(5)
    for stamp in range(100, 10_000, 100):
        pairing.add_masks(at(stamp))
    assert len(pairing._masks) <= 4
    pairing.clear()
    assert paired(pairing.add_boxes(at(9_900))) == [(9_900, None)]
