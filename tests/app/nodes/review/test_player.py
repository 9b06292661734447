"""Record, replay, compare the scene: by playing, by jumping, by stepping."""

import msgspec
import numpy as np
import pytest

from app.links.network.inbox import Inbox
from app.messages import keys
from app.messages.control import encode
from app.messages.driving import PaintedRegions, PaintedStroke
from app.messages.memory import MapAlignment
from app.messages.motion import StampedTransform, decode_transforms, encode_transforms
from app.messages.recording import RecordingGap
from app.messages.status import CountedFind, GoalStatus
from app.nodes.console.link.commands import CommandError
from app.nodes.review.link import RecordedLink
from app.nodes.review.player import Player
from app.recording.channels import GAP_KEY
from app.recording.reading.recording import Recording
from app.recording.timeline import TimedStatus, timeline_of
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader


@pytest.fixture
def recording(session_folder):
    recording = Recording(session_folder)
    yield recording
    recording.close()


@pytest.fixture
def stage(recording):
    """A model, and the player that feeds it."""
    model = SceneModel()
    return model, Player(recording, SceneReader(model).feed)


def _live(made_up, until_ns):
    """Return what a console that watched from the first second on would show."""
    model = SceneModel()
    reader = SceneReader(model)
    for time_ns, key, payload in made_up.all_messages():
        if time_ns > until_ns:
            break
        if key != keys.MAP_KEYFRAME or model.needs_keyframe:
            reader.feed(key, payload)
    assert not reader.rejected
    return model


def _assert_same(shown, live):
    for a, b in zip(shown.voxels.all_voxels(), live.voxels.all_voxels(), strict=True):
        np.testing.assert_array_equal(a, b)
    assert shown.voxel_size_m == live.voxel_size_m
    assert shown.status == live.status
    assert shown.proximity == live.proximity
    assert shown.events == live.events
    assert shown.detections == live.detections
    assert shown.image == live.image
    assert shown.camera == live.camera
    np.testing.assert_allclose(shown.T_world_base, live.T_world_base, atol=1e-12)
    np.testing.assert_allclose(shown.T_world_camera, live.T_world_camera, atol=1e-12)
    np.testing.assert_array_equal(shown.path_world, live.path_world)
    np.testing.assert_array_equal(shown.tree.positions_world, live.tree.positions_world)
    np.testing.assert_allclose(shown.trail_world, live.trail_world, atol=1e-3)
    assert shown.needs_keyframe is False


def test_played_to_the_end_the_scene_is_the_live_one(stage, recording, made_up):
    model, player = stage
    while not player.ended:
        player.advance(0.3)
    _assert_same(model, _live(made_up, recording.end_ns))
    live = _live(made_up, recording.end_ns).history.columns()
    np.testing.assert_allclose(model.history.columns()[1:, -1], live[1:, -1])


def test_any_jump_shows_what_was_shown_then(stage, recording, made_up):
    model, player = stage
    for position in [4.5, 0.7, 5.8, 2.0, 99.0, 3.31]:
        player.seek(position)
        assert player.position_s == pytest.approx(min(position, 5.8), abs=0.02)
        _assert_same(model, _live(made_up, player.time_ns))


def test_after_a_jump_playing_goes_on_as_if_there_had_been_none(stage, recording, made_up):
    model, player = stage
    player.seek(4.0)
    player.advance(1.0)
    _assert_same(model, _live(made_up, player.time_ns))


@pytest.fixture
def lossy(made_up, tmp_path):
    """A session that lacks what came from the third second to the fourth."""
    session = made_up.write_session(tmp_path, 2.0, end=False)
    gap = made_up.START_NS + 3 * 10**9, GAP_KEY, encode(RecordingGap(dropped=7))
    for time_ns, key, payload in sorted([gap, *made_up.all_messages()], key=lambda one: one[0]):
        at_s = (time_ns - made_up.START_NS) * 1e-9
        if at_s >= 3.0:
            session.add(key, payload, time_ns, at_s)
    session.close()
    recording = Recording(session.writer.folder)
    yield recording
    recording.close()


def _assert_played_as_jumped(recording, position_s, whole_maps):
    """Play in steps, and compare the map with that after a jump."""
    came, (played, jumped) = [], (SceneModel(), SceneModel())
    reader = SceneReader(played)
    player = Player(recording, lambda key, payload: came.append(key) or reader.feed(key, payload))
    while player.position_s < position_s - 1e-3:
        player.advance(0.25)
    Player(recording, SceneReader(jumped).feed).seek(player.position_s)
    pairs = zip(played.voxels.all_voxels(), jumped.voxels.all_voxels(), strict=True)
    assert all(np.array_equal(a, b) for a, b in pairs)
    assert came.count(keys.MAP_KEYFRAME) == whole_maps


@pytest.mark.parametrize("position_s", [3.5, 4.5, 5.75])
def test_after_a_gap_the_next_whole_map_is_shown_and_no_further_one(lossy, position_s):
    _assert_played_as_jumped(lossy, position_s, 2 if position_s < 3.75 else 3)


def test_a_whole_map_is_not_even_read_without_a_gap(recording, monkeypatch):
    read, between = [], recording.between
    monkeypatch.setattr(recording, "between", lambda *span: read.append(span[2]) or between(*span))
    _assert_played_as_jumped(recording, 5.75, 2)
    assert sum(keys.MAP_KEYFRAME in wanted for wanted in read) == 8, "until the first has come"


