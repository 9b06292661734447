"""Rows of a benchmark's table, for people and for programs."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass


@dataclass(frozen=True, kw_only=True)
class Row:
    """One measurement, beside a peer's where there is one."""

    name: str
    data: str
    voxel_size_m: float | None = None
    median_ms: float | None = None
    peer: str | None = None
    peer_median_ms: float | None = None
    value: float | None = None
    """What is not a time, in `unit`."""
    unit: str | None = None
    note: str | None = None
    """What else was measured, such as a standard error; it differs between runs, unlike the rest
    of what is no figure."""

    @property
    def ratio(self) -> float | None:
        """How many times slower the peer is."""
        if self.median_ms is None or self.peer_median_ms is None:
            return None
        return self.peer_median_ms / self.median_ms


def as_json(rows: Sequence[Row]) -> str:
    """Return one JSON object a line."""
    lines = []
    for row in rows:
        entry = {k: v for k, v in asdict(row).items() if v is not None or k in _ALWAYS}
        lines.append(json.dumps({**entry, "ratio": row.ratio}))
    return "\n".join(lines)


_ALWAYS = ("name", "data", "voxel_size_m", "median_ms", "peer", "peer_median_ms")


def as_table(rows: Sequence[Row]) -> str:
    """Return a Markdown table."""
    lines = [
        "| what | data | voxel | this | peer | ratio |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        size = "" if row.voxel_size_m is None else f"{100 * row.voxel_size_m:g} cm"
        mine = f"{row.median_ms:.2f} ms" if row.median_ms is not None else ""
        if row.value is not None:
            mine = f"{row.value:.4g} {row.unit or ''}".strip()
        mine += f" ({row.note})" if row.note else ""
        peer = "" if row.peer is None else f"{row.peer}: {row.peer_median_ms:.2f} ms"
        ratio = "" if row.ratio is None else f"{row.ratio:.1f}x"
        lines.append(f"| {row.name} | {row.data} | {size} | {mine} | {peer} | {ratio} |")
    return "\n".join(lines)
