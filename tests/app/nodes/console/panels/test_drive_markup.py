import re
from html import unescape

from app.messages.driving import PaintedStroke
from app.nodes.console.panels.drive_markup import painted
from app.view.words import ENGLISH, Words


def test_what_is_painted_is_listed_with_its_area_and_room_the_latest_first():
    first = PaintedStroke(
        kind="look_here", strokes=[(0.0, 0.0)], radius_m=1.0, room="Anna's <room>"
    )
    second = PaintedStroke(kind="not_here", strokes=[(9.0, 0.0)], radius_m=1.0)
    html = painted([(first, 3.24), (second, 0.0)], ENGLISH)
    text = unescape(" ".join(re.sub(r"<[^>]+>", " ", html).split()))
    assert text == (
        "Not here nothing of it is mapped yet Look here 3.2 m² of the map · Anna's <room>"
    )
    assert painted([], ENGLISH) == ""


def test_a_type_of_room_is_said_in_the_language_of_the_page():
    stroke = PaintedStroke(kind="look_here", strokes=[(0.0, 0.0)], radius_m=1.0, room="living room")
    assert "Wohnzimmer" in painted([(stroke, 1.0)], Words("de"))
