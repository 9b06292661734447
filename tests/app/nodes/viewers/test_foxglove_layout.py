"""The layout file names topics that are served, and panels that are there."""

import json
import re

import pytest

pytest.importorskip("foxglove", reason="needs the extra foxglove")

from app.nodes.viewers.foxglove_layout import layout_json
from app.nodes.viewers.foxglove_topics import JSON_TYPES, LOG_KEY, ROS_TYPES


@pytest.fixture
def layout():
    """The layout, read back."""
    return json.loads(layout_json())


def test_every_topic_of_the_layout_is_served(layout):
    served = {f"/{key}" for key in (*ROS_TYPES, *JSON_TYPES, LOG_KEY)}
    named = set(re.findall(r'"(/[a-z][^".]+)', json.dumps(layout)))
    assert len(named) > 8
    assert named <= served


def test_every_panel_that_is_placed_has_a_configuration_and_the_other_way_round(layout):
    tabs = layout["configById"]["Tab!maps"]["tabs"]
    placed = set(_leaves(layout["layout"])) | {tab["layout"] for tab in tabs}
    assert placed == set(layout["configById"])


def test_the_map_is_drawn_as_cubes_in_its_own_colours(layout):
    scene = layout["configById"]["3D!probability"]
    cloud = scene["topics"]["/map/probability"]
    assert (cloud["pointShape"], cloud["colorMode"], cloud["cubeSize"]) == ("cube", "rgb", 0.1)
    assert scene["fixedFrame"] == "map"


def _leaves(node):
    if isinstance(node, str):
        yield node
        return
    for side in ("first", "second"):
        yield from _leaves(node[side])
