"""A small furnished home as the navigator would publish it, for the tests of the console."""

from types import SimpleNamespace

import pytest

from tests.app.nodes.console.drawn_home import (
    camera_image,
    cloud_of,
    find_of,
    home_voxels,
    proximity_of,
    status_of,
    tree_of,
)
from tests.app.nodes.console.published_home import PublishedHome
from tests.app.nodes.console.served import (
    ConsoleProcess,
    SceneWatcher,
    Served,
    free_port,
)


@pytest.fixture
def stage():
    """The drawn home, as functions."""
    return SimpleNamespace(
        home_voxels=home_voxels,
        cloud_of=cloud_of,
        tree_of=tree_of,
        status_of=status_of,
        find_of=find_of,
        proximity_of=proximity_of,
        camera_image=camera_image,
        PublishedHome=PublishedHome,
        ConsoleProcess=ConsoleProcess,
        Served=Served,
        free_port=free_port,
        SceneWatcher=SceneWatcher,
    )
