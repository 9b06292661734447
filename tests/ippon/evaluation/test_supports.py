from dataclasses import replace

from ippon.evaluation.supports import context_sentence, room_sentence, support_of


def _row(scene, label):
    return next(k for k, i in enumerate(scene.instances) if i.label == label)


def test_a_hat_lies_on_its_table(make_scene, flat_boxes):
    scene = make_scene(flat_boxes)
    support = support_of(scene, _row(scene, "hat"))
    assert support is not None
    assert support.label == "dining table"
    assert context_sentence(scene, _row(scene, "hat")) == "I left it on the table."


def test_the_highest_surface_below_counts(make_scene, flat_boxes):
    tray = ("objects", "tray", (6.3, 1.3, 0.66), (6.8, 1.8, 0.7))
    box = ("cabinet", "box", (6.35, 1.35, 0.69), (6.75, 1.75, 0.7))
    scene = make_scene([*flat_boxes, tray, box])
    support = support_of(scene, _row(scene, "hat"))
    # The tray is none of the things that a person would name.
    assert support is not None
    assert support.label in ("box", "dining table")
    assert support.label != "tray"


def test_a_floating_object_has_no_support(make_scene, flat_boxes):
    scene = make_scene([*flat_boxes, ("objects", "balloon", (2, 2, 1.5), (2.3, 2.3, 1.8))])
    assert support_of(scene, _row(scene, "balloon")) is None
    assert context_sentence(scene, _row(scene, "balloon")) is None


def test_on_the_floor_without_a_room_there_is_nothing_to_say(make_scene, flat_boxes):
    scene = make_scene(flat_boxes)
    support = support_of(scene, _row(scene, "armchair"))
    assert support is not None
    assert support.category == "floor"
    assert context_sentence(scene, _row(scene, "armchair")) is None


def test_appliances_are_called_by_their_name(make_scene, flat_boxes):
    boxes = [
        ("appliances", "washing machine", b[2], b[3]) if b[0] == "table" else b for b in flat_boxes
    ]
    scene = make_scene(boxes)
    assert context_sentence(scene, _row(scene, "hat")) == "I left it on the washing machine."


def test_the_room_of_an_object_is_said(make_scene, flat_boxes):
    scene = make_scene(flat_boxes)
    hat = _row(scene, "hat")
    assert room_sentence(scene, hat) is None
    instances = list(scene.instances)
    instances[hat] = replace(instances[hat], room="living_room.2")
    inside = replace(scene, instances=tuple(instances))
    assert room_sentence(inside, hat) == "It is in the living room."
