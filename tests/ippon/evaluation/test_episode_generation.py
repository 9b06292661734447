import dataclasses
import math

import pytest

from ippon.evaluation.episode_generation import (
    EpisodeGenerationConfig,
    draw_episodes,
    goals_of,
    home_name,
    list_episodes,
)
from ippon.evaluation.metrics import Judge
from ippon.simulation.homes.config import MUG_COLORS
from ippon.simulation.scene import StartPose
from ippon.vocabulary import HABITAT_GOALS


@pytest.fixture
def home(make_scene, flat_boxes):
    """Starts: far from the hat, right beside it, and inside a wall."""
    scene = make_scene(flat_boxes)
    poses = tuple(StartPose(x=x, y=y, z=0.0, yaw=0.0) for x, y in ((1, 1), (5.6, 1.5), (-3, 1)))
    return dataclasses.replace(scene, start_poses=poses)


def _list(home, robot, **config):
    return list_episodes(home, "7", robot, EpisodeGenerationConfig(**config))


def test_starts_at_a_viewpoint_or_without_a_path_are_excluded(home, robot):
    episodes, dropped = _list(home, robot, goals=("hat",), starts_per_goal=3)
    assert [e.start_index for e in episodes] == [0]
    assert {(d.start_index, d.reason) for d in dropped} == {
        (1, "starts too near"),
        (2, "no way"),
        (None, "no start left"),
    }
    (e,) = episodes
    assert e.shortest_path_m == Judge(home, robot, "hat").shortest_path_m(e.start)
    assert math.isfinite(e.shortest_path_m)
    assert e.shortest_path_m > 3.0


def test_an_object_is_searched_for_by_each_colour_that_tells_it_from_others(
    make_scene, flat_boxes, robot
):
    mugs = [("objects", "mug", (x, 3.0, 0.0), (x + 0.2, 3.2, 0.4)) for x in (2.0, 6.0)]
    scene = make_scene([*flat_boxes, *mugs])
    colors = scene.face_colors.copy()
    for name, row in (("red", len(scene.instances) - 2), ("white", len(scene.instances) - 1)):
        colors[scene.face_instance == row] = MUG_COLORS[name]
    scene = dataclasses.replace(scene, face_colors=colors)
    episodes, dropped = _list(scene, robot, goals=("hat", "mug"), colours=True)
    assert [(e.goal, e.colour, e.episode_id) for e in episodes] == [
        ("mug", "red", "7.red_mug.0.untold"), ("mug", "white", "7.white_mug.0.untold"),
    ]  # fmt: skip
    assert episodes[0].seed != episodes[1].seed
    assert ("hat", "one colour") in {(d.goal, d.reason) for d in dropped}
    red, white = (Judge(scene, robot, "mug", colour=one) for one in ("red", "white"))
    assert (red.instances, red.wrong_instances) == (white.wrong_instances, white.instances)
    assert episodes[0].shortest_path_m == red.shortest_path_m(episodes[0].start)
    assert white.shortest_path_m(episodes[0].start) > episodes[0].shortest_path_m + 1.0


def test_starts_on_another_floor_are_left_out(home, robot):
    below, *others = home.start_poses
    upstairs = dataclasses.replace(below, z=2.8)
    episodes, dropped = _list(
        dataclasses.replace(home, start_poses=(below, upstairs, *others)),
        robot,
        goals=("hat",),
        starts_per_goal=3,
    )
    assert [e.start_index for e in episodes] == [0]
    assert (1, "another floor") in {(d.start_index, d.reason) for d in dropped}


def test_how_near_a_start_may_be_is_a_setting(home, robot):
    episodes, dropped = _list(home, robot, goals=("hat",), min_shortest_path_m=50.0)
    assert not episodes
    assert (0, "starts too near") in {(d.start_index, d.reason) for d in dropped}
    with pytest.raises(ValueError, match="min_shortest_path_m must be finite and at least"):
        EpisodeGenerationConfig(min_shortest_path_m=0.0)
    with pytest.raises(ValueError, match=r"a seed is a whole number from 0 to 2\^63 - 1; got -1"):
        EpisodeGenerationConfig(seed=-1)


