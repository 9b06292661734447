import numpy as np

from ippon.simulation.camera.line_of_sight import LineOfSight


def test_occluders_hide_a_point_and_its_own_surface_does_not(furnished):
    sight = LineOfSight(furnished)
    eye = np.array([1.0, 1.6, 1.2])
    hat_top, hat_side = [2.95, 1.65, 0.65], [2.8, 1.6, 0.6]
    table_under, behind_wall = [3.0, 1.7, 0.0], [-0.5, 1.0, 1.0]
    points = np.array([hat_top, hat_side, table_under, behind_wall])
    assert sight.is_clear(eye, points).tolist() == [True, True, False, False]


def test_each_point_may_have_its_own_eye(furnished):
    sight = LineOfSight(furnished)
    eyes = np.array([[1.0, 1.0, 1.0], [3.0, 1.7, 0.2]])
    points = np.array([[2.0, 1.0, 1.0], [3.0, 1.7, 0.8]])
    assert sight.is_clear(eyes, points).tolist() == [True, False]
