"""`ippon segment`: the segmentation of a robot's images, here or on the robot."""

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from app.cli.options.nodes import Segment
from app.cli.options.segmentation import Segmentation
from app.errors import UsageError
from app.links.network.session import LinkError, check_client
from app.process.parent_watch import end_with_parent
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.loading import load_segmenter
from ippon.segmentation.model_registry import models_of

if TYPE_CHECKING:
    from ippon.segmentation.segmenter import Segmenter

logger = logging.getLogger(__name__)


def run_segment_command(command: Segment) -> int:
    """Load the network, then segment images until the process is stopped."""
    end_with_parent(command.parent_pid)
    from app.nodes.segment import SegmentConfig, run_segment

    try:
        config = SegmentConfig(
            connect=command.connect, robot=command.robot, keep=command.keep_labels
        )
        check_client(command.connect)
    except (ValueError, LinkError) as error:
        raise UsageError(str(error)) from error
    segmenter = segmenter_of(command.segmentation)
    try:
        run_segment(config, segmenter)
    except LinkError as error:
        raise UsageError(str(error)) from error
    return 0


def segmenter_of(options: Segmentation) -> "Segmenter":
    """Load the network that the options name.

    Raises:
        UsageError: It cannot be loaded; the text says how to fix it.
    """
    folder = options.models or models_folder()
    try:
        config = config_of(options)
        fetch_models(config, folder)
        logger.info("loading %s", config.model or config.backend)
        return load_segmenter(config, folder)
    except (SegmentationError, ValueError) as error:
        raise UsageError(str(error)) from error


def fetch_models(config: SegmentationConfig, folder: Path) -> None:
    """Fetch missing models from the hub."""
    try:
        from app.links.model_hub import fetch_missing
    except ImportError:  # Loading reports the missing packages.
        return
    fetch_missing(models_of(config), folder)


def config_of(options: Segmentation) -> SegmentationConfig:
    """Return the library's configuration.

    Raises:
        ValueError: A size is invalid.
    """
    return SegmentationConfig(
        backend=options.backend,
        model=options.model,
        masks_model=options.masks_model,
        device=options.device,
        precision=options.precision,
        compile=options.compile,
        longest_side_px=options.longest_side_px,
        short_side_px=options.short_side_px,
        small_objects=options.small_objects,
        labels_file=options.labels_file,
        family=options.family,
        threads=options.threads,
        input_px=options.input_px,
    )


def arguments_of(options: Segmentation) -> list[str]:
    """Return the options as arguments of `ippon segment`."""
    named = {
        "backend": options.backend,
        "model": options.model,
        "masks-model": options.masks_model,
        "device": options.device,
        "precision": options.precision,
        "longest-side-px": str(options.longest_side_px),
        "short-side-px": str(options.short_side_px),
        "models": str(options.models or ""),
        "labels-file": options.labels_file,
        "family": options.family,
        "threads": str(options.threads),
        "input-px": str(options.input_px),
    }
    flags = {
        "compile": options.compile,
        "small-objects": options.small_objects,
    }
    written = [part for k, v in named.items() if v for part in (f"--segmentation.{k}", v)]
    return [*written, *(f"--segmentation.{'' if on else 'no-'}{k}" for k, on in flags.items())]


def models_folder() -> Path:
    """Return the folder of the checkpoints."""
    return platformdirs.user_data_path("ippon") / "models"
