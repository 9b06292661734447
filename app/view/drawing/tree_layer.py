"""The viewpoint tree in the scene, in the colours of the paper's Fig. 2."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.view.colors import linear, node_colors
from app.view.drawing.line_segments import draw_segments
from ippon.planning.plan import NodeKind, TreeView

HEIGHT_M: Final = 0.3
"""Height at which nodes are drawn, where furniture does not hide them."""

_RADIUS_M: Final = 0.07
_EDGE_COLOR: Final = linear(np.array([148, 156, 168], dtype=np.uint8))
_LOOK_M: Final = 0.26


def _sphere() -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return an icosahedron subdivided once, round enough for spheres of a few pixels."""
    phi = (1.0 + 5.0**0.5) / 2.0
    v = [[-1, phi, 0], [1, phi, 0], [-1, -phi, 0], [1, -phi, 0], [0, -1, phi], [0, 1, phi]]
    v += [[0, -1, -phi], [0, 1, -phi], [phi, 0, -1], [phi, 0, 1], [-phi, 0, -1], [-phi, 0, 1]]
    faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4]]
    faces += [[11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8]]
    faces += [[3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]]
    points = [np.array(p, dtype=np.float64) for p in v]
    divided: list[list[int]] = []
    for a, b, c in faces:
        ab, bc, ca = len(points), len(points) + 1, len(points) + 2
        points += [points[a] + points[b], points[b] + points[c], points[c] + points[a]]
        divided += [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
    unit = np.stack([p / np.linalg.norm(p) for p in points])
    return unit.astype(np.float32), np.array(divided, dtype=np.uint32)


class TreeLayer:
    """Draws edges as lines and viewpoints as spheres with a tick in the viewing direction."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._nodes: Any = None
        self._lines: Any = None
        self._looks: Any = None

    def draw(self, tree: TreeView | None, visible: bool) -> None:
        """Replace the tree; one without nodes hides it."""
        if tree is None or not len(tree.parents) or not visible:
            for handle in (self._nodes, self._lines, self._looks):
                if handle is not None:
                    handle.visible = False
            return
        positions = tree.positions_world + np.array([0.0, 0.0, HEIGHT_M], dtype=np.float32)
        colors = linear(node_colors(tree.kinds, tree.gains))
        self._draw_nodes(positions, colors, tree.kinds)
        child = np.flatnonzero(tree.parents >= 0)
        edges = np.stack([positions[tree.parents[child]], positions[child]], axis=1)
        self._lines = draw_segments(
            self._scene, self._lines, "/tree/edges", edges, _EDGE_COLOR, 0.018
        )
        facing = np.stack(
            [np.cos(tree.yaws_rad), np.sin(tree.yaws_rad), np.zeros_like(tree.yaws_rad)], axis=1
        )
        exploring = tree.kinds != NodeKind.MINIMAL
        ends = positions + facing * np.float32(_LOOK_M)
        ticks = np.stack([positions, ends], axis=1)[exploring]
        tick_colors = np.repeat(colors[exploring][:, None, :], 2, axis=1)
        self._looks = draw_segments(
            self._scene, self._looks, "/tree/views", ticks, tick_colors, 0.03
        )

    def _draw_nodes(
        self, positions: NDArray[np.float32], colors: NDArray[np.uint8], kinds: NDArray[np.uint8]
    ) -> None:
        wxyzs = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(positions), 1))
        scales = np.where(kinds == NodeKind.TERMINATING, 1.5, 1.0).astype(np.float32) * _RADIUS_M
        scales[0] *= 1.3
        if self._nodes is None:
            vertices, faces = _sphere()
            self._nodes = self._scene.add_batched_meshes_simple(
                "/tree/nodes",
                vertices,
                faces,
                wxyzs,
                positions,
                batched_scales=scales,
                batched_colors=colors,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
            )
            return
        self._nodes.batched_wxyzs = wxyzs
        self._nodes.batched_positions = positions
        self._nodes.batched_scales = scales
        self._nodes.batched_colors = colors
        self._nodes.visible = True