def test_after_damage_the_next_whole_map_is_shown(recording, made_up, monkeypatch):
    read = recording._read

    def damaged(key, source, row):
        at_s = (source.entries.time_ns[row] - made_up.START_NS) * 1e-9
        if key == keys.MAP_VOXELS and 2.3 < at_s < 2.9:
            recording.damaged["the chunk is damaged"] += 1
            return None
        return read(key, source, row)

    monkeypatch.setattr(recording, "_read", damaged)
    _assert_played_as_jumped(recording, 5.75, 3)


def test_a_robot_that_fell_silent_is_shown_where_it_was(made_up, tmp_path):
    session = made_up.write_session(tmp_path, seconds=1.0, end=False)
    for n in range(15):
        time_ns = made_up.START_NS + (1 + n) * 10**9
        session.add(keys.STATUS, encode(made_up.status_of(5 + n)), time_ns, 1.0 + n)
    session.close()
    recording = Recording(session.writer.folder)
    model = SceneModel()
    Player(recording, SceneReader(model).feed).seek(14.0)
    np.testing.assert_allclose(model.T_world_base[:2, 3], [0.08, 0.5], atol=1e-9)
    assert model.T_world_camera is not None
    recording.close()


def test_a_review_of_an_aligned_session_shows_poses_and_painted_floor_in_the_map(made_up, tmp_path):
    regions = [PaintedStroke(kind="look_here", radius_m=0.5, strokes=[(1.0, 2.0)])]
    painted = made_up.START_NS + 3 * 10**9, keys.PAINTED, encode(PaintedRegions(regions=regions))
    more = [made_up.alignment_at(2, (10.0, -3.0, 0.0)), painted]
    recording = Recording(made_up.write_session(tmp_path, more=more).writer.folder)
    models = []
    for _ in range(2):
        models.append(SceneModel())
        models[-1].on_alignment(MapAlignment(position_map=(99.0, 0.0, 0.0), yaw_rad=0.0))
    played, jumped = models
    player, jumping = (Player(recording, SceneReader(model).feed) for model in models)
    for position_s in (0.2, 2.0, 5.0):
        player.advance(position_s - player.position_s)
        jumping.seek(position_s)
        x = 10.0 + 0.02 * round(position_s * 5)
        for model in models:
            np.testing.assert_allclose(model.T_world_base[:2, 3], [x, -2.5], atol=1e-9)
        np.testing.assert_allclose(played.trail_world, jumped.trail_world, atol=1e-3)
        assert len(played.painted) == len(jumped.painted) == (position_s > 3.0)
    recording.close()
    plain = Recording(made_up.write_session(tmp_path / "plain").writer.folder)
    Player(plain, SceneReader(jumped).feed)
    np.testing.assert_allclose(jumped.T_world_base[:2, 3], [0.0, 0.5], atol=1e-9)
    plain.close()


def test_a_jump_in_a_long_session_with_many_finds_shows_its_past(recording, made_up):
    timeline = timeline_of(recording)
    counted = [
        CountedFind(number=n, position_world=(1.234567, 2.345678, 0.456789)) for n in range(1, 61)
    ]
    goal = GoalStatus(goal_id=1, object="cup", count="all", counted=counted)
    statuses = [
        TimedStatus(made_up.START_NS + k, msgspec.structs.replace(made_up.status_of(k), goal=goal))
        for k in range(1998)
    ]
    timeline = msgspec.structs.replace(timeline, statuses=statuses)
    model = SceneModel()
    reader = SceneReader(model)
    Player(recording, reader.feed, timeline).seek(5.0)
    assert not reader.rejected, reader.problem
    assert model.history.columns().shape[1] > 100
    assert model.events
    assert len(model.trail_world)


def test_a_jump_emits_the_last_fixed_transforms_once(made_up, tmp_path):
    again = [
        (made_up.START_NS + n * 10**6, keys.TF_STATIC, _fixed(0.001 * n)) for n in range(1, 2000)
    ]
    recording = Recording(made_up.write_session(tmp_path, more=again).writer.folder)
    came = []
    player = Player(recording, lambda key, payload: came.append((key, payload)))
    came.clear()
    player.seek(1.0)
    (fixed,) = [decode_transforms(payload) for key, payload in came if key == keys.TF_STATIC]
    (lidar,) = [one for one in fixed if one.child == "lidar"]
    assert lidar.T_parent_child[0, 3] == pytest.approx(1.0)
    recording.close()


def _fixed(x):
    T = np.eye(4)
    T[0, 3] = x
    return encode_transforms(
        (StampedTransform(stamp_ns=0, parent="base_link", child="lidar", T_parent_child=T),)
    )


def test_steps_go_from_picture_to_picture(stage, recording):
    model, player = stage
    player.seek(2.0)
    before = model.image.stamp_ns
    player.step(1)
    assert model.image.stamp_ns - before == 200_000_000
    player.step(-1)
    player.step(-1)
    assert before - model.image.stamp_ns == 200_000_000
    player.seek(99.0)
    player.step(1)
    assert player.position_s <= recording.duration_s


def test_a_recording_is_commanded_by_nobody():
    link = RecordedLink(Inbox(()), lambda _: None)
    link.start()
    for command in (link.pause, link.resume, link.cancel, link.confirm_find, link.reject_find):
        with pytest.raises(CommandError, match="this is a recording"):
            command()
    with pytest.raises(CommandError, match="this is a recording"):
        link.search("hat", "", "")
    assert link.query(keys.STATUS) is None
    link.close()
