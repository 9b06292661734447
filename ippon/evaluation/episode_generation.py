"""Episodes of a home: start, goal, context and seed, the same for every method."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal

import numpy as np

from ippon.evaluation.goal_colours import telling_colours
from ippon.evaluation.goal_objects import matching_instances
from ippon.evaluation.metrics import SUCCESS_DISTANCE_M, Judge
from ippon.evaluation.supports import context_sentence, room_sentence
from ippon.guidance.language.naming import resolve_object
from ippon.robot import RobotProfile
from ippon.seed import check_seed
from ippon.simulation.camera.line_of_sight import LineOfSight
from ippon.simulation.robot.navigation_grid import robot_grid
from ippon.simulation.scene import Scene, StartPose
from ippon.vocabulary import HABITAT_GOALS, MATTERPORT_40, canonical_label

SMALL_GOALS: Final[tuple[str, ...]] = (
    "hat", "backpack", "handbag", "teddy_bear", "laptop", "book", "vase", "bottle", "mug", "basket",
)  # fmt: skip
"""Small objects that are not among the 40 common ones."""

ContextMode = Literal["none", "support", "both", "room"]
Reason = Literal[
    "absent", "one colour", "starts too near", "no way", "another floor", "no start left"
]
"""Why a search is excluded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeGenerationConfig:
    """Selection of the episodes of a home."""

    goals: tuple[str, ...] = (*HABITAT_GOALS, *SMALL_GOALS)
    """Canonical labels to search for, where the home has them."""
    starts_per_goal: int = 1
    """Start poses drawn for each goal; more averages over lucky starts."""
    small_per_home: int = 3
    """Goals drawn besides the six Habitat categories; more gives more episodes per home."""
    context: ContextMode = "none"
    """"support": a true sentence for small goals; "both": each small goal with and without it;
    "room": each small goal with and without the room that it is in."""
    colours: bool = False
    """Search for objects of a colour that tells them from others of their kind in the home, such as
    the red one of several mugs; goals without such a colour are left out."""
    second_object: bool = False
    """Search for another object of the home at the end of each search, on its map."""
    min_shortest_path_m: float = 1.0
    """Starts closer to a viewpoint are excluded, as in the challenge; more gives longer
    searches."""
    seed: int = 0
    """Seed for starts, goals and the noise of each search."""

    def __post_init__(self) -> None:
        """Reject a configuration without episodes."""
        if not SUCCESS_DISTANCE_M <= self.min_shortest_path_m < np.inf:
            raise ValueError(
                f"min_shortest_path_m must be finite and at least {SUCCESS_DISTANCE_M}, where a "
                f"search would have ended at its start; got {self.min_shortest_path_m}"
            )
        check_seed(self.seed)
        if not self.goals or self.starts_per_goal < 1 or self.small_per_home < 0:
            raise ValueError(
                "episodes need goals, starts_per_goal of at least 1 and small_per_home of at "
                f"least 0; got {self.goals}, {self.starts_per_goal}, {self.small_per_home}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeSpec:
    """One search, independent of the method, with everything needed to repeat it."""

    home: str
    """Seed or folder of the home."""
    start_index: int
    """Row of `Scene.start_poses`."""
    start: StartPose
    goal: str
    """Canonical label."""
    context: str
    """Context sentence; empty for none."""
    seed: int
    """Seed of camera noise, segmentation errors and planner samples."""
    shortest_path_m: float
    """d0, metres."""
    colour: str = ""
    """Colour that tells the object from others of its kind; empty for none."""
    then: str = ""
    """Goal of the second search; empty for none."""

    @property
    def episode_id(self) -> str:
        """Return a name that is equal in every run and valid as a file name."""
        return self._named("told" if self.context else "untold")

    @property
    def id_without_context(self) -> str:
        """Return the name of the same search without a context."""
        return self._named("untold")

    def _named(self, told: str) -> str:
        wanted = "_".join(filter(None, (self.colour, self.goal)))
        return f"{home_file_name(self.home)}.{wanted}.{self.start_index}.{told}"

    @property
    def row_ids(self) -> tuple[str, ...]:
        """Return the names of the episode's rows: one, or three with `then`."""
        own = self.episode_id
        return (
            (own, f"{own}.{self.then}.second", f"{own}.{self.then}.fresh") if self.then else (own,)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ExcludedEpisode:
    """A search that was excluded, and the reason."""

    home: str
    goal: str
    start_index: int | None
    reason: Reason


def list_episodes(
    scene: Scene, home: str, robot: RobotProfile, config: EpisodeGenerationConfig
) -> tuple[tuple[EpisodeSpec, ...], tuple[ExcludedEpisode, ...]]:
    """List the episodes of one home, filtered as in Habitat.

    A path exists and is not trivially short. All episodes are on the floor of the first start pose.
    The draws depend on the seed, the home's name and the goal alone, so that other goals or more
    homes change no episode.

    Args:
        scene: The home.
        home: Its name in rows: seed or folder.
        robot: Decides which viewpoints are reachable and see the goal.
        config: Which episodes to list.

    Returns:
        The episodes, and the searches that were excluded.
    """
    grid, sight = robot_grid(scene, robot), LineOfSight(scene)
    episodes: list[EpisodeSpec] = []
    dropped: list[ExcludedEpisode] = []
    goals = _drawn_goals(scene, home, config, dropped)
    for goal, colour in _with_colours(scene, home, goals, config, dropped):
        then = _next_goal(home, goal, goals, config) if config.second_object else ""
        judge = Judge(scene, robot, goal, colour=colour, grid=grid, sight=sight)
        rng = _rng(config.seed, home_name(home), *filter(None, (colour, goal)))
        drop = partial(_drop, dropped, home, goal)
        taken = 0
        for index in rng.permutation(len(scene.start_poses)).tolist():
            if taken == config.starts_per_goal:
                break
            if abs(scene.start_poses[index].z - scene.start_poses[0].z) > robot.max_step_m:
                drop("another floor", index)
                continue
            d0 = judge.shortest_path_m(scene.start_poses[index])
            if not np.isfinite(d0):
                drop("no way", index)
                continue
            if d0 < config.min_shortest_path_m:
                drop("starts too near", index)
                continue
            taken += 1
            specs = _specs(scene, home, judge, goal, index, d0, config)
            episodes += [replace(spec, then=then) for spec in specs]
        if taken < config.starts_per_goal:
            drop("no start left", None)
    return tuple(episodes), tuple(dropped)


def _drop(
    dropped: list[ExcludedEpisode], home: str, goal: str, reason: Reason, start_index: int | None
) -> None:
    dropped.append(ExcludedEpisode(home=home, goal=goal, start_index=start_index, reason=reason))


def _with_colours(
    scene: Scene,
    home: str,
    goals: Sequence[str],
    config: EpisodeGenerationConfig,
    dropped: list[ExcludedEpisode],
) -> list[tuple[str, str]]:
    """Return the goals, each with every colour that tells it from others of its kind, or none."""
    if not config.colours:
        return [(goal, "") for goal in goals]
    pairs: list[tuple[str, str]] = []
    for goal in goals:
        colours = telling_colours(scene, matching_instances(scene, goal))
        pairs += [(goal, colour) for colour in colours]
        if not colours:
            _drop(dropped, home, goal, "one colour", None)
    return pairs


def _drawn_goals(
    scene: Scene, home: str, config: EpisodeGenerationConfig, dropped: list[ExcludedEpisode]
) -> list[str]:
    """Return the goals in the home: all Habitat ones and a draw of the others."""
    present: list[str] = []
    for goal in dict.fromkeys(canonical_label(g) for g in config.goals):
        if matching_instances(scene, goal):
            present.append(goal)
        else:
            _drop(dropped, home, goal, "absent", None)
    common = [g for g in present if g in HABITAT_GOALS]
    # Each goal has its own random number, so that adding a goal does not change the others.
    lots = {
        g: float(_rng(config.seed, home_name(home), g).random()) for g in present if g not in common
    }
    return common + sorted(lots, key=lambda g: lots[g])[: config.small_per_home]


def _next_goal(home: str, goal: str, goals: list[str], config: EpisodeGenerationConfig) -> str:
    """Draw the second goal from the home's other goals; empty if there are none."""
    others = [g for g in goals if g != goal]
    lots = {g: float(_rng(config.seed, home_name(home), goal, g).random()) for g in others}
    return min(others, key=lambda g: lots[g], default="")


def _specs(
    scene: Scene,
    home: str,
    judge: Judge,
    goal: str,
    index: int,
    d0: float,
    config: EpisodeGenerationConfig,
) -> list[EpisodeSpec]:
    """Return one episode, or two with context "both", for a goal and a start."""
    start, sentences = scene.start_poses[index], [""]
    if config.context != "none" and goal not in HABITAT_GOALS:
        # Of several instances, the one at the end of the shortest path.
        meant = judge.nearest_instance((start.x, start.y))
        sentence_of = room_sentence if config.context == "room" else context_sentence
        told = None if meant is None else sentence_of(scene, meant)
        if told is not None:
            sentences = [told] if config.context == "support" else ["", told]
    names = [*filter(None, (judge.colour, goal)), str(index)]
    seed = int(_rng(config.seed, home_name(home), *names).integers(2**31))
    return [
        EpisodeSpec(
            home=home,
            start_index=index,
            start=start,
            goal=goal,
            context=sentence,
            colour=judge.colour,
            seed=seed,
            shortest_path_m=d0,
        )
        for sentence in sentences
    ]


def home_name(home: str) -> str:
    """Return a seed unchanged, or the last part of a folder's path."""
    return home.rstrip("/").rsplit("/", maxsplit=1)[-1]


def home_file_name(home: str) -> str:
    """Return a home's name as it is used in episode names and file names."""
    return "".join(c if c.isalnum() or c in "_-" else "_" for c in home_name(home))


def _rng(seed: int, *names: str) -> np.random.Generator:
    words = [zlib.crc32(name.encode()) for name in names]
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *words])))


