import dataclasses

import numpy as np
import pytest

from ippon.evaluation.goal_colours import has_colour, telling_colours
from ippon.simulation.homes.config import MUG_COLORS


@pytest.fixture
def mugs(make_scene):
    """Return a scene with mugs of some colours, in this order, and nothing else."""

    def make(*names):
        scene = make_scene(
            [("objects", "mug", (x, 0.0, 0.0), (x + 0.1, 0.1, 0.1)) for x in range(len(names))]
        )
        colors = np.array([MUG_COLORS[name] for name in names], np.uint8)
        return dataclasses.replace(scene, face_colors=colors[scene.face_instance])

    return make


@pytest.mark.parametrize("name", list(MUG_COLORS))
def test_each_mug_has_its_own_colour_and_no_other(mugs, name):
    scene = mugs(name)
    assert [one for one in MUG_COLORS if has_colour(scene, 0, one)] == [name]


def test_the_colour_is_that_of_most_of_the_surface(mugs):
    scene = mugs("red")
    colors = scene.face_colors.copy()
    colors[:4] = MUG_COLORS["white"]
    assert has_colour(dataclasses.replace(scene, face_colors=colors), 0, "red")
    colors[:8] = MUG_COLORS["white"]
    assert not has_colour(dataclasses.replace(scene, face_colors=colors), 0, "red")


def test_a_texture_counts_with_its_mean(mugs):
    scene = mugs("red")
    image = np.full((2, 2, 3), MUG_COLORS["blue"], np.uint8)
    textured = dataclasses.replace(
        scene,
        textures=(image,),
        face_texture=np.zeros(len(scene.faces), np.int32),
        face_uvs=np.zeros((len(scene.faces), 3, 2), np.float32),
    )
    assert has_colour(textured, 0, "blue")
    assert not has_colour(textured, 0, "red")


def test_a_colour_tells_objects_apart_where_not_all_have_it(mugs):
    assert telling_colours(mugs("red", "white", "red"), (0, 1, 2)) == ("red", "white")
    assert telling_colours(mugs("red", "red"), (0, 1)) == ()
    assert telling_colours(mugs("red"), (0,)) == ()


def test_a_word_that_is_no_colour_is_refused(mugs):
    with pytest.raises(ValueError, match="'plaid' is no name of a colour"):
        has_colour(mugs("red"), 0, "plaid")
