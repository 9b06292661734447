import pytest

from app.nodes.console.fleet.robot_paths import page_path, path_of, split_path


@pytest.mark.parametrize("robot", ["ippon", "site-2/robot.1", "a_b"])
def test_a_path_names_its_robot(robot):
    assert split_path(path_of(robot)) == (robot, "/")
    assert split_path(path_of(robot) + "api/ws") == (robot, "/api/ws")
    assert page_path(path_of(robot) + "view/") == "/view/"
    assert page_path(path_of(robot).rstrip("/")) == "/"


@pytest.mark.parametrize("path", ["/", "/robot/", "/robot/a b/", "/robot/<b>/", "/api/robots"])
def test_other_paths_name_none(path):
    assert split_path(path) is None
    assert page_path(path) == path
