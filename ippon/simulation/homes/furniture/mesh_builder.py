"""Coloured triangle meshes, built from simple solids."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]

BOX_FACES = np.array(
    [
        [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
        [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
    ]
)  # fmt: skip
"""Triangles of a box whose corners are listed as the low ring, then the high ring."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Triangles of one object."""

    vertices: NDArray[np.float64]
    """(V, 3) metres."""
    faces: NDArray[np.int64]
    """(F, 3) rows of `vertices`."""
    colors: NDArray[np.uint8]
    """(F, 3) RGB."""

    def moved(self, x: float, y: float, z: float, yaw: float) -> "Mesh":
        """Turn by `yaw` radians about z, then shift by (x, y, z) metres."""
        c, s = math.cos(yaw), math.sin(yaw)
        v = self.vertices
        moved = np.stack(
            [c * v[:, 0] - s * v[:, 1] + x, s * v[:, 0] + c * v[:, 1] + y, v[:, 2] + z], axis=1
        )
        return Mesh(vertices=moved, faces=self.faces, colors=self.colors)


class MeshBuilder:
    """Collects solids; each method adds one and returns the builder."""

    def __init__(self) -> None:
        self._vertices: list[NDArray[np.float64]] = []
        self._faces: list[NDArray[np.int64]] = []
        self._colors: list[NDArray[np.uint8]] = []
        self._count = 0

    def build(self) -> Mesh:
        """Return all solids as one mesh."""
        return Mesh(
            vertices=np.concatenate(self._vertices),
            faces=np.concatenate(self._faces),
            colors=np.concatenate(self._colors),
        )

    def add(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int64], color: Color
    ) -> "MeshBuilder":
        """Add (V, 3) vertices and (F, 3) faces in one colour."""
        self._vertices.append(vertices)
        self._faces.append(faces + self._count)
        self._colors.append(np.tile(np.array(color, np.uint8), (len(faces), 1)))
        self._count += len(vertices)
        return self

    def add_mesh(self, mesh: Mesh) -> "MeshBuilder":
        """Add another mesh with its own colours."""
        self._vertices.append(mesh.vertices)
        self._faces.append(mesh.faces + self._count)
        self._colors.append(mesh.colors)
        self._count += len(mesh.vertices)
        return self

    def box(
        self,
        low: tuple[float, float, float],
        high: tuple[float, float, float],
        color: Color,
        *,
        taper: float = 0.0,
        faces: dict[str, Color] | None = None,
    ) -> "MeshBuilder":
        """Add an upright box whose top is `taper` metres narrower on every side.

        Args:
            low: Lowest corner.
            high: Highest corner.
            color: Colour of all sides not named in `faces`.
            taper: Metres by which the top is smaller than the bottom on each side.
            faces: Colours of single sides: "bottom", "top", "low_y", "high_x", "high_y", "low_x".
        """
        (x0, y0, z0), (x1, y1, z1) = low, high
        t = taper
        vertices = np.array(
            [
                [x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0],
                [x0 + t, y0 + t, z1], [x1 - t, y0 + t, z1],
                [x1 - t, y1 - t, z1], [x0 + t, y1 - t, z1],
            ]
        )  # fmt: skip
        self.add(vertices, BOX_FACES, color)
        for side, rgb in (faces or {}).items():
            k = ("bottom", "top", "low_y", "high_x", "high_y", "low_x").index(side)
            self._colors[-1][2 * k : 2 * k + 2] = rgb
        return self

    def block(
        self, center_x: float, y0: float, z0: float, size: tuple[float, float, float], color: Color
    ) -> "MeshBuilder":
        """Add a box of `size` centred on x, its back at y0 and its bottom at z0."""
        w, d, h = size
        low = (center_x - w / 2, y0, z0)
        return self.box(low, (center_x + w / 2, y0 + d, z0 + h), color)

    def frustum(
        self,
        center: tuple[float, float],
        z: tuple[float, float],
        radius: tuple[float, float],
        color: Color,
        *,
        sides: int = 10,
        top_color: Color | None = None,
    ) -> "MeshBuilder":
        """Add an upright round solid.

        Args:
            center: Its axis, (x, y).
            z: Height of its two ends, lower first.
            radius: Radius at the two ends.
            color: Colour of mantle and lower end.
            sides: Number of flat sides of the mantle.
            top_color: Colour of the upper end.
        """
        angle = 2.0 * math.pi * np.arange(sides) / sides
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        rings = [
            np.column_stack([ring * r + center, np.full(sides, h)])
            for r, h in zip(radius, z, strict=True)
        ]
        ends = np.array([[*center, z[0]], [*center, z[1]]])
        i = np.arange(sides)
        j = (i + 1) % sides
        low, high = 2 * sides, 2 * sides + 1
        mantle = np.concatenate(
            [np.stack([i, j, j + sides], axis=1), np.stack([i, j + sides, i + sides], axis=1)]
        )
        bottom = np.stack([j, i, np.full(sides, low)], axis=1)
        top = np.stack([i + sides, j + sides, np.full(sides, high)], axis=1)
        self.add(np.concatenate([*rings, ends]), np.concatenate([mantle, bottom, top]), color)
        if top_color is not None:
            self._colors[-1][-sides:] = top_color
        return self

    def ball(
        self,
        center: tuple[float, float, float],
        radius: tuple[float, float, float],
        color: Color,
        *,
        sides: int = 8,
        rings: int = 5,
    ) -> "MeshBuilder":
        """Add an ellipsoid with semi-axes `radius`."""
        polar = math.pi * np.arange(1, rings) / rings
        around = 2.0 * math.pi * np.arange(sides) / sides
        p, a = np.meshgrid(polar, around, indexing="ij")
        unit = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=2)
        unit = np.concatenate([unit.reshape(-1, 3), [[0, 0, 1.0], [0, 0, -1.0]]])
        i = np.arange(sides)
        j = (i + 1) % sides
        top, bottom = (rings - 1) * sides, (rings - 1) * sides + 1
        faces = [np.stack([np.full(sides, top), i, j], axis=1)]
        for k in range(rings - 2):
            a0, b0 = k * sides, (k + 1) * sides
            faces.append(np.stack([a0 + i, b0 + i, b0 + j], axis=1))
            faces.append(np.stack([a0 + i, b0 + j, a0 + j], axis=1))
        last = (rings - 2) * sides
        faces.append(np.stack([np.full(sides, bottom), last + j, last + i], axis=1))
        return self.add(unit * radius + center, np.concatenate(faces), color)

    def rod(
        self,
        start: tuple[float, float, float],
        end: tuple[float, float, float],
        thickness: float,
        color: Color,
    ) -> "MeshBuilder":
        """Add a square rod between two points."""
        a, b = np.array(start), np.array(end)
        along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
        helper = np.array([0.0, 0.0, 1.0]) if abs(along[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
        u = np.cross(along, helper)
        u *= 0.5 * thickness / np.linalg.norm(u)
        v = np.cross(along, u)
        corners = [-u - v, u - v, u + v, -u + v]
        vertices = np.array([a + c for c in corners] + [b + c for c in corners])
        return self.add(vertices, BOX_FACES, color)

    def leaf(
        self,
        base: tuple[float, float, float],
        tip: tuple[float, float, float],
        width: float,
        color: Color,
    ) -> "MeshBuilder":
        """Add a flat pointed leaf, folded along its middle to be visible from every side."""
        a, b = np.array(base), np.array(tip)
        side = np.cross(b - a, [0.0, 0.0, 1.0])
        norm = float(np.linalg.norm(side))
        side = np.array([1.0, 0.0, 0.0]) if norm < 1e-6 else side / norm
        middle = 0.55 * a + 0.45 * b
        rib = middle - (0.0, 0.0, 0.15 * width)
        vertices = np.array([a, middle + 0.5 * width * side, b, middle - 0.5 * width * side, rib])
        faces = np.array([[0, 4, 1], [4, 2, 1], [0, 3, 4], [4, 3, 2]])
        return self.add(vertices, faces, color)
