"""Robot profiles as files: what is read, and what is said about what cannot be."""

import math
import re
from importlib.metadata import EntryPoint

import pytest

from app.robot_file import (
    PROFILES,
    SHIPPED,
    DetectorTable,
    RobotFileError,
    map_config,
    read_profile,
    read_robot,
    template,
)
from ippon import extensions
from ippon.robot import ZED
from tests.locations import ROOT

SCOUT = """
name: scout
body: {radius_m: 0.3, height_m: 0.7, clearance_m: 0.05}
motion: {max_speed_m_s: 0.5, max_turn_deg_s: 60}
camera: {height_m: 0.6, horizontal_fov_deg: 87, width_over_height: 1.33, tilt: -12}
"""


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "robot.yaml"
        path.write_text(text, "utf-8")
        return str(path)

    return write


def numbers(profile):
    spheres = [x for s in profile.spheres for x in (s.x_m, s.y_m, s.z_m, s.radius_m)]
    names = [n for n in profile.__dataclass_fields__ if n not in ("name", "spheres")]
    return spheres + [float(getattr(profile, n)) for n in names]


@pytest.mark.parametrize("name", list(PROFILES))
def test_what_is_printed_is_read_again(name, written):
    again = read_profile(written(template(PROFILES[name])))
    assert again.name == name
    assert numbers(again) == pytest.approx(numbers(PROFILES[name]), abs=1e-3)


@pytest.mark.parametrize("name", list(SHIPPED))
def test_a_shipped_profile_fits_itself_and_says_where_each_number_is_from(name):
    robot = read_profile(name)
    assert robot.name == name
    assert min(s.z_m - s.radius_m for s in robot.spheres) >= 0.0
    assert robot.camera_height_m <= robot.height_m + 0.1
    assert abs(robot.camera_forward_m) <= robot.radius_m + 0.05
    assert robot.floor_in_view_m <= 1.5, "floor that is not seen at the start counts as free"
    assert map_config(robot, 0.05).max_range_m == robot.max_depth_m
    text = SHIPPED[name].read_text("utf-8")
    assert "spec: " in text
    with_number = re.compile(r"(_m|_deg|_s|_height|tilt): -?[0-9]")
    lines = [line for line in text.splitlines() if with_number.search(line)]
    assert len(lines) >= 12
    assert all(re.search(r"  # (spec|typical|measure)", line) for line in lines)


def test_the_shipped_robots_are_those_of_the_guide():
    guide = (ROOT / "docs/guides/robot.md").read_text("utf-8")
    assert all(f"`{name}`" in guide for name in (*PROFILES, *SHIPPED))
    assert len(SHIPPED) == 5


def test_a_short_file_with_a_fixed_camera(written):
    scout = read_profile(written(SCOUT))
    assert not scout.can_tilt
    assert scout.min_tilt_rad == scout.max_tilt_rad == pytest.approx(math.radians(-12.0))
    assert scout.radius_m == pytest.approx(0.3)
    assert max(s.z_m + s.radius_m for s in scout.spheres) == pytest.approx(0.7)
    assert numbers(read_profile(written(template(scout)))) == pytest.approx(
        numbers(scout), abs=1e-3
    )


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius_m: 0.3", "radius: 0.3", "unknown field `radius` - at `$.body`"),
        ("height_m: 0.6, ", "", "missing required field `height_m` - at `$.camera`"),
        ("max_speed_m_s: 0.5", "max_speed_m_s: fast", "Expected `float`, got `str`"),
        ("max_speed_m_s: 0.5", "max_speed_m_s: .nan", "a number above 0; got nan"),
        ("max_speed_m_s: 0.5", "max_speed_m_s: -1", "max_speed_m_s` is a number above 0; got -1"),
        ("clearance_m: 0.05", "clearance_m: 0.9", "clearance_m from 0 to below height_m"),
        ("clearance_m: 0.05", "clearance_m: .inf", "clearance_m from 0 to below height_m"),
        (", clearance_m: 0.05", "", "a body needs radius_m, height_m and clearance_m, or spheres"),
        ("radius_m: 0.3", "radius_m: 0.3, spheres: [{z_m: 1, radius_m: 1}]", "not both"),
        ("tilt: -12", "tilt: -120", "both from -90 to 90 degrees; got -120"),
        ("tilt: -12", "tilt: {lowest_deg: 9, highest_deg: 1, max_deg_s: 9}", "got 9 and 1 degrees"),
        ("horizontal_fov_deg: 87", "horizontal_fov_deg: 200", "between 0 and 180 degrees; got 200"),
        ("tilt: -12", "max_depth_m: 0.1, tilt: -12", "min_depth_m must lie between 0 and"),
        ("radius_m: 0.3", "max_step_m: 0, radius_m: 0.3", "max_step_m lies in 0.01 to 1"),
        ("radius_m: 0.3, height_m: 0.7", "radius_m: 300, height_m: 700", "in millimetres?"),
        ("name: scout", "name: [", "robot.yaml"),
        ("name: scout", "&a [*a]", "robot.yaml"),
        ("name: scout", "name: &a [x]\nros2: {color: *a}", "aliases (*name) are not read"),
    ],
)
def test_mistakes_are_named(old, new, message, written):
    assert old in SCOUT
    with pytest.raises(RobotFileError) as caught:
        read_profile(written(SCOUT.replace(old, new)))
    assert message in str(caught.value)
    assert "robot.yaml" in str(caught.value)


