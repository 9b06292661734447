"""What a piece of furniture is before it has a place: mesh, name, and where things can lie."""

from dataclasses import dataclass

from ippon.simulation.homes.furniture.mesh_builder import Mesh, MeshBuilder


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """A level patch that things can lie on, in the frame of the model that has it."""

    x0: float
    y0: float
    x1: float
    y1: float
    z: float
    kind: str
    """What it belongs to: table, counter, bedside, desk, seat, bed, shelf, sink, floor."""
    headroom_m: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A shape with its name; x runs along its width about 0, y from its back (0) to its front."""

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
        """Height of its top above z = 0, where it stands or hangs."""
        return float(self.mesh.vertices[:, 2].max())


def make_model(
    category: str, label: str, builder: MeshBuilder, surfaces: tuple[Surface, ...] = ()
) -> Model:
    """Finish a builder into a model."""
    return Model(category=category, label=label, mesh=builder.build(), surfaces=surfaces)