def goals_of(kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the goals for some words: "habitat", "small", or labels.

    Args:
        kinds: For example ("habitat", "hat", "couch"); the last becomes "sofa".

    Raises:
        ValueError: A kind holds no word.
    """
    out: list[str] = []
    for kind in kinds:
        if kind == "habitat":
            out += HABITAT_GOALS
        elif kind == "small":
            out += SMALL_GOALS
        else:
            out.append(resolve_object(kind, MATTERPORT_40).canonical)
    return tuple(dict.fromkeys(out))


def draw_episodes(episodes: Sequence[EpisodeSpec], limit: int | None) -> list[EpisodeSpec]:
    """Draw a number of episodes, mixing homes and objects; a larger limit only adds episodes.

    The versions with and without a context are drawn together, so that they can be compared: the
    last is left out where its other version is beyond the limit.

    Args:
        episodes: Of any homes.
        limit: Maximum number, at least 1; None for all.

    Returns:
        The drawn episodes, in their original order.
    """
    if limit is None or limit >= len(episodes):
        return list(episodes)
    order = sorted(episodes, key=lambda e: (zlib.crc32(e.id_without_context.encode()), e.context))
    names = [e.id_without_context for e in order]
    if limit > 1 and names[limit - 1] == names[limit] != names[limit - 2]:
        limit -= 1
    chosen = {e.episode_id for e in order[:limit]}
    return [e for e in episodes if e.episode_id in chosen]
