"""A piece of furniture without a position: mesh, name, and surfaces for other objects."""

from dataclasses import dataclass

from ippon.simulation.homes.furniture.mesh_builder import Mesh, MeshBuilder


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """A level surface for objects, in the frame of its model; metres."""

    x0: float
    y0: float
    x1: float
    y1: float
    z: float
    kind: str
    """What it is part of: table, counter, bedside, desk, seat, bed, shelf, sink, floor."""
    headroom_m: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A named mesh; x runs along its width, centred, and y from its back (0) to its front."""

    category: str
    label: str
    mesh: Mesh
    surfaces: tuple[Surface, ...] = ()

    @property
    def width_m(self) -> float:
        """Extent along x."""
        v = self.mesh.vertices
        return float(v[:, 0].max() - v[:, 0].min())

    @property
    def depth_m(self) -> float:
        """Extent from the back, y = 0, to the front."""
        return float(self.mesh.vertices[:, 1].max())

    @property
    def height_m(self) -> float:
        """Height of the top above z = 0."""
        return float(self.mesh.vertices[:, 2].max())


def make_model(
    category: str, label: str, builder: MeshBuilder, surfaces: tuple[Surface, ...] = ()
) -> Model:
    """Return the model of a finished builder."""
    return Model(category=category, label=label, mesh=builder.build(), surfaces=surfaces)
