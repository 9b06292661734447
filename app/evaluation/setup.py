"""Methods, trial and episode catalogue of an evaluation's configuration."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Final

from app.configuration import changed
from app.evaluation.config import EvaluationConfig
from app.evaluation.errors import EvaluationError
from app.robot_file import PROFILES, map_config, read_profile
from ippon.evaluation.episode import EpisodeLimits
from ippon.evaluation.episode_generation import EpisodeGenerationConfig, goals_of
from ippon.evaluation.methods.method_table import ABLATIONS, BASELINES, METHODS, method_named
from ippon.evaluation.trial import TrialConfig, config_hash, habitat_trial
from ippon.mapping.config import MapConfig
from ippon.mission.config import MissionConfig
from ippon.robot import HABITAT, RobotProfile
from ippon.simulation.segmentation.attribute_errors import AttributeErrorConfig

ZED_IMAGE_WIDTH: Final = 320
HABITAT_IMAGE_WIDTH: Final = 240


def expand_methods(text: str) -> tuple[str, ...]:
    """Return the methods named by a text, without duplicates.

    Raises:
        EvaluationError: There is no such method; the text lists them.
    """
    groups = {"all": tuple(METHODS), "ablations": ABLATIONS, "baselines": BASELINES}
    names: list[str] = []
    for part in (p.strip() for p in text.split(",") if p.strip()):
        names += groups.get(part, (part,))
    try:
        found = tuple(dict.fromkeys(method_named(name).name for name in names))
    except ValueError as error:
        raise EvaluationError(f"{error}; groups are {', '.join(groups)}") from error
    if not found:
        raise EvaluationError(f"no methods; there are {', '.join(METHODS)}")
    return found


def trial_of(
    config: EvaluationConfig,
    profile: RobotProfile | None = None,
    mission_changes: Mapping[str, Any] | None = None,
) -> TrialConfig:
    """Return the setup shared by all methods.

    Args:
        config: The evaluation.
        profile: Used instead of the profile of `config.robot`.
        mission_changes: Fields of `MissionConfig` that differ from their defaults.

    Raises:
        ValueError: The configuration is invalid.
    """
    if config.image_width is not None and not 32 <= config.image_width <= 4096:
        raise ValueError(f"--image-width lies in 32 to 4096; got {config.image_width}")
    robot = profile or read_profile(config.robot)
    if robot == HABITAT:
        trial = habitat_trial(config.image_width or HABITAT_IMAGE_WIDTH)
    else:
        trial = TrialConfig(
            robot=robot,
            image_width=config.image_width or ZED_IMAGE_WIDTH,
            limits=EpisodeLimits(time_step_s=0.2, max_time_s=300.0),
        )
    if config.max_time_s is not None:
        limits = dataclasses.replace(trial.limits, max_time_s=config.max_time_s)
        trial = dataclasses.replace(trial, limits=limits)
    voxels = MapConfig(voxel_size_m=config.voxel_size_m)
    if robot not in PROFILES.values():
        voxels = map_config(robot, config.voxel_size_m)
    mission = changed(MissionConfig(map=voxels), mission_changes or {}, ("mission",))
    world = dataclasses.replace(trial.world, segmentation_errors=config.segmentation_errors)
    if config.attributes:
        errors = AttributeErrorConfig(rate=config.attribute_error_rate)
        world = dataclasses.replace(world, attribute_errors=errors)
    return dataclasses.replace(trial, mission=mission, world=world)


def catalogue_of(config: EvaluationConfig) -> EpisodeGenerationConfig:
    """Return the catalogue of the episodes; raises ValueError."""
    return EpisodeGenerationConfig(
        goals=goals_of([g.strip() for g in config.objects.split(",") if g.strip()]),
        starts_per_goal=config.starts,
        small_per_home=config.small_per_home,
        context=config.context,
        colours=config.attributes,
        second_object=config.second_object,
        min_shortest_path_m=config.min_path_m,
        seed=config.seed,
    )


def check_request(config: EvaluationConfig, methods: tuple[str, ...]) -> None:
    """Check counts and combinations; raises EvaluationError."""
    for name, value in (("workers", config.workers), ("limit", config.limit)):
        if value is not None and value < 1:
            raise EvaluationError(f"--{name} is at least 1; got {value}")
    single = [name for name in methods if not method_named(name).supports_second_goal]
    if config.second_object and single:
        raise EvaluationError(
            f"{', '.join(single)} cannot search for a second object; remove them from --methods, "
            f"or remove --second-object"
        )
    if config.ray is not None and len(config.ray) > 1:
        raise EvaluationError(f"--ray takes one address; got {', '.join(config.ray)}")


def settings_of(
    config: EvaluationConfig,
    trial: TrialConfig,
    methods: tuple[str, ...],
    version: str,
    mission_changes: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the settings stored beside the rows, which suffice to repeat the run."""
    return {
        "fixed": {
            # Absent without changes and with the paper's errors, for folders of earlier versions.
            **({"mission": dict(mission_changes)} if mission_changes else {}),
            **(
                {"segmentation_errors": config.segmentation_errors}
                if config.segmentation_errors != "paper"
                else {}
            ),
            **({"attribute_error_rate": config.attribute_error_rate} if config.attributes else {}),
            "seed": config.seed,
            "robot": config.robot,
            "image_width": trial.image_width,
            "voxel_size_m": config.voxel_size_m,
            "max_time_s": config.max_time_s,
        },
        "command": {
            k: [str(p) for p in v] if isinstance(v, tuple) else str(v)
            for k, v in dataclasses.asdict(config).items()
            if k not in {"out", "config"}
        },
        "version": version,
        "configurations": {
            name: {
                "hash": config_hash(trial, method_named(name)),
                "trial": dataclasses.asdict(
                    dataclasses.replace(trial, mission=method_named(name).configure(trial.mission))
                ),
            }
            for name in methods
        },
    }
