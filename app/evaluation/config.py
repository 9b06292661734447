"""Configuration of an evaluation."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationConfig:
    """Homes, objects, methods and limits of an evaluation."""

    out: Path
    """Folder for the results; it is created if missing."""
    homes: tuple[str, ...] = ("1001:1010",)
    """Homes: seeds of generated homes, single or first:last (inclusive); seeds of floors of large
    buildings, floor:3 or floor:1:9; folders with scene.glb and scene.json; NAME:TEXT for scenes
    that another package adds, as the last of a list: commas behind it belong to TEXT."""
    methods: str = "ippon"
    """Comma-separated names, or the groups "ablations", "baselines" and "all"; mine@power=2 is a
    method of your own with another value of its parameter."""
    objects: str = "habitat,small"
    """Comma-separated labels, or the groups "habitat" (its six categories) and "small" (ten small
    objects)."""
    context: Literal["none", "support", "both", "room"] = "none"
    """support: give the correct sentence about what a small object lies on; both: search with and
    without it; room: search with and without the room that a small object is in."""
    robot: str = "habitat"
    """habitat: robot, limits and 500 s of the Habitat ObjectNav Challenge 2023; zed: the setup of
    the paper; or a robot profile in YAML (`ippon profile`), with the limits of zed."""
    image_width: int | None = None
    """Width of the camera's images in pixels; by default half of the challenge's 480 for habitat,
    else 320."""
    voxel_size_m: float = 0.1
    """Edge length of a voxel."""
    segmentation_errors: Literal["detector", "paper"] = "detector"
    """detector: the simulated network gives boxes with scores, with the error rates of a real
    detector on real images; paper: it gives label probabilities per pixel, with the errors that the
    paper describes."""
    attributes: bool = False
    """Search for each object by the colours that tell it from others of its kind in the home, such
    as the red one of several mugs (`--objects mug`); generated homes get three mugs more, of
    different colours. Success only at an object of the colour; the method no_colour_check takes
    the first of its kind."""
    attribute_error_rate: float = 0.1
    """With --attributes: share of objects and views in which the simulated camera shows an object
    in another colour; half of the variance is constant over the views of an object."""
    second_object: bool = False
    """After each search, search for a second object from the final pose: once with the existing
    map, once with an empty one. For `ippon` and its ablations, nearest_frontier and greedy_nbv."""
    starts: int = 1
    """Start poses per object of a home."""
    small_per_home: int = 3
    """Small objects sampled per home."""
    min_path_m: float = 1.0
    """Minimum length of the shortest path to the object; larger values give longer searches."""
    max_time_s: float | None = None
    """Simulated seconds after which a search ends; by default 500 for habitat, else 300."""
    limit: int | None = None
    """Maximum number of episodes, sampled from all homes and objects, with pairs with and without
    context kept together; every method runs all of them."""
    seed: int = 0
    """Seed of start poses, objects and noise."""
    workers: int | None = None
    """Number of worker processes; by default 1, with --ray one per processor of the cluster."""
    ray: tuple[str, ...] | None = None
    """Run on a Ray cluster: its address, or no value for one on this machine. Requires `pip install
    "ippon[ray]"`."""
