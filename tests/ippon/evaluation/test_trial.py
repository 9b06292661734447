import dataclasses
import itertools
import time

import pytest

from ippon.command import Command
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.evaluation.episode_generation import EpisodeGenerationConfig, goals_of, list_episodes
from ippon.evaluation.episode_record import Clocks
from ippon.evaluation.methods.baselines import Aim, BaselinePlanner, NearestFrontier
from ippon.evaluation.methods.method_table import METHODS, Method, PlannerSetup
from ippon.evaluation.metrics import Judge
from ippon.evaluation.row import TIMING_COLUMNS, row_from
from ippon.evaluation.trial import Trial, TrialConfig, config_hash, habitat_trial
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.behaviors.config import LookAroundConfig
from ippon.mission.config import MissionConfig
from ippon.mission.mission import Mission
from ippon.mission.snapshot import MissionState
from ippon.simulation.homes.config import MUG_COLORS
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40

_CLOCKS = Clocks(wall=time.perf_counter, cpu=time.process_time)


@pytest.fixture
def config(robot):
    return TrialConfig(
        robot=robot,
        image_width=96,
        limits=EpisodeLimits(time_step_s=0.2, max_time_s=60.0),
        world=WorldConfig.perfect(),
    )


@pytest.fixture
def scene(make_scene, flat_boxes):
    return make_scene(flat_boxes)


def _episode(scene, config, goal):
    (spec, *_), _ = list_episodes(scene, "7", config.robot, EpisodeGenerationConfig(goals=(goal,)))
    return spec


def _plain(row):
    """A row without what differs from run to run."""
    values = dataclasses.asdict(row)
    return {k: v for k, v in values.items() if k not in TIMING_COLUMNS}


def _trial(config, scene, clocks=_CLOCKS, observer=None):
    return Trial(config, scene, "test", clocks, EmbeddedPrior(), observer)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_row(config, scene):
    limits = EpisodeLimits(time_step_s=0.2, max_time_s=12.0)
    config = dataclasses.replace(config, world=WorldConfig(), limits=limits)
    spec = _episode(scene, config, "chair")
    one = _trial(config, scene).run(spec, METHODS["ippon"])
    used = _trial(config, scene)
    used.run(spec, METHODS["nearest_frontier"])
    # Neither a new process nor what ran before in this one makes a difference.
    assert _plain(one) == _plain(used.run(spec, METHODS["ippon"]))
    other = dataclasses.replace(spec, seed=spec.seed + 1)
    assert _plain(used.run(other, METHODS["ippon"])) != _plain(one)


@pytest.mark.slow
@pytest.mark.parametrize("method", list(METHODS))
def test_every_method_finds_a_chair_in_one_room(config, scene, method):
    spec = _episode(scene, config, "chair")
    row = _trial(config, scene).run(spec, METHODS[method])
    assert row.method == method
    assert row.success, row
    assert (row.ending, row.failure) == ("found", "none")
    assert 0.0 < row.spl <= 1.0
    assert row.shortest_path_m == spec.shortest_path_m
    assert row.path_length_m >= row.shortest_path_m - 0.2
    assert row.first_seen_s >= 0.0
    left = (1.0, row.seen_spl, row.mapped_spl, row.reached_spl, row.spl)
    assert sorted(left, reverse=True) == list(left)
    assert row.distance_to_goal_m < 0.1
    assert (row.path_x_m[0], row.path_y_m[0]) == (1.0, 1.0)


@pytest.mark.slow
def test_the_oracle_is_close_to_the_shortest_path(config, scene):
    row = _trial(config, scene).run(_episode(scene, config, "hat"), METHODS["oracle"])
    assert row.success
    assert row.spl > 0.93


