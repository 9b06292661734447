"""Configuration of an evaluation."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationConfig:
    """Homes, objects, methods and limits of an evaluation."""

    out: Path
    """Folder for the results; made when it is not there."""
    homes: tuple[str, ...] = ("1001:1010",)
    """Seeds of generated homes, single or first:last (the last included), those of floors of large
    buildings, floor:3 or floor:1:9, and folders with scene.glb and scene.json."""
    methods: str = "ippon"
    """Names with commas between; "ablations", "baselines" and "all" stand for many."""
    objects: str = "habitat,small"
    """Labels with commas between; "habitat" stands for its six categories, "small" for ten small
    objects."""
    context: Literal["none", "support", "both"] = "none"
    """support: tell the searcher truthfully on what a small object lies; both: search once with
    and once without."""
    robot: str = "habitat"
    """habitat: robot, limits and 500 s of the Habitat ObjectNav Challenge 2023; zed: the set-up of
    the paper's hardware; or your own robot's profile, a YAML file (`ippon profile`), under the
    limits of zed."""
    image_width: int | None = None
    """Width of the camera's images in pixels; half of the challenge's 480 for habitat, else 320."""
    voxel_size_m: float = 0.1
    """Edge of a voxel."""
    segmentation_errors: Literal["detector", "paper"] = "detector"
    """detector: the simulated network finds boxes with scores, and misses and mistakes things as
    often as a real detector on real images; paper: it gives label probabilities of each pixel, with
    the kind of errors that the paper describes."""
    second_object: bool = False
    """When a search has ended, search for another object of the home from there: once on the map
    that is there, once with an empty one. For `ippon` and its ablations, nearest_frontier and
    greedy_nbv."""
    starts: int = 1
    """Start poses for each object of a home."""
    small_per_home: int = 3
    """Small objects drawn for each home."""
    min_path_m: float = 1.0
    """Least length of the shortest way to the object; more asks for longer searches."""
    max_time_s: float | None = None
    """Simulated seconds after which a search is given up; 500 for habitat, else 300."""
    limit: int | None = None
    """At most so many episodes, drawn from all homes and objects, those with and without a context
    together; each method runs all of them."""
    seed: int = 0
    """Draws starts, objects and the noise of each search."""
    workers: int | None = None
    """Processes that search at the same time: 1, and with --ray one for each processor of the
    cluster."""
    ray: tuple[str, ...] | None = None
    """Search on a Ray cluster: its address, or nothing for one on this machine. Needs
    `pip install "ippon[ray]"`."""
