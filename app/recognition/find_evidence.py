"""Evidence for a find: contributions by viewing place, and the images that show it best."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.recognition.recognition import Recognition
from app.recognition.views import View
from ippon.calibration.evidence import Evidence, EvidenceCollector
from ippon.calibration.known_objects import KnownObject, KnownObjects
from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import invert_transform
from ippon.mission.snapshot import Find
from ippon.observation import Instance
from ippon.segmentation.instance_heatmap import heatmap_of_instances

MOST_IMAGES: Final = 4
"""Number of images shown per find, from different places if possible."""
_SECTOR_RAD: Final = math.radians(15.0)
_ALIKE_NATS: Final = 0.3
"""Difference of log-odds up to which voxels are as probable as each other: 0.03 at p 0.9."""
_LEAST_DOUBT: Final = 1e-4
"""Least distance of a probability from 0 and 1, so that its log-odds are finite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceSaid:
    """Evidence for a find from the images of one place."""

    direction: str
    """Such as "from 90°, nearer than 2 m"."""
    images: int
    nats: float
    """Log-odds in nats; positive for the object."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """An image that shows a find or a detection."""

    view: View
    pixel: tuple[float, float]
    """Distance of the find's centre, or of the middle of the box."""
    distance_m: float
    instance: Instance | None
    """Instance of the network there; None without one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FindEvidence:
    """Evidence for a find."""

    prior_nats: float
    """Log-odds of the prior."""
    places: tuple[PlaceSaid, ...]
    """Contributions to a voxel near the find's centre that is as probable as the find, strongest
    first."""
    in_good_view: int
    """Number of images in which the network recognised it, or could be expected to."""
    sightings: tuple[Sighting, ...]


def explain(
    recognition: Recognition, finds: Mapping[str, Sequence[Find]]
) -> dict[str, list[FindEvidence]]:
    """Return the evidence for the finds of each object.

    Args:
        recognition: Recognition after all frames.
        finds: Finds of each object, in the map's world.
    """
    labels = [label for label, some in finds.items() if some]
    if not labels:
        return {label: [] for label in finds}
    collector = _collected(recognition, labels)
    prior = -math.log(len(recognition.map_of(labels[0]).labels))
    return {
        label: [_explained(recognition, collector, label, find, prior) for find in some]
        for label, some in finds.items()
    }


def _collected(recognition: Recognition, labels: Sequence[str]) -> EvidenceCollector:
    """Return what all views say of some objects."""
    config = recognition.map_of(labels[0]).config
    collector = EvidenceCollector(labels, config.voxel_size_m, config.ooi_max_range_m)
    for view in recognition.views:
        detections = view.with_masks()
        if detections is not None:
            frame = _frame_of(view)
            heatmap = heatmap_of_instances(detections, frame.depth, apart=recognition.apart)
            collector.add(frame, heatmap)
    return collector


def _explained(
    recognition: Recognition, collector: EvidenceCollector, label: str, find: Find, prior: float
) -> FindEvidence:
    seen = [(view, view.pixel_of(find.position_world)) for view in recognition.views]
    sightings = [
        Sighting(
            view=view,
            pixel=at[:2],
            distance_m=at[2],
            instance=view.instance_at(label, at[0], at[1]),
        )
        for view, at in seen
        if at is not None
    ]
    return FindEvidence(
        prior_nats=prior,
        places=_places(recognition, collector, label, find, prior),
        in_good_view=sum(
            view.shows(label, find.position_world) is not None for view in recognition.views
        ),
        sightings=_best(sightings),
    )


def best_detection(recognition: Recognition, label: str) -> Sighting | None:
    """Return the image with the highest score of an object without find."""
    best: Sighting | None = None
    for view in recognition.views:
        for one in () if view.detections is None else view.detections.instances:
            if one.label != label or (
                best is not None and best.instance is not None and one.score <= best.instance.score
            ):
                continue
            u, v = 0.5 * (one.box_px[0] + one.box_px[2]), 0.5 * (one.box_px[1] + one.box_px[3])
            best = Sighting(view=view, pixel=(u, v), distance_m=view.depth_at(u, v), instance=one)
    return best


def _frame_of(view: View) -> Frame:
    """Return the frame of a view, with the pixels whose depth is stored."""
    T_world_camera = invert_transform(view.T_camera_world)
    (h, w), camera, step = view.depth.shape, view.camera, view.step
    return Frame(
        stamp_ns=view.number,
        color=np.zeros((h, w, 3), np.uint8),
        depth=view.depth.astype(np.float32),
        camera=PinholeCamera(
            width=w,
            height=h,
            fx=camera.fx / step,
            fy=camera.fy / step,
            cx=camera.cx / step,
            cy=camera.cy / step,
        ),
        T_world_camera=T_world_camera,
        T_world_base=T_world_camera,
        tilt_rad=0.0,
    )


def _places(
    recognition: Recognition, collector: EvidenceCollector, label: str, find: Find, prior: float
) -> tuple[PlaceSaid, ...]:
    here = KnownObject(
        label=label,
        centre_world=find.position_world,
        about_m=min(max(find.size_m), 20.0),
    )
    evidence = collector.evidence(KnownObjects(objects=(here,)), np.eye(4))
    if not evidence:
        return ()
    detections = next(v.detections for v in recognition.views if v.detections is not None)
    table = recognition.models.of_source(detections.source, "scores").table_of(label)
    p = min(max(find.probability, _LEAST_DOUBT), 1.0 - _LEAST_DOUBT)
    expected = math.log(p / (1.0 - p)) - prior
    return places_of_voxel(evidence[0], np.exp(table.log_ratios("scores")), expected)


def places_of_voxel(
    evidence: Evidence, likelihood: NDArray[np.float32], expected_nats: float
) -> tuple[PlaceSaid, ...]:
    """Return the evidence by place of a voxel whose places add up to the expected nats.

    Of voxels that fit alike it is the one that most images show.

    Args:
        evidence: Voxels of a find, and some around it that do not belong to it.
        likelihood: (256,) likelihood ratio of each heatmap value.
        expected_nats: Log-odds of the find beyond the prior.
    """
    nats = np.log(evidence.values @ likelihood)
    sums = np.add.reduceat(nats, evidence.first)
    off = np.abs(sums - expected_nats)
    images = np.add.reduceat(evidence.images, evidence.first)
    chosen = int(np.argmax(np.where(off <= off.min() + _ALIKE_NATS, images, -1)))
    ends = np.append(evidence.first, len(nats))
    rows = range(int(ends[chosen]), int(ends[chosen + 1]))
    said = [
        PlaceSaid(
            direction=_direction(int(evidence.place[row])),
            images=int(evidence.images[row]),
            nats=float(nats[row]),
        )
        for row in rows
    ]
    return tuple(sorted(said, key=lambda one: -abs(one.nats)))


def _direction(place: int) -> str:
    """Return the description of a place, see `ippon.mapping.objects.places.place_of`."""
    distance = "farther than 2 m" if place % 2 else "nearer than 2 m"
    if place >= 48:
        return f"from {'above' if place >= 50 else 'below'}, {distance}"
    quadrant, sector = divmod(place // 2, 6)
    degrees = 15.0 * sector + 7.5
    x_sign, y_sign = (-1 if quadrant & 1 else 1), (-1 if quadrant & 2 else 1)
    angle = math.degrees(
        math.atan2(
            y_sign * math.sin(math.radians(degrees)), x_sign * math.cos(math.radians(degrees))
        )
    )
    return f"from {angle % 360.0:.0f}°, {distance}"


def _best(sightings: Sequence[Sighting]) -> tuple[Sighting, ...]:
    """Return the sightings with the highest scores, then the nearest, from different places."""
    ranked = sorted(
        sightings,
        key=lambda one: (-(one.instance.score if one.instance else 0.0), one.distance_m),
    )
    chosen: list[Sighting] = []
    for apart_rad in (_SECTOR_RAD, 0.0):
        for one in ranked:
            if len(chosen) == MOST_IMAGES:
                break
            if all(one is not other and _angle(one, other) >= apart_rad for other in chosen):
                chosen.append(one)
    return tuple(chosen)


def _angle(a: Sighting, b: Sighting) -> float:
    """Return the angle between the optical axes of two images, radians."""
    axes = [one.view.T_camera_world[2, :3] for one in (a, b)]
    return math.acos(min(1.0, max(-1.0, float(axes[0] @ axes[1]))))