@pytest.mark.slow
def test_time_runs_out(config, scene):
    config = dataclasses.replace(config, limits=EpisodeLimits(max_time_s=2.0))
    row = _trial(config, scene).run(_episode(scene, config, "hat"), METHODS["ippon"])
    assert (row.success, row.spl, row.ending, row.failure) == (False, 0.0, "time", "never_seen")
    assert (row.seen_spl, row.mapped_spl, row.reached_spl) == (-1.0, -1.0, -1.0)
    assert row.time_s == 2.0
    assert row.frames == 10


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "cause"), [(0.5, "collision"), (0.0, "stuck")])
def test_a_robot_that_stands_against_a_wall_has_collided(config, scene, monkeypatch, speed, cause):
    def step(self, frame):
        return dataclasses.replace(Mission.step(self, frame), command=Command(linear_m_s=speed))

    monkeypatch.setattr("ippon.evaluation.trial.Mission", type("Ram", (Mission,), {"step": step}))
    limits = EpisodeLimits(time_step_s=0.5, max_time_s=75.0)
    config = dataclasses.replace(config, limits=limits)
    row = _trial(config, scene).run(_episode(scene, config, "hat"), METHODS["ippon"])
    assert (row.ending, row.failure, row.hits) == ("time", cause, int(speed > 0.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "success", "failure"),
    [("ippon", True, "none"), ("no_colour_check", False, "wrong_instance")],
)
def test_only_the_mug_of_the_colour_is_a_success(
    config, make_scene, flat_boxes, method, success, failure
):
    # The white one is nearer to the start, and the red one in sight of it.
    places = {"white": (2.6, 2.6), "red": (1.2, 4.9)}
    mugs = [("objects", "mug", (x, y, 0.5), (x + 0.16, y + 0.16, 0.7)) for x, y in places.values()]
    shelves = [
        ("counter", "counter", (x - 0.2, y - 0.2, 0.0), (x + 0.3, y + 0.3, 0.5))
        for x, y in places.values()
    ]
    scene = make_scene([*(b for b in flat_boxes if b[0] != "chair"), *shelves, *mugs])
    colors = scene.face_colors.copy()
    for name, row in (("white", len(scene.instances) - 2), ("red", len(scene.instances) - 1)):
        colors[scene.face_instance == row] = MUG_COLORS[name]
    scene = dataclasses.replace(scene, face_colors=colors)
    catalogue = EpisodeGenerationConfig(goals=("mug",), colours=True)
    episodes, _ = list_episodes(scene, "7", config.robot, catalogue)
    spec = next(e for e in episodes if e.colour == "red")
    config = dataclasses.replace(config, image_width=160)
    row = _trial(config, scene).run(spec, METHODS[method])
    assert (row.colour, row.success, row.failure) == ("red", success, failure), row
    assert (row.spl > 0.0) == success


def test_times_come_from_the_clocks_that_were_given(config, scene):
    config = dataclasses.replace(config, limits=EpisodeLimits(max_time_s=1.0))
    ticks = itertools.count()
    clocks = Clocks(wall=lambda: 100.0, cpu=lambda: 0.25 * next(ticks))
    spec = _episode(scene, config, "hat")
    row = _trial(config, scene, clocks).run(spec, METHODS["ippon"])
    assert row.planner_ms_p50 == row.planner_ms_p95 == 250.0
    assert row.wall_s == 0.0
    # From hand-over to answer the planner asks twice, then the trial.
    assert row.step_ms_p50 == 750.0
    assert row.realtime_factor == pytest.approx(1.0 / row.cpu_s)


def test_no_method_pays_for_what_all_of_them_use(config, scene, monkeypatch):
    config = dataclasses.replace(config, limits=EpisodeLimits(max_time_s=1.0))
    spent_s = [0.0]

    class SlowJudge(Judge):
        def __init__(self, *args, **options):
            spent_s[0] += 10.0
            super().__init__(*args, **options)

    monkeypatch.setattr("ippon.evaluation.trial.Judge", SlowJudge)
    clocks = Clocks(wall=lambda: spent_s[0], cpu=lambda: spent_s[0])
    spec = _episode(scene, config, "hat")
    row = _trial(config, scene, clocks).run(spec, METHODS["nearest_frontier"])
    assert (row.wall_s, row.cpu_s, spent_s) == (0.0, 0.0, [10.0])


def test_a_row_survives_plain_values(make_row):
    row = make_row(path_x_m=(1.0, 2.0))
    values = dataclasses.asdict(row) | {"path_x_m": [1.0, 2.0]}
    assert row_from(values) == row
    with pytest.raises(ValueError, match="it lacks or adds spl"):
        row_from({k: v for k, v in values.items() if k != "spl"})


def test_the_hash_distinguishes_set_ups(config):
    hashes = {config_hash(config, m) for m in METHODS.values()}
    assert len(hashes) == len(METHODS)
    assert config_hash(config, METHODS["ippon"]) == config_hash(config, METHODS["ippon"])
    wider = dataclasses.replace(config, image_width=128)
    assert config_hash(wider, METHODS["ippon"]) not in hashes
    planner = dataclasses.replace(config.mission.planner, step_budget_s=0.04)
    timed = dataclasses.replace(
        config, mission=dataclasses.replace(config.mission, planner=planner)
    )
    assert config_hash(timed, METHODS["ippon"]) not in hashes


def test_the_habitat_set_up_is_the_challenge_s():
    trial = habitat_trial()
    assert (trial.camera.width, trial.camera.height) == (240, 320)
    assert trial.limits.time_step_s == 0.1
    assert trial.limits.max_time_s == 500.0
    assert not trial.world.base.sliding
    assert trial.robot.radius_m == pytest.approx(0.17)
    assert trial.robot.max_linear_m_s == 0.3


