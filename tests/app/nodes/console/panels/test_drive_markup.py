import re

from app.nodes.console.panels.drive_markup import painted
from app.view.words import ENGLISH


def test_what_is_painted_is_listed_with_its_area_the_latest_first():
    html = painted([("look_here", 3.24), ("not_here", 0.0)], ENGLISH)
    text = " ".join(re.sub(r"<[^>]+>", " ", html).split())
    assert text == "Not here nothing of it is mapped yet Look here 3.2 m² of the map"
    assert painted([], ENGLISH) == ""
