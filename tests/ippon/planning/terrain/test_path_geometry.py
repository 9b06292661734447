"""Paths as points."""

import numpy as np

from ippon.planning.terrain.path_geometry import rejoined_path, remaining_path


def test_what_is_left_of_a_path_begins_at_the_robot():
    path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    np.testing.assert_allclose(
        remaining_path(path, 0.4, -0.1), [(0.4, -0.1), (1.0, 0.0), (1.0, 1.0)]
    )
    np.testing.assert_allclose(remaining_path(path, 1.0, 0.5), [(1.0, 0.5), (1.0, 1.0)])


def test_a_robot_rejoins_its_path_farther_ahead():
    path = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    np.testing.assert_allclose(
        rejoined_path(path, 0.4, -0.1, 0.2), [(0.4, -0.1), (0.6, 0.0), (1.0, 0.0), (1.0, 1.0)]
    )
    np.testing.assert_allclose(
        rejoined_path(path, 0.9, -0.1, 0.2), [(0.9, -0.1), (1.0, 0.1), (1.0, 1.0)]
    )
    np.testing.assert_allclose(rejoined_path(path, 1.1, 0.9, 0.2), [(1.1, 0.9), (1.0, 1.0)])
