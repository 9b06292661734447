"""Recognition of requested objects in a recording, with network and map."""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from app.recognition.frames import FrameSource
from app.recognition.views import View
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.guidance.language.naming import resolve_object, same_object
from ippon.mapping.config import MapConfig
from ippon.mapping.goal_layers.goal_arrays import MAX_GOALS
from ippon.mapping.goal_layers.goal_layers import GoalLayers, OoiTarget
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.finds.clusters import cluster_finds
from ippon.mission.finds.image_check import ImageCheckConfig
from ippon.mission.finds.size_check import SizeCheck, SizeCheckConfig
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find
from ippon.observation import Detections, HeatmapKind, Observation
from ippon.observation_model import ObservationModels
from ippon.planning.surface_scale import surface_scale
from ippon.segmentation.detectors.vocabulary import closed_vocabulary
from ippon.segmentation.instance_heatmap import as_heatmap, objects_apart
from ippon.segmentation.segmenter import Segmenter
from ippon.tracking.upright import UprightCheck
from ippon.vocabulary import MATTERPORT_40, in_words

VOXEL_SIZE_M: Final = 0.05
FIND_THRESHOLD: Final = 0.5
"""Probability from which a voxel belongs to a find."""
SURE: Final = 0.99
IMAGE_CHECK: Final = ImageCheckConfig()
"""Shares of the images that show a find well which must recognise it, as before a search ends."""
LIKELY: Final = 0.75
"""Probability from which a small find needs the smaller share; lower admits more wrong finds."""

PLAUSIBLE_M: Final = (0.2, 20.0)
"""Range of the median depth of a recording of rooms; others tell of a wrong unit."""
DEPTH_STEP: Final = 8
"""Pixels between those whose depth is looked at for it."""

Observe = Callable[[Frame, Sequence[str]], Observation]


@dataclass(frozen=True, slots=True, kw_only=True)
class RecognisedFind:
    """A found object."""

    position_world: tuple[float, float, float]
    """Centre in metres, in the recording's world."""
    size_m: float
    """Longest side of the bounding box of its voxels, metres."""
    probability: float
    """Mean probability of its voxels."""
    images: int
    """Number of images that show it; 0 for a network without instances."""
    voxels: int

    def as_dict(self) -> dict[str, Any]:
        """Return the find as `ippon recognise --json` prints it."""
        return {
            "position_world": [round(x, 3) for x in self.position_world],
            "size_m": round(self.size_m, 3),
            "probability": round(self.probability, 4),
            "images": self.images,
        }


