"""`ippon ros2 --write`: the bridge's package, copied for the robot."""

import pytest

from app.cli.nodes.ros2 import write_package
from app.errors import UsageError


@pytest.mark.parametrize(
    "text", ["[project]\nname = 'mine'\n", "[tool.ruff]\n", "project = 1\n", "not TOML"]
)
def test_the_project_of_another_package_is_left_as_it_is(text, tmp_path):
    project = tmp_path / "pyproject.toml"
    project.write_text(text)
    with pytest.raises(UsageError, match=r"pyproject.toml is of another package"):
        write_package(tmp_path)
    assert project.read_text() == text
    assert [*tmp_path.iterdir()] == [project]


def test_an_earlier_copy_is_replaced(tmp_path):
    target = write_package(tmp_path)
    (target / "__main__.py").write_text("old")
    project = (tmp_path / "pyproject.toml").read_text()
    (tmp_path / "pyproject.toml").write_text(project + "# old\n")
    assert write_package(tmp_path) == target
    assert (tmp_path / "pyproject.toml").read_text() == project
    assert (target / "__main__.py").read_text() != "old"
