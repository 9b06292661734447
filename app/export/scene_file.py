"""The scene as a file for viser's client, which opens without Python."""

import contextlib
import io
from pathlib import Path
from typing import Any

import viser

from app.export.session_data import SessionData
from app.view.drawing.camera_follow import FOV_RAD, framing
from app.view.drawing.viser_scene import ALL_PARTS, ViserScene
from app.view.view_options import ViewOptions


def write_scene(session: SessionData, path: Path) -> None:
    """Write the scene as `.viser`, or as a page with viser's client if the name ends in .html.

    The page opens in any browser; the `.viser` file opens in viser's client.
    """
    with contextlib.redirect_stdout(io.StringIO()):
        server: Any = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        scene = ViserScene(server)
        scene.draw(session.scene, ALL_PARTS, ViewOptions())
        bounds = scene.bounds()
        if bounds is not None:
            view = framing(*bounds, 1.5, session.scene.floor_z_m)
            server.initial_camera.fov = FOV_RAD
            server.initial_camera.position = view.position
            server.initial_camera.look_at = view.look_at
        serializer: Any = server.get_scene_serializer()
        if path.suffix == ".html":
            path.write_text(serializer.as_html(dark_mode=True), "utf-8")
        else:
            path.write_bytes(serializer.serialize())
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()