def test_a_low_body_is_as_high_as_it_is(written):
    flat = "radius_m: 0.17, height_m: 0.09, clearance_m: 0.02"
    robot = read_profile(
        written(SCOUT.replace("radius_m: 0.3, height_m: 0.7, clearance_m: 0.05", flat))
    )
    assert max(s.z_m + s.radius_m for s in robot.spheres) == pytest.approx(0.09)
    assert min(s.z_m - s.radius_m for s in robot.spheres) == pytest.approx(0.02)
    assert robot.radius_m == pytest.approx(0.17)


def test_the_map_takes_what_the_camera_measures(written):
    far = read_profile(written(SCOUT.replace("tilt: -12", "tilt: -12, max_depth_m: 25")))
    config = map_config(far, 0.1, 2048.0)
    assert (config.min_range_m, config.max_range_m) == (far.min_depth_m, 25.0)
    assert config.max_valid_depth_m == 25.0
    assert map_config(PROFILES["zed"], 0.05).max_range_m == 5.0


def test_the_profile_of_the_documentation_is_one(written):
    text = (ROOT / "docs" / "guides" / "robot.md").read_text("utf-8")
    block, body, detector = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    scout = read_profile(written(block))
    assert read_robot(written(block + detector)).detector.labels == {
        "coffee mug": "cup",
        "meja": "table",
    }
    assert (scout.name, scout.can_tilt, scout.max_step_m) == ("scout", False, 0.03)
    assert scout.is_round
    long = read_profile(written(re.sub(r"^body:.*\n", body, block, flags=re.MULTILINE)))
    assert not long.is_round
    assert (2.0 * long.radius_m, 2.0 * long.half_width_m) == pytest.approx((0.94, 0.54))


def test_a_file_that_is_none(tmp_path, written):
    with pytest.raises(RobotFileError, match=r"give zed, habitat, .* or a YAML file"):
        read_profile(str(tmp_path / "nosuch.yaml"))
    with pytest.raises(RobotFileError, match="no robot profile"):
        read_profile(str(tmp_path))
    with pytest.raises(RobotFileError, match="too long for a robot profile"):
        read_profile(written("#" * 200_000))
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(RobotFileError, match=r"bytes\.yaml"):
        read_profile(str(tmp_path / "bytes.yaml"))


def test_a_package_that_is_damaged_is_named_and_replaces_no_shipped_profile(monkeypatch):
    added = {"mine": "no_such_module:PROFILE", "odd": "math:pi", "spot": "no_such_module:PROFILE"}
    assert "spot" in SHIPPED
    points = [EntryPoint(name, value, extensions.PROFILES) for name, value in added.items()]
    monkeypatch.setattr(extensions, "entry_points", lambda **_: points)
    with pytest.raises(RobotFileError, match=r"robot profile mine: .* cannot be loaded: No module"):
        read_robot("mine")
    with pytest.raises(RobotFileError, match="robot profile odd: "):
        read_robot("odd")
    assert read_robot("spot").profile.name == "spot"


def test_how_to_read_a_detector_stands_in_the_profile(written):
    text = template(ZED) + "detector: {source: yolo11n, labels: {coffee mug: cup}}\n"
    path = str(written(text))
    table = read_robot(path).detector
    assert (table.source, table.labels) == ("yolo11n", {"coffee mug": "cup"})
    assert read_profile(path).name == ZED.name
    assert (
        read_robot("zed").detector
        == read_robot(str(written(template(ZED)))).detector
        == DetectorTable()
    )


@pytest.mark.parametrize(
    ("detector", "text"),
    [
        ("{labels: {cup: ''}}", "empty name or label"),
        ("{labels: [cup]}", "detector.labels"),
        ("{sources: x}", "sources"),
    ],
)
def test_a_detector_that_cannot_be_read_is_named(written, detector, text):
    with pytest.raises(RobotFileError, match=text):
        read_robot(str(written(template(ZED) + f"detector: {detector}\n")))


def test_the_offset_of_the_cameras_clock_stands_in_the_profile(written):
    assert read_robot("zed").clock_offset_s == 0.0
    assert read_robot(written(SCOUT)).clock_offset_s == 0.0
    late = SCOUT.replace("tilt: -12", "tilt: -12, clock_offset_ms: -40")
    assert read_robot(written(late)).clock_offset_s == -0.04
    with pytest.raises(RobotFileError, match="clock_offset_ms is 5000; it may be -1000 to 1000"):
        read_robot(written(late.replace("-40", "5000")))


def test_a_robot_without_a_bridge_has_its_topics_and_limits(tmp_path):
    path = tmp_path / "scout.yaml"
    section = "ros2:\n  middleware: rmw_zenoh\n  domain: 7\n  router: tcp/scout:7447\n"
    path.write_text(template(ZED) + section, encoding="utf-8")
    settings = read_robot(str(path)).rmw_zenoh
    assert (settings.domain, settings.router) == (7, "tcp/scout:7447")
    assert settings.max_linear_m_s == ZED.max_linear_m_s
    assert "cmd_vel" in settings.topics
    path.write_text(template(ZED), encoding="utf-8")
    assert read_robot(str(path)).rmw_zenoh is None
    assert read_robot("zed").rmw_zenoh is None
    assert read_robot("hand-held").ros2.topics["tf"].is_optional
    assert (
        read_robot("zed").ros2.topics["tf"].name
        == read_robot(str(path)).ros2.topics["tf"].name
        == "/tf"
    )
    path.write_text(template(ZED) + section.replace("7\n", "-1\n"), encoding="utf-8")
    with pytest.raises(RobotFileError, match="`ros2: domain` is a number from 0 to 232; got -1"):
        read_robot(str(path))
