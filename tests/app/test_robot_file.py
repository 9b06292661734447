"""Robot profiles as files: what is read, and what is said about what cannot be."""

import math

import pytest

from app.robot_file import PROFILES, RobotFileError, read_profile, template

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
        ("max_speed_m_s: 0.5", "max_speed_m_s: .nan", "finite number"),
        ("max_speed_m_s: 0.5", "max_speed_m_s: -1", "max_linear_m_s must be positive; got -1"),
        ("clearance_m: 0.05", "clearance_m: 0.9", "clearance_m from 0 to below height_m"),
        ("clearance_m: 0.05", "clearance_m: .inf", "clearance_m from 0 to below height_m"),
        (", clearance_m: 0.05", "", "a body needs radius_m, height_m and clearance_m, or spheres"),
        ("radius_m: 0.3", "radius_m: 0.3, spheres: [{z_m: 1, radius_m: 1}]", "not both"),
        ("tilt: -12", "tilt: -120", "both from -90 to 90 degrees; got -120"),
        ("tilt: -12", "tilt: {lowest_deg: 9, highest_deg: 1, max_deg_s: 9}", "got 9 and 1 degrees"),
        ("horizontal_fov_deg: 87", "horizontal_fov_deg: 200", "between 0 and 180 degrees; got 200"),
        ("tilt: -12", "max_depth_m: 0.1, tilt: -12", "min_depth_m must lie between 0 and"),
        ("name: scout", "name: [", "robot.yaml"),
        ("name: scout", "&a [*a]", "robot.yaml"),
    ],
)
def test_mistakes_are_named(old, new, message, written):
    assert old in SCOUT
    with pytest.raises(RobotFileError) as caught:
        read_profile(written(SCOUT.replace(old, new)))
    assert message in str(caught.value)
    assert "robot.yaml" in str(caught.value)


def test_a_file_that_is_none(tmp_path, written):
    with pytest.raises(RobotFileError, match="give zed, habitat or a YAML file"):
        read_profile(str(tmp_path / "nosuch.yaml"))
    with pytest.raises(RobotFileError, match="no robot profile"):
        read_profile(str(tmp_path))
    with pytest.raises(RobotFileError, match="too long for a robot profile"):
        read_profile(written("#" * 200_000))
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(RobotFileError, match=r"bytes\.yaml"):
        read_profile(str(tmp_path / "bytes.yaml"))