@pytest.mark.slow
def test_a_command_lasts_several_steps(config, scene):
    world = SimulatedWorld(scene, config.robot, config.camera, scene.start_poses[0])
    mission = Mission(MissionConfig(), config.robot, MATTERPORT_40, 0)
    with pytest.raises(ValueError, match="needs a goal"):
        next(run_episode(world, mission, EpisodeLimits()))
    spec = _episode(scene, config, "hat")
    config = dataclasses.replace(
        config, limits=EpisodeLimits(time_step_s=0.1, steps_per_frame=2, max_time_s=2.0)
    )
    row = _trial(config, scene).run(spec, METHODS["ippon"])
    assert (row.frames, row.time_s) == (10, 2.0)


def test_an_episode_takes_time():
    with pytest.raises(ValueError, match="steps_per_frame at least 1"):
        EpisodeLimits(steps_per_frame=0)


@pytest.mark.slow
def test_a_couch_answers_the_search_for_a_sofa(config, make_scene, flat_boxes):
    couch = ("sofa", "couch", (0.3, 4.6, 0.0), (2.0, 5.4, 0.8))
    scene = make_scene([*(b for b in flat_boxes if b[0] != "chair"), couch])
    (goal,) = goals_of(["settee"])
    row = _trial(config, scene).run(_episode(scene, config, goal), METHODS["ippon"])
    assert (row.goal, row.success) == ("sofa", True)


@pytest.mark.slow
def test_a_second_object_is_searched_for_on_the_map_of_the_first(config, scene):
    catalogue = EpisodeGenerationConfig(goals=("chair", "hat"), second_object=True)
    episodes, _ = list_episodes(scene, "7", config.robot, catalogue)
    spec = next(e for e in episodes if e.goal == "chair")
    assert spec.then == "hat"
    states = []
    told = _trial(
        config, scene, observer=lambda _, result, __: states.append(result.snapshot.state)
    )
    first, second, fresh = told.run_all(spec, METHODS["ippon"])
    alone = _trial(config, scene).run(spec, METHODS["ippon"])
    assert _plain(first) == _plain(alone)
    assert tuple(r.episode_id for r in (first, second, fresh)) == spec.row_ids
    assert [r.kind for r in (first, second, fresh)] == ["single", "second", "fresh"]
    assert (second.goal, second.after, fresh.goal) == ("hat", "chair", "hat")
    # Both begin where the first ended, at the same distance from the hat.
    end = (first.path_x_m[-1], first.path_y_m[-1])
    for row in (second, fresh):
        assert (row.start_x_m, row.start_y_m) == pytest.approx(end, abs=0.006)
        assert (row.path_x_m[0], row.path_y_m[0]) == pytest.approx(end, abs=0.006)
        assert row.success, row
    assert second.shortest_path_m == fresh.shortest_path_m
    # Each counts its own time and way, and looks around first: no image was asked for a hat.
    assert len(states) == first.frames + second.frames + fresh.frames
    rest = states[first.frames :]
    assert MissionState.LOOKING_AROUND in rest[: second.frames], rest[:5]
    assert rest[second.frames] is MissionState.LOOKING_AROUND
    assert second.frames == pytest.approx(second.time_s / 0.2, abs=1.01)


def test_a_method_that_cannot_go_on_says_so(config, scene):
    spec = dataclasses.replace(_episode(scene, config, "hat"), then="chair")
    with pytest.raises(ValueError, match="oracle searches for one object only"):
        _trial(config, scene).run_all(spec, METHODS["oracle"])


@pytest.mark.slow
def test_steps_in_which_nobody_follows_the_plan_are_no_steps_of_a_rule(config, scene):
    """A rule that gives targets only while the robot looks around has decided nothing."""
    states, given = [], []

    class AtFirst(NearestFrontier):
        def choose(self, plan, routes, last, untried):
            if len(states) >= 3:
                return None
            return Aim(stand=(1.0, 1.0), yaw_rad=0.0, tilt_rad=0.0, worth=1.0, about=(2.0, 2.0))

    class Noting(BaselinePlanner):
        def step(self, *arguments):
            plan = super().step(*arguments)
            given.append(plan.by_rule)
            return plan

    def make_planner(inputs):
        planner = Noting(inputs.config.planner, inputs.robot, inputs.seed, AtFirst())
        return PlannerSetup(planner=planner, observe=planner.observe)

    limits = EpisodeLimits(time_step_s=0.2, max_time_s=4.0)
    mission = MissionConfig(look_around=LookAroundConfig(turn=False))
    trial = _trial(
        dataclasses.replace(config, limits=limits, mission=mission), scene,
        observer=lambda _, result, __: states.append(result.snapshot.state),
    )  # fmt: skip
    method = Method(name="at_first", summary="gives up", make_planner=make_planner)
    row = trial.run(_episode(scene, config, "hat"), method)
    assert True in given
    assert set(states[:3]) == {MissionState.LOOKING_AROUND}
    assert row.unruled_steps == row.rule_steps > 0
