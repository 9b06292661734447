"""A small furnished home as the navigator would publish it, for the tests of the console."""

import functools
from types import SimpleNamespace

import pytest

from app.messages.lease import LeaseReply
from app.messages.memory import MemoryReply
from app.nodes.console.link.commands import CommandError
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web import gateway
from app.nodes.console.web.access import OpenAccess
from app.nodes.console.web.browsers import Browsers, acting_browser
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import Hosts
from app.nodes.console.web.viser_server import start_viser
from tests.app.nodes.console.drawn_home import (
    camera_image,
    cloud_of,
    find_of,
    home_voxels,
    proximity_of,
    status_of,
    things_of,
    tree_of,
)
from tests.app.nodes.console.published_home import PublishedHome
from tests.app.nodes.console.served import (
    ConsoleProcess,
    SceneWatcher,
    Served,
)
from tests.ports import free_port


@pytest.fixture(scope="session", autouse=True)
def assets_made_once():
    """Unpack and compress the files of the page once for all gateways: they never change."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gateway, "Assets", functools.cache(gateway.Assets))
        yield


@pytest.fixture(scope="session")
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


class Navigator:
    """Takes control requests."""

    def __init__(self):
        self.actions = []
        self.inputs = []
        self.problem = None
        self.is_free = True
        self.counts_renewals = False
        self.who = None

    def may_use_panels(self, browser):
        return self.is_free

    async def lease(self, action, requester=""):
        if action != "renew" or self.counts_renewals:
            self.actions.append(action)
        if self.problem is not None:
            raise CommandError(self.problem)
        self.who = acting_browser()
        if action == "renew" and not acting_browser().has_lease_or_request:
            return LeaseReply(standing="watches", epoch=3, detail="Nobody has control.")
        reply = LeaseReply(standing="holds", epoch=3, detail="You have control.")
        acting_browser().update_lease(reply)
        return reply

    def send_input(self, held):
        self.inputs.append(held)

    def name_room(self, x_m, y_m, name):
        self.actions.append((x_m, y_m, name))
        if self.problem is not None:
            raise CommandError(self.problem)
        return "The room is named."

    def go_to(self, x_m, y_m):
        self.actions.append(("go", x_m, y_m))
        if self.problem is not None:
            raise CommandError(self.problem)
        return "driving there, 2.4 m"

    def paint(self, action, strokes, radius_m):
        self.actions.append((action, list(strokes), radius_m))
        return "searching there first"

    def things(self):
        self.who = acting_browser()
        if self.problem is not None:
            raise CommandError(self.problem)
        things = things_of()
        return MemoryReply(things=things, count=len(things))

    def thing_picture(self, instance_id):
        if self.problem is not None:
            raise CommandError(self.problem)
        return b"\xff\xd8\xff" if instance_id == 1 else b""

    def note_thing(self, request):
        self.actions.append(request)
        if self.problem is not None:
            raise CommandError(self.problem)
        return "This mug is Anna's mug."

    def search_for(self, wanted):
        self.actions.append(wanted)
        if self.problem is not None:
            raise CommandError(self.problem)
        return f"Looking for: {wanted}."

    def confirm_find(self, goal_id=None, number=None):
        self.actions.append(("confirm", goal_id, number))
        return "Confirmed."

    def reject_find(self, goal_id=None, number=None):
        self.actions.append(("reject", goal_id, number))
        return "The search continues."

    def change_queue(self, request):
        self.actions.append(request)
        if self.problem is not None:
            raise CommandError(self.problem)
        return "It is next."

    def change_saved(self, request):
        self.actions.append(request)
        return "It is saved."

    async def control(self, request):
        self.actions.append(request.action if request.goal_id is None else request)
        self.who = acting_browser()
        if self.problem is not None:
            raise CommandError(self.problem)
        return "stopped"


@pytest.fixture(scope="module")
def browsers():
    """Everyone who comes by in this module."""
    return Browsers()


@pytest.fixture(scope="module")
def viser_server(browsers):
    """A viser server behind its secret."""
    viser_server = start_viser(browsers)
    yield viser_server
    viser_server.close()


@pytest.fixture
def navigator():
    """A navigator that remembers what it was asked."""
    return Navigator()


@pytest.fixture
def state_feed():
    """A state_feed with one notice."""
    state_feed = StateFeed()
    state_feed.post(b'{"type":"state","link":"live"}')
    return state_feed


@pytest.fixture
def client(stage, viser_server, state_feed, navigator, browsers):
    """A browser's requests, without the browser."""
    served = stage.Served(
        Gateway(viser_server, state_feed, navigator, OpenAccess(browsers), Hosts("127.0.0.1"))
    )
    yield served
    served.close()
