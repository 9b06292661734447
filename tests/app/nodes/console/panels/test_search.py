"""The Search tab: the picture of a find, and the verdict on it."""

from unittest.mock import MagicMock

import msgspec
import numpy as np
import simplejpeg

from app.messages.control import SentenceReading
from app.messages.images import CompressedColor
from app.messages.status import GoalStatus
from app.nodes.console.link.commands import CommandError, StartedSearch
from app.nodes.console.panels import search
from app.nodes.console.scene import find_picture
from app.view.model.scene_model import SceneModel
from app.view.words import ENGLISH
from ippon.guidance.language.goals.goal import Goal


def test_the_picture_of_a_find_stays_when_the_find_is_judged(monkeypatch, stage):
    shown = []
    monkeypatch.setattr(search, "show_jpeg_in_panel", lambda _, jpeg: shown.append(jpeg))
    monkeypatch.setattr(find_picture, "outlined", lambda encoded, _: encoded)
    panel = search.SearchPanel(MagicMock(), MagicMock(say=ENGLISH, recorded=False))
    model = SceneModel()
    for image, is_confirmed in ((b"of the find", False), (b"of another room", True)):
        goal = GoalStatus(goal_id=1, object="hat", outcome="found", confirmed=is_confirmed)
        model.on_image(CompressedColor(stamp_ns=1, frame_id="camera", encoded=image))
        model.on_status(stage.status_of("found", goal=goal, find=stage.find_of()))
        panel.update(model, model.take_changes())
    assert shown == [b"of the find"]


def test_a_find_without_an_image_has_no_picture_until_one_comes(monkeypatch, stage):
    shown = []
    monkeypatch.setattr(search, "show_jpeg_in_panel", lambda _, jpeg: shown.append(jpeg))
    monkeypatch.setattr(find_picture, "outlined", lambda encoded, _: encoded)
    gui, images = MagicMock(), []
    gui.add_image.side_effect = lambda *_, **props: images.append(MagicMock(**props)) or images[-1]
    panel = search.SearchPanel(gui, MagicMock(say=ENGLISH, recorded=False))
    crop, model = images[0], SceneModel()
    model.on_status(stage.status_of("found", find=stage.find_of()))
    panel.update(model, model.take_changes())
    assert crop.visible is False, "a console that was started again has no image yet"
    model.on_image(CompressedColor(stamp_ns=1, frame_id="camera", encoded=b"of the find"))
    model.on_status(stage.status_of("found", find=stage.find_of()))
    panel.update(model, model.take_changes())
    assert (crop.visible, shown) == (True, [b"of the find"])


def test_a_find_of_which_no_image_is_kept_is_judged_by_what_the_robot_sees(monkeypatch, stage):
    monkeypatch.setattr(search, "encoded_picture", lambda encoded, *_, **__: encoded)
    shown = []
    monkeypatch.setattr(search, "show_jpeg_in_panel", lambda _, jpeg: shown.append(jpeg))
    monkeypatch.setattr(find_picture, "outlined", lambda encoded, _: encoded)
    gui, images = MagicMock(), []
    gui.add_image.side_effect = lambda *_, **props: images.append(MagicMock(**props)) or images[-1]
    panel = search.SearchPanel(gui, MagicMock(say=ENGLISH, recorded=False))
    (crop, camera), model = images, SceneModel()
    find = msgspec.structs.replace(stage.find_of(), stamp_ns=1)
    states = []
    for minute, image in ((2, b"late"), (3, b"later"), (0, b"of the find"), (4, b"elsewhere")):
        stamp_ns = 60_000_000_000 * minute
        model.on_image(CompressedColor(stamp_ns=stamp_ns, frame_id="camera", encoded=image))
        model.on_status(stage.status_of("found", find=find))
        panel.update(model, model.take_changes())
        states.append((crop.visible, camera.visible))
    assert states == [(False, True)] * 2 + [(True, False)] * 2
    assert shown == [b"late", b"later", b"of the find"]
    model.on_status(stage.status_of("searching"))
    panel.update(model, model.take_changes())
    assert camera.visible, "the search goes on"


def test_a_verdict_names_the_find_that_is_shown(monkeypatch, stage):
    monkeypatch.setattr(search, "show_jpeg_in_panel", lambda *_: None)
    gui, actions = MagicMock(), MagicMock(say=ENGLISH, recorded=False)
    buttons = []

    def add_button(label, **_):
        button = MagicMock()
        if label == ENGLISH("panel.search.confirm"):
            buttons.append(button)
        return button

    gui.add_button.side_effect = add_button
    panel = search.SearchPanel(gui, actions)
    model = SceneModel()
    for number in (2, 2, 3):
        find = msgspec.structs.replace(stage.find_of(), number=number)
        model.on_status(stage.status_of("found", find=find))
        panel.update(model, model.take_changes())
    first, second = buttons
    # The browser may still show the button of the find before, or a press of it be under way.
    first.remove.assert_called_once_with()
    for button in (first, second):
        (press,), _ = button.on_click.call_args
        press(None)
    assert [call.args for call in actions.confirm_find.call_args_list] == [(1, 2), (1, 3)]


def test_the_panel_gets_small_pictures(monkeypatch):
    shown = []
    monkeypatch.setattr(search, "show_jpeg_in_panel", lambda _, jpeg: shown.append(jpeg))
    panel = search.SearchPanel(MagicMock(), MagicMock(say=ENGLISH, recorded=False))
    model = SceneModel()
    for encoded in (simplejpeg.encode_jpeg(np.zeros((720, 1280, 3), np.uint8)), b"damaged"):
        model.on_image(CompressedColor(stamp_ns=1, frame_id="camera", encoded=encoded))
        panel.update(model, model.take_changes())
    (jpeg,) = shown
    assert simplejpeg.decode_jpeg(jpeg).shape == (225, 400, 3)


def _ask(panel, typed):
    """Press Search in a form of its own; return what is answered."""
    form = MagicMock(question=(typed, "", ""))
    form.asked.return_value = form.question
    form.take_held.return_value = ()
    answers = []
    panel._say = lambda text, *, ok: answers.append((text, ok))
    panel._ask(form)
    return answers[-1]


def test_what_another_operator_asks_in_between_does_not_double_a_search():
    started = [StartedSearch(text=f"goal {n}", goal_id=n) for n in (1, 2, 3)]
    actions = MagicMock(say=ENGLISH, recorded=False)
    actions.search.side_effect = started
    panel = search.SearchPanel(MagicMock(), actions)
    assert _ask(panel, "hat") == ("goal 1", True)
    assert _ask(panel, "mug") == ("goal 2", True)
    assert _ask(panel, "hat") == (ENGLISH("panel.search.repeats"), False)


def test_a_search_that_has_started_is_told_though_the_next_one_is_refused():
    actions = MagicMock(say=ENGLISH, recorded=False)
    actions.read.return_value = SentenceReading(
        goals=[Goal(display=name, object=name) for name in ("keys", "wallet")],
        doubtful=False, because="", unused=[], notes=[], language="", provider="rules",
        elapsed_ms=1.0,
    )  # fmt: skip
    actions.search.side_effect = [
        StartedSearch(text="Looking for: keys.", goal_id=1),
        CommandError("the queue is full"),
    ]
    panel = search.SearchPanel(MagicMock(), actions)
    answer = _ask(panel, "my keys and my wallet")
    assert answer == ("Looking for: keys. the queue is full", False)
