"""Recognition of requested objects in a recording, with network and map."""

import os
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from app.recognition.frames import FrameSource
from app.recognition.views import View
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.guidance.language.naming import resolve_object
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.finds.clusters import cluster_finds
from ippon.mission.finds.image_check import ImageCheckConfig
from ippon.mission.finds.size_check import SizeCheck, SizeCheckConfig
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find
from ippon.observation import Heatmap, HeatmapKind, Observation
from ippon.observation_model import ObservationModels
from ippon.planning.surface_scale import surface_scale
from ippon.segmentation.instance_heatmap import heatmap_of_instances
from ippon.vocabulary import MATTERPORT_40

VOXEL_SIZE_M: Final = 0.05
FIND_THRESHOLD: Final = 0.5
"""Probability from which a voxel belongs to a find."""
SURE: Final = 0.99
IMAGE_CHECK: Final = ImageCheckConfig()
"""Shares of the images that show a find well which must recognise it, as before a search ends."""
LIKELY: Final = 0.75
"""Probability from which a small find needs the smaller share; lower admits more wrong finds."""

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

    Each object has its own map with it as the object of interest from the first frame on, so that
    probabilities equal those of a search, whatever else is requested.

    Args:
        objects: Canonical labels of the requested objects.
        models: Observation models of the networks.
        voxel_size_m: Edge length of a voxel.
        memory_limit_mb: Memory limit of the map of each object.
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
        self._maps: dict[str, VoxelMap] = {}
        self._finds: dict[str, tuple[Find, ...]] = {}
        self.views: list[View] = []
        """Views of the integrated frames."""
        self._last: Frame | None = None
        self.frames = 0
        """Number of frames received."""
        self.refused = 0
        """Number of refused frames."""
        self.dropped = 0
        """Number of map blocks dropped for lack of memory."""

    def _map_for(self, name: str, kind: HeatmapKind) -> VoxelMap:
        # Probabilities sum to 1 over all labels that the network was asked for.
        told_apart = MATTERPORT_40 if kind == "scores" else self.labels
        others = [label for label in told_apart if label != name]
        voxel_map = VoxelMap(self._config, others, self.models)
        voxel_map.set_ooi(name)
        return voxel_map

    def add(self, frame: Frame, observation: Observation) -> None:
        """Integrate a frame with the network's output."""
        number, self.frames = self.frames, self.frames + 1
        self._finds.clear()
        heatmap = _heatmap(observation, frame)
        if not self._maps:
            self._maps = {name: self._map_for(name, heatmap.kind) for name in self._objects}

        def fuse(name: str) -> int:
            voxel_map = self._maps[name]
            own = replace(frame, heatmap=asked_for(heatmap, name, voxel_map.labels))
            return voxel_map.integrate(own).blocks_dropped

        try:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                self.dropped += sum(pool.map(fuse, self._maps))
        except FrameRejectedError:
            self.refused += 1
            return
        self._last = frame
        self.views.append(View.of(number, frame, observation))

    def map_of(self, label: str) -> VoxelMap:
        """Return the map of an object, once a frame was given."""
        return self._maps[label]

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
        centres, probabilities = OoiVoxels(FIND_THRESHOLD).update(self._maps[label].arrays())
        size = self._config.voxel_size_m
        finds = cluster_finds(
            centres, probabilities, size, camera=last.camera, T_world_camera=last.T_world_camera
        )
        words = label.replace("_", " ")
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


def asked_for(heatmap: Heatmap, name: str, others: Collection[str]) -> Heatmap:
    """Return a heatmap with one of its labels as object of interest; without it, with none.

    Args:
        heatmap: Without an object of interest.
        name: The label; where the heatmap lacks it, the heatmap stays without.
        others: Labels that are kept beside it.
    """
    kept = [k for k, label in enumerate(heatmap.labels) if label != name and label in others]
    own = [heatmap.labels.index(name)] if name in heatmap.labels else []
    return replace(
        heatmap,
        labels=tuple(heatmap.labels[k] for k in kept),
        ooi=name if own else None,
        probabilities=np.ascontiguousarray(heatmap.probabilities[..., [*kept, *own]]),
    )


def _heatmap(observation: Observation, frame: Frame) -> Heatmap:
    return (
        observation
        if isinstance(observation, Heatmap)
        else heatmap_of_instances(observation, frame.depth)
    )


def _is_large_enough(check: SizeCheck, find: Find) -> bool:
    if check.small:
        return find.voxels >= check.termination_min and not check.is_too_large(find)
    return not check.is_too_little(find, sure=find.probability >= SURE)
