"""`scripts/benchmark NAME [--json]`."""

import argparse
import os
import sys
from collections.abc import Iterator

from tests.benchmarks.rows import Row, as_json, as_table


def map_rows(frame_count: int, quick: bool) -> Iterator[Row]:
    """Measure the map; results are compared with the peers' before times count."""
    from tests.benchmarks import frames, map_quality, map_speed

    sets = frames.available(frame_count)
    if "redkitchen" not in sets:
        sys.stderr.write(f"left out: the recorded kitchen is not at {frames.KITCHEN}\n")
    for voxel_size in (0.1, 0.05):
        for name, images in sets.items():
            yield from map_speed.speed_rows(name, images, voxel_size)
    if quick:
        return
    yield from map_speed.growth_rows(sets["home"][:20], 0.1)
    yield from map_speed.start_rows()
    for voxel_size in (0.1, 0.05):
        yield from map_quality.quality_rows(voxel_size)


def guidance_rows(_: int, __: bool) -> Iterator[Row]:
    """Measure common sense; there is nothing to choose."""
    from tests.benchmarks import guidance

    yield from guidance.guidance_rows()


def console_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure the page's opening, what drawing costs, and the console with an hour's messages."""
    from tests.benchmarks import console_colours, console_load, console_page

    yield from console_page.page_rows()
    yield from console_page.drawing_rows()
    yield from console_colours.colour_rows()
    yield from console_load.load_rows(300 if quick else 3600)


def detector_rows(_: int, __: bool) -> Iterator[Row]:
    """Measure the errors of a real detector, and of the simulated one."""
    from tests.benchmarks import detector_errors

    yield from detector_errors.detector_rows()


def planner_rows(_: int, __: bool) -> Iterator[Row]:
    """Measure single viewpoints, and the planner on a large floor; there is nothing to choose."""
    from tests.benchmarks import large_floor, viewpoint_cost

    yield from viewpoint_cost.viewpoint_rows()
    yield from large_floor.planner_rows()


def level_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure what the levels of viewpoints tell of where the object is."""
    from tests.benchmarks import level_information

    yield from level_information.level_rows(5 if quick else 40)


def exploring_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure how directly methods bring things into view."""
    from tests.benchmarks import exploring

    yield from exploring.exploring_rows(3 if quick else 20)


def segmentation_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure networks with random weights, heatmap messages and second passes."""
    from tests.benchmarks import segmentation

    yield from segmentation.segmentation_rows(quick)


def second_day_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure what memory saves on the second day in a home."""
    from tests.benchmarks import second_day

    yield from second_day.second_day_rows(3 if quick else 27)


def tour_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure what a tour saves, and what each of its objects costs the map."""
    from tests.benchmarks import tour

    yield from tour.tour_rows(3 if quick else 20)


def tracking_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure the pose of a camera from its images alone."""
    from tests.benchmarks import tracking

    yield from tracking.tracking_rows(20 if quick else 200)


def kitchen_rows(_: int, __: bool) -> Iterator[Row]:
    """Measure what a real detector finds in a real kitchen."""
    from tests.benchmarks import kitchen

    yield from kitchen.kitchen_rows()


def session_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure the processes and messages of one search, and its recording."""
    from tests.benchmarks import session

    yield from session.session_rows(20.0 if quick else 60.0, 300.0 if quick else 3600.0)


def fleet_rows(_: int, quick: bool) -> Iterator[Row]:
    """Measure many robots on one router."""
    from tests.benchmarks import fleet

    for images in ("kitchen", "home"):
        yield from fleet.depth_rows(images)
    for robots, images in ((20, "kitchen"), (20, "home")) if quick else FLEETS:
        yield from fleet.fleet_rows(robots, images)


FLEETS = ((1, "kitchen"), (20, "kitchen"), (40, "kitchen"), (1, "home"), (20, "home"))
BENCHMARKS = {
    "console": console_rows,
    "detector": detector_rows,
    "exploring": exploring_rows,
    "fleet": fleet_rows,
    "guidance": guidance_rows,
    "kitchen": kitchen_rows,
    "levels": level_rows,
    "map": map_rows,
    "planner": planner_rows,
    "second-day": second_day_rows,
    "session": session_rows,
    "segmentation": segmentation_rows,
    "tour": tour_rows,
    "tracking": tracking_rows,
}


def main() -> None:
    """Run one benchmark on one core and print its rows, or all and write their figures."""
    parser = argparse.ArgumentParser(prog="scripts/benchmark")
    parser.add_argument(
        "name",
        choices=[*sorted(BENCHMARKS), "all"],
        help="all: run every one several times, write docs/figures.md, and say what has moved",
    )
    parser.add_argument(
        "--runs", type=int, default=3, help="of all: how often each is run; one run knows no noise"
    )
    parser.add_argument(
        "--searches", action="store_true", help="of all: those with simulated searches too (hours)"
    )
    parser.add_argument("--only", help="of all: these alone, with commas")
    parser.add_argument("--json", action="store_true", help="one object a row")
    parser.add_argument("--frames", type=int, default=60, help="frames of each data set")
    parser.add_argument("--quick", action="store_true", help="times only")
    options = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    if options.name == "all":
        _run_all(options)
        return
    rows = list(BENCHMARKS[options.name](options.frames, options.quick))
    sys.stdout.write((as_json(rows) if options.json else as_table(rows)) + "\n")


def _run_all(options: argparse.Namespace) -> None:
    from tests.benchmarks.figures import KEPT, PAGE, SEARCHES, TIMES, regenerate

    parts = (*TIMES, *SEARCHES) if options.searches else TIMES
    if options.only is not None:
        parts = tuple(options.only.split(","))
        unknown = sorted(set(parts) - set(BENCHMARKS))
        if unknown:
            sys.exit(f"--only: there is no {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    moved = regenerate(parts, options.runs, lambda text: sys.stderr.write(f"{text}\n"))
    lines = [f"written: {PAGE.name} and {KEPT.name} in {PAGE.parent}"]
    lines += ["moved:", *moved] if moved else ["nothing has moved by more than its noise"]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
