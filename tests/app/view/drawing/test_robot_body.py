import numpy as np
import pytest

from app.messages.body import BodySphere
from app.view.drawing.robot_body import body_mesh


def test_spheres_above_each_other_are_one_capsule():
    spheres = [BodySphere(x_m=0.1, y_m=0.0, z_m=z, radius_m=0.25) for z in (0.3, 0.5, 0.95)]
    vertices, faces = body_mesh(spheres)
    assert vertices.min(axis=0) == pytest.approx([-0.15, -0.25, 0.05], abs=1e-6)
    assert vertices.max(axis=0) == pytest.approx([0.35, 0.25, 1.2], abs=1e-6)
    assert faces.max() == len(vertices) - 1
    # Closed, and its faces look outwards: the volume is that of the capsule, less the corners.
    a, b, c = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    exact = np.pi * 0.25**2 * 0.65 + 4.0 / 3.0 * np.pi * 0.25**3
    assert 0.93 * exact < volume < exact


def test_spheres_beside_each_other_stay_apart():
    spheres = [BodySphere(x_m=x, y_m=0.0, z_m=0.3, radius_m=0.1) for x in (-1.0, 1.0)]
    vertices, faces = body_mesh(spheres)
    halves = vertices[:, 0] < 0.0
    assert halves.sum() == len(vertices) // 2
    assert (halves[faces].sum(axis=1) % 3 == 0).all()