class Recognition:
    """Integrates frames, then returns the finds.

    Each object is an object of interest from the first frame on and is read for itself, so that
    probabilities are the same whatever else is requested. A map takes eight of them. Unlike in a
    search, all images within range count, however small the object is in them, and all heights.

    Args:
        objects: Labels that the network gives the requested objects, see `labels_of`.
        models: Observation models of the networks.
        voxel_size_m: Edge length of a voxel.
        memory_limit_mb: Memory limit of each map.
    """

    def __init__(
        self,
        objects: Sequence[str],
        models: ObservationModels | None = None,
        *,
        voxel_size_m: float = VOXEL_SIZE_M,
        memory_limit_mb: float = 512.0,
    ) -> None:
        self.labels = tuple(dict.fromkeys((*MATTERPORT_40, *objects)))
        self.models = models or ObservationModels()
        self._config = MapConfig(voxel_size_m=voxel_size_m, memory_limit_mb=memory_limit_mb)
        self._objects = tuple(dict.fromkeys(objects))
        self.apart = objects_apart(self._objects)
        """Objects that are read each for itself, see `heatmap_of_instances`."""
        self._maps: list[VoxelMap] = []
        self._goals: list[GoalLayers] = []
        self._finds: dict[str, tuple[Find, ...]] = {}
        self.views: list[View] = []
        """Views of the integrated frames."""
        self._last: Frame | None = None
        self.frames = 0
        """Number of frames received."""
        self.refused = 0
        """Number of refused frames."""
        self.refusal = ""
        """Why the last of them was refused."""
        self.boxes = 0
        """Number of boxes of the network that were used."""
        self.invalid_boxes = 0
        """Number of those that were not, see `Detections.dropped`."""
        self._depths_m: list[float] = []
        self.upright = UprightCheck()
        """Whether the images are upside down."""
        self.dropped = 0
        """Number of map blocks dropped for lack of memory."""

    def _begin(self, kind: HeatmapKind) -> None:
        # Probabilities sum to 1 over all labels that the network was asked for.
        told_apart = MATTERPORT_40 if kind == "scores" else self.labels
        for first in range(0, len(self._objects), MAX_GOALS):
            targets = [OoiTarget(label=x) for x in self._objects[first : first + MAX_GOALS]]
            self._maps.append(VoxelMap(self._config, told_apart, self.models))
            self._goals.append(GoalLayers(self._maps[-1], targets))

    def add(self, frame: Frame, observation: Observation) -> None:
        """Integrate a frame with the network's output.

        Raises:
            ValueError: The network does not give the label of an object.
        """
        given = (*observation.labels, observation.ooi)
        if missing := [label for label in self._objects if label not in given]:
            raise ValueError(
                f"the network does not give the label {', '.join(missing)}: `labels_of` returns "
                "the one that it gives an object, such as tv for a monitor"
            )
        number, self.frames = self.frames, self.frames + 1
        if isinstance(observation, Detections):
            self.boxes += len(observation.instances)
            self.invalid_boxes += observation.dropped
        self._finds.clear()
        heatmap = as_heatmap(observation, frame.depth, apart=self.apart)
        if not self._maps:
            self._begin(heatmap.kind)
        seen = replace(frame, heatmap=heatmap)
        try:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                updates = list(pool.map(lambda one: one.integrate(seen), self._maps))
        except FrameRejectedError as error:
            self.refused += 1
            self.refusal = str(error)
            return
        self.upright.add(frame)
        some = frame.depth[::DEPTH_STEP, ::DEPTH_STEP]
        self._depths_m.append(float(np.median(some[some > 0.0])) if (some > 0.0).any() else 0.0)
        self.dropped += sum(update.blocks_dropped for update in updates)
        self._last = frame
        self.views.append(View.of(number, frame, observation))

    @property
    def depth_note(self) -> str:
        """What a user should know of the images' depth; empty if it is that of a room."""
        known = [depth_m for depth_m in self._depths_m if depth_m > 0.0]
        if not self._depths_m or (known and PLAUSIBLE_M[0] <= np.median(known) <= PLAUSIBLE_M[1]):
            return ""
        if not known:
            return "no image has any depth: nothing can be found"
        return (
            f"the depth of the images is {round(float(np.median(known)), 3):g} m (median), so that "
            "little or nothing can be found: is its unit right (`depth_unit_m`)?"
        )

    def map_of(self, label: str) -> VoxelMap:
        """Return the map that an object is in, once a frame was given."""
        return self._maps[self._objects.index(label) // MAX_GOALS]

    def finds(self, label: str) -> tuple[Find, ...]:
        """Return the finds that would end a search for an object, most probable first.

        A find has the size of one, and is recognised in enough of the images that show it well.

        Args:
            label: One of the objects.
        """
        if self._last is None:
            return ()
        if label not in self._finds:
            self._finds[label] = self._judged(label, self._last)
        return self._finds[label]

    def _judged(self, label: str, last: Frame) -> tuple[Find, ...]:
        goals = self._goals[self._objects.index(label) // MAX_GOALS]
        centres, probabilities = goals.layer(label).voxels(FIND_THRESHOLD)
        size = self._config.voxel_size_m
        finds = cluster_finds(
            centres, probabilities, size, camera=last.camera, T_world_camera=last.T_world_camera
        )
        words = in_words(label)
        category = resolve_object(words, MATTERPORT_40).category
        goal = Goal(goal_id=0, object=label, display=words, category=category)
        check = SizeCheck(SizeCheckConfig(), goal, size)
        right = [find for find in finds if _is_large_enough(check, find)]
        small_voxels = IMAGE_CHECK.outline_voxels * surface_scale(size) if check.small else 0.0
        right = [find for find in right if self._is_recognised(label, find, small_voxels)]
        return tuple(sorted(right, key=lambda find: -find.probability))

    def _is_recognised(self, label: str, find: Find, small_voxels: float) -> bool:
        """Tell whether enough of the images that show a find well recognise it there.

        An object that is misread from one place is not recognised from the others. Networks that
        give no instances are not asked.
        """
        shown = [view.shows(label, find.position_world) for view in self.views]
        told = [one for one in shown if one is not None]
        is_small = find.voxels <= small_voxels and find.probability >= LIKELY
        needed = IMAGE_CHECK.least_share_small if is_small else IMAGE_CHECK.least_share
        return not told or sum(told) >= needed * len(told)

    def images(self, label: str, find: Find) -> int:
        """Return the number of images that show a find."""
        return sum(view.shows(label, find.position_world) is True for view in self.views)


def labels_of(segmenter: Segmenter, objects: Sequence[str]) -> dict[str, str]:
    """Return the label that a network gives each object, without objects that it does not know.

    An object may have the label of a class with several names: a monitor that of tv. A network that
    takes any words is asked for a thing by one of its names, as a couch and a sofa would compete.

    Args:
        segmenter: The network.
        objects: Canonical labels.
    """
    vocabulary = closed_vocabulary(segmenter)
    labels = tuple(dict.fromkeys((*MATTERPORT_40, *objects)))
    if vocabulary is None:
        return {name: next(x for x in labels if same_object(name, x)) for name in objects}
    found = {name: vocabulary.label_for(name, labels) for name in objects}
    return {name: label for name, label in found.items() if label is not None}


def given_labels(
    segmenter: Segmenter, source: FrameSource, label_of: Mapping[str, str]
) -> dict[str, str]:
    """Return the objects whose label a network gives for the first frame, with their labels.

    For a network of another package that has no `vocabulary`, and still may know few labels.

    Args:
        segmenter: The network.
        source: The recording.
        label_of: Label of each object, see `labels_of`.

    Raises:
        DatasetError: The recording cannot be read.
        SegmentationError: The network failed.
    """
    frame = next(source.frames(), None)
    if frame is None or closed_vocabulary(segmenter) is not None:
        return dict(label_of)
    labels = tuple(dict.fromkeys((*MATTERPORT_40, *label_of.values())))
    given = segmenter.segment(frame.color, labels, None).labels
    return {name: label for name, label in label_of.items() if label in given}


def recognise(
    source: FrameSource,
    recognition: Recognition,
    observe: Observe,
    progress: Callable[[int], None],
) -> None:
    """Integrate all frames of a recording.

    Args:
        source: The recording.
        recognition: Receives the frames.
        observe: Runs the network with the recognition's labels.
        progress: Called with the number of frames that are done.

    Raises:
        DatasetError: The recording cannot be read.
        SegmentationError: The network failed.
    """
    for n, frame in enumerate(source.frames(), 1):
        recognition.add(frame, observe(frame, recognition.labels))
        progress(n)


def in_own_world(
    recognition: Recognition, label: str, T_map_world: Float64Array
) -> list[RecognisedFind]:
    """Return the finds of an object in the recording's world, most probable first."""
    T_world_map = invert_transform(T_map_world)
    found: list[RecognisedFind] = []
    for find in recognition.finds(label):
        x, y, z = transform_points(T_world_map, np.array([find.position_world]))[0]
        found.append(
            RecognisedFind(
                position_world=(float(x), float(y), float(z)),
                size_m=max(find.size_m),
                probability=find.probability,
                images=recognition.images(label, find),
                voxels=find.voxels,
            )
        )
    return found


def _is_large_enough(check: SizeCheck, find: Find) -> bool:
    if check.small:
        return find.voxels >= check.termination_min and not check.is_too_large(find)
    return not check.is_too_little(find, sure=find.probability >= SURE)
