"""The page of `ippon recognise --page`: each find with its images and its evidence."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.recognition.find_evidence import FindEvidence, Sighting, best_detection, explain
from app.recognition.frames import FrameSource
from app.recognition.pictures import crop, plan
from app.recognition.recognition import FIND_THRESHOLD, RecognisedFind, Recognition, in_own_world
from app.report_style import REPORT_STYLE

_MOST_PLACES: Final = 8
"""Maximum rows of the table of places; the rest is summed."""
_STYLE: Final = """
.images{display:flex;flex-wrap:wrap;gap:12px;margin:8px 0}
figure{margin:0;font-size:13px;color:var(--dim)}figure img{display:block;border-radius:4px}
.plan{max-width:100%;border-radius:4px;image-rendering:pixelated}
.find{border-top:1px solid var(--line);padding-top:8px;margin-top:24px}
.find table{width:auto;min-width:420px}
@media(max-width:600px){th,td{white-space:normal}.find table{min-width:0}}
"""
_Images = Mapping[int, tuple[NDArray[np.uint8], str]]
_LEGEND: Final = (
    "A place is a direction from the find to the camera, by compass of the plan (0° is its right, "
    "90° its top), nearer or farther than 2 m. Nats are log-odds: 0 is p 0.5, 2.2 is p 0.9, and "
    "what speaks against it is negative. The table is that of one voxel, with the images that show "
    "that voxel; the images of a place count once, by their mean."
)


@dataclass(frozen=True, slots=True)
class _Section:
    """Section of the page for one object."""

    name: str
    finds: list[RecognisedFind]
    explanations: list[FindEvidence]
    best: Sighting | None
    """Highest score of an object without find."""


def page_of(
    recognition: Recognition,
    source: FrameSource,
    objects: Sequence[str],
    label_of: Mapping[str, str],
    network: str,
) -> str:
    """Return the page of a recording.

    Args:
        recognition: Recognition after all frames.
        source: The recording, read again for its images.
        objects: Requested objects.
        label_of: Label of each object; objects that the network does not recognise are missing.
        network: Name of the network.

    Raises:
        DatasetError: The recording can no longer be read.
    """
    sections: list[_Section] = []
    # Words for one class have the same finds.
    marks: dict[tuple[float, float, float], list[str]] = {}
    in_map = {label: recognition.finds(label) for label in label_of.values()}
    explained = explain(recognition, in_map)
    count = 0
    for name, label in label_of.items():
        finds = in_own_world(recognition, label, source.T_map_world)
        best = None if finds else best_detection(recognition, label)
        sections.append(_Section(name, finds, explained[label], best))
        for one in in_map[label]:
            count += 1
            marks[one.position_world] = [*marks.get(one.position_world, []), str(count)]
    images = _images(source, sections)
    numbers = iter(range(1, count + 1))
    has_instances = any(view.detections is not None for view in recognition.views)
    parts = [
        f"<h1>{escape(source.path.name)}</h1>",
        f'<p class="dim">{recognition.frames} images through {escape(network)}'
        + (f", {recognition.refused} refused" if recognition.refused else "")
        + f". A find is surface with a probability of {FIND_THRESHOLD:g} or more, of a size that "
        "the object can have, recognised in enough of the images that show it well. In the images, "
        f"the box is the network's, and the circle is the centre of the find. {_world(source)}</p>",
        _overview(sections, [name for name in objects if name not in label_of]),
        _plan(
            recognition,
            source,
            next(iter(label_of.values()), None),
            [(", ".join(texts), at) for at, texts in marks.items()],
        ),
        f'<p class="dim">{_LEGEND}</p>' if marks else "",
        *(_section(one, images, numbers, has_instances=has_instances) for one in sections),
    ]
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>{escape(source.path.name)}: what was recognised</title>"
        f"<style>{REPORT_STYLE}{_STYLE}</style><body>{''.join(parts)}</body></html>\n"
    )


def _world(source: FrameSource) -> str:
    """Return which frame the positions are in."""
    if source.track:
        return (
            "Positions are metres in a frame of the tracking's own: z up, floor at 0, origin near "
            "the first image that shows the floor."
        )
    if source.dataset is None:
        return f"Positions are metres in the frame {escape(source.poses.world)!r}."
    return "Positions are metres in the world of the recording's own poses."


def _images(source: FrameSource, sections: Sequence[_Section]) -> _Images:
    """Return the images that the page shows and their names, by their number."""
    wanted = {
        one.view.number
        for section in sections
        for explanation in section.explanations
        for one in explanation.sightings
    } | {section.best.view.number for section in sections if section.best is not None}
    if not wanted:
        return {}
    images: dict[int, tuple[NDArray[np.uint8], str]] = {}
    for n, frame in enumerate(source.frames()):
        if n in wanted:
            images[n] = (np.asarray(frame.color), source.image_name(frame))
        if len(images) == len(wanted):
            break
    return images


def _overview(sections: Sequence[_Section], untold: Sequence[str]) -> str:
    rows: list[str] = []
    for one in sections:
        best = f"{one.finds[0].probability:.2f}" if one.finds else "–"
        rows.append(
            f"<tr><td>{escape(one.name)}</td><td>{len(one.finds) or 'none'}</td><td>{best}</td>"
            f"<td>{(one.finds and one.finds[0].images) or '–'}</td></tr>"
        )
    rows += [
        f'<tr><td>{escape(name)}</td><td colspan="3">this network does not recognise it</td></tr>'
        for name in untold
    ]
    return (
        "<table><tr><th>object</th><th>finds</th><th>probability of the first</th>"
        f"<th>images with it</th></tr>{''.join(rows)}</table>"
    )


def _plan(
    recognition: Recognition,
    source: FrameSource,
    label: str | None,
    marks: Sequence[tuple[str, tuple[float, float, float]]],
) -> str:
    if label is None or not recognition.views:
        return ""
    picture = plan(recognition.map_of(label), marks)
    if picture is None:
        return ""
    same = np.allclose(source.T_map_world, np.eye(4))
    axes = ", x to the right, y up" if same else " after its world was turned upright"
    return (
        "<h2>From above</h2>"
        f'<img class="plan" src="{picture}" alt="The place from above, with the finds">'
        f'<p class="dim">Surface below 1.9 m in its colour, seen from above{axes}; one square is '
        f"{100 * recognition.map_of(label).config.voxel_size_m:g} cm. Numbers are those of the "
        "finds below.</p>"
    )


def _section(
    section: _Section, images: _Images, numbers: Iterator[int], *, has_instances: bool
) -> str:
    head = f"<h2>{escape(section.name)}</h2>"
    if section.finds:
        return head + "".join(
            _find(next(numbers), find, why, images)
            for find, why in zip(section.finds, section.explanations, strict=True)
        )
    if not has_instances:
        return head + "<p>No find.</p>"
    if section.best is None or section.best.instance is None:
        return head + "<p>No find. The network recognised it in no image.</p>"
    return (
        head + f"<p>No find. The highest score in any image is {section.best.instance.score:.2f}:"
        f'</p><div class="images">{_figure(section.best, images)}</div>'
    )


def _find(
    number: int,
    find: RecognisedFind,
    why: FindEvidence,
    images: _Images,
) -> str:
    x, y, z = find.position_world
    figures = "".join(_figure(one, images) for one in why.sightings)
    share = f" Recognised in {find.images} of the {why.in_good_view} images that show it well."
    return (
        f'<div class="find"><b>{number}. p {find.probability:.2f}</b> at ({x:.2f}, {y:.2f}, '
        f"{z:.2f}) m, {find.size_m:.2f} m long.{share if why.in_good_view else ''}"
        f'<div class="images">{figures}</div>{_reasons(why)}</div>'
    )


def _reasons(why: FindEvidence) -> str:
    if not why.places:
        return ""
    total = why.prior_nats + sum(one.nats for one in why.places)
    rows = [("before any image", "", why.prior_nats)]
    rows += [(one.direction, str(one.images), one.nats) for one in why.places[:_MOST_PLACES]]
    rest = why.places[_MOST_PLACES:]
    if rest:
        images = str(sum(one.images for one in rest))
        rows.append((f"{len(rest)} more places", images, sum(one.nats for one in rest)))
    rows.append((f"together: p {1.0 / (1.0 + math.exp(-total)):.3f}", "", total))
    body = "".join(
        f"<tr><td>{text}</td><td>{images}</td><td>{nats:+.1f}</td></tr>"
        for text, images, nats in rows
    )
    return (
        "<table><tr><th>why, for a voxel of it, by viewing place</th><th>images</th>"
        f"<th>nats</th></tr>{body}</table>"
    )


def _figure(sighting: Sighting, images: _Images) -> str:
    if sighting.view.number not in images:
        return ""
    color, name = images[sighting.view.number]
    score = "" if sighting.instance is None else f", score {sighting.instance.score:.2f}"
    distance = f", {sighting.distance_m:.1f} m away" if sighting.distance_m > 0.0 else ""
    return (
        f'<figure><img src="{crop(color, sighting)}" alt="">{escape(name)}{score}'
        f"{distance}</figure>"
    )