def test_goals_that_the_home_lacks_are_named(home, robot):
    episodes, dropped = _list(home, robot, goals=("unicorn", "chair"))
    assert {e.goal for e in episodes} == {"chair"}
    assert ("unicorn", "absent") in {(d.goal, d.reason) for d in dropped}


def test_a_catalogue_repeats_and_does_not_depend_on_other_goals(home, robot):
    alone, _ = _list(home, robot, goals=("hat",))
    both, _ = _list(home, robot, goals=("chair", "hat"))
    assert alone == tuple(e for e in both if e.goal == "hat")
    assert both == _list(home, robot, goals=("chair", "hat"))[0]
    other, _ = _list(home, robot, goals=("hat",), seed=1)
    assert other[0].seed != alone[0].seed


def test_contexts_are_true_and_for_small_objects_only(home, robot):
    told, _ = _list(home, robot, goals=("chair", "hat"), context="support")
    assert {e.goal: e.context for e in told} == {"chair": "", "hat": "I left it on the table."}
    both, _ = _list(home, robot, goals=("hat",), context="both")
    assert [e.context for e in both] == ["", "I left it on the table."]
    assert len({e.seed for e in both}) == 1
    assert [e.episode_id for e in both] == ["7.hat.0.untold", "7.hat.0.told"]


def test_the_context_describes_the_nearest_instance(make_scene, flat_boxes, robot):
    on_chair = ("clothes", "hat", (1.2, 5.2, 0.9), (1.5, 5.5, 1.05))
    scene = make_scene([*flat_boxes, on_chair])
    poses = (StartPose(x=1, y=1, z=0.0, yaw=0.0), StartPose(x=7.5, y=4.5, z=0.0, yaw=0.0))
    scene = dataclasses.replace(scene, start_poses=poses)
    told, _ = _list(scene, robot, goals=("hat",), context="support", starts_per_goal=2)
    assert {e.start_index: e.context for e in told} == {
        0: "I left it on the chair.",
        1: "I left it on the table.",
    }


def test_few_are_drawn_with_and_without_their_context_together(home, robot):
    pair, _ = _list(home, robot, goals=("hat",), context="both")
    homes = [dataclasses.replace(e, home=str(k)) for k in range(40) for e in pair]
    few, more = draw_episodes(homes, 12), draw_episodes(homes, 20)
    assert [len(few), len(more)] == [12, 20]
    assert [sum(e.home == home for e in few) for home in {e.home for e in few}] == [2] * 6
    assert [e for e in more if e in few] == few, "a larger limit only adds"
    assert draw_episodes(homes, None) == homes
    assert draw_episodes(homes, 13) == few, "no half pair"
    assert [len(draw_episodes(homes, n)) for n in (1, 2, 79)] == [1, 2, 78]


def test_small_objects_are_drawn_up_to_a_number(home, robot):
    goals = ("hat", "dining_table", "chair")
    assert {e.goal for e in _list(home, robot, goals=goals, small_per_home=0)[0]} == {"chair"}
    one = {e.goal for e in _list(home, robot, goals=goals, small_per_home=1)[0]}
    assert len(one) == 2
    assert "chair" in one


def test_a_folder_is_called_by_its_own_name(home, robot):
    config = EpisodeGenerationConfig(goals=("hat",))
    here, _ = list_episodes(home, "/data/a/studio/", robot, config)
    there, _ = list_episodes(home, "b/studio", robot, config)
    assert home_name("/data/a/studio/") == "studio"
    assert here[0].episode_id == there[0].episode_id == "studio.hat.0.untold"
    assert here[0].seed == there[0].seed


def test_words_for_many_goals():
    assert goals_of(["habitat"]) == HABITAT_GOALS
    assert goals_of(["Alarm Clock", "hat", "alarm_clock"]) == ("alarm_clock", "hat")
    assert len(goals_of(["habitat", "small"])) == 16


def test_an_empty_catalogue_is_refused():
    with pytest.raises(ValueError, match="episodes need goals"):
        EpisodeGenerationConfig(goals=())


def test_goals_are_named_as_the_searcher_names_them():
    assert goals_of(["couch", "television", "hats"]) == ("sofa", "tv", "hat")
    with pytest.raises(ValueError, match="no object in"):
        goals_of(["?"])
