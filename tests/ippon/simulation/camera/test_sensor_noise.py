import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.simulation.camera.sensor_noise import NoiseConfig, SensorNoise

CAMERA = PinholeCamera.from_horizontal_fov(400, 250, 1.3)


def generator(seed=0):
    return np.random.Generator(np.random.PCG64(seed))


def flat(depth_m):
    return np.full((250, 400), depth_m, dtype=np.float32)


def noise(**fields):
    quiet = {
        "depth_m_per_m2": 0.0,
        "quantum_m": 0.0,
        "edge_hole_probability": 0.0,
        "dropout": 0.0,
        "color_sigma": 0.0,
        "exposure_sigma": 0.0,
        "white_balance_sigma": 0.0,
    }
    return SensorNoise(CAMERA, 0.3, 5.0, NoiseConfig(**(quiet | fields)))


def test_a_camera_without_noise_only_has_a_range():
    depth = np.linspace(0.0, 6.0, 100_000, dtype=np.float32).reshape(250, 400)
    measured = SensorNoise(CAMERA, 0.3, 5.0, NoiseConfig.none()).corrupt_depth(depth, generator())
    inside = (depth >= 0.3) & (depth <= 5.0)
    np.testing.assert_array_equal(measured, np.where(inside, depth, 0.0))
    color = generator(1).integers(0, 256, (250, 400, 3)).astype(np.uint8)
    unchanged = SensorNoise(CAMERA, 0.3, 5.0, NoiseConfig.none()).corrupt_color(color, generator())
    np.testing.assert_array_equal(unchanged, color)


@pytest.mark.parametrize("depth_m", [1.0, 2.0, 4.0])
def test_depth_noise_grows_with_the_square_of_the_depth(depth_m):
    error = noise(depth_m_per_m2=0.002).corrupt_depth(flat(depth_m), generator()) - depth_m
    assert error.std() == pytest.approx(0.002 * depth_m**2, rel=0.1)
    assert abs(error.mean()) < 0.2 * error.std()


def test_noise_of_neighbouring_pixels_is_correlated():
    error = noise(depth_m_per_m2=0.002).corrupt_depth(flat(2.0), generator()) - 2.0
    near = np.corrcoef(error[:, :-1].ravel(), error[:, 1:].ravel())[0, 1]
    far = np.corrcoef(error[:, :-40].ravel(), error[:, 40:].ravel())[0, 1]
    assert near > 0.3
    assert abs(far) < 0.1


def test_readings_are_quantised():
    measured = noise(depth_m_per_m2=0.002, quantum_m=0.01).corrupt_depth(flat(2.0), generator())
    np.testing.assert_allclose(np.round(measured / 0.01) * 0.01, measured, atol=1e-6)
    assert len(np.unique(measured)) > 2


def test_holes_lie_along_edges_and_in_patches():
    depth = flat(2.0)
    depth[:, 200:] = 3.0
    edges = noise(edge_hole_probability=0.5).corrupt_depth(depth, generator()) == 0.0
    assert not edges[:, :199].any()
    assert not edges[:, 201:].any()
    assert 0.35 < edges[:, 199:201].mean() < 0.65
    patches = noise(dropout=0.02).corrupt_depth(flat(2.0), generator()) == 0.0
    assert 0.005 < patches.mean() < 0.05
    beside = patches[:, 1:][patches[:, :-1]].mean()
    assert beside > 0.6


def test_a_floor_seen_at_a_usual_angle_has_no_holes():
    v = np.arange(250, dtype=np.float32)[:, None]
    below = np.maximum(v - CAMERA.cy, 1e-3) / CAMERA.fy
    depth = np.repeat(np.minimum(1.2 / below, 20.0), 400, axis=1).astype(np.float32)
    measured = noise(edge_hole_probability=1.0).corrupt_depth(depth, generator())
    seen = (depth < 4.8) & (depth > 0.3)
    assert (measured[seen] > 0.0).all()


def test_the_white_balance_is_that_of_the_run():
    grey = np.full((250, 400, 3), 128, dtype=np.uint8)
    config = NoiseConfig(color_sigma=0.0, exposure_sigma=0.0, white_balance_sigma=0.05)
    first, again, other = (SensorNoise(CAMERA, 0.3, 5.0, config, seed) for seed in (1, 1, 2))
    tinted = first.corrupt_color(grey, generator())
    assert (tinted == tinted[0, 0]).all()
    assert len(set(tinted[0, 0].tolist())) > 1
    np.testing.assert_array_equal(tinted, again.corrupt_color(grey, generator(1)))
    assert (tinted != other.corrupt_color(grey, generator())).any()


@pytest.mark.slow
def test_colour_noise_has_its_size():
    grey = np.full((250, 400, 3), 128, dtype=np.uint8)
    measured = noise(color_sigma=4.0).corrupt_color(grey, generator()).astype(float)
    assert 3.0 < measured.std() < 6.0
    assert abs(measured.mean() - 128.0) < 1.0
    brightness = [
        noise(exposure_sigma=0.05).corrupt_color(grey, generator(k)).mean() for k in range(40)
    ]
    assert np.std(brightness) == pytest.approx(0.05 * 128.0, rel=0.4)
    bright = np.full((250, 400, 3), 255, dtype=np.uint8)
    assert noise(color_sigma=4.0).corrupt_color(bright, generator()).min() > 200


def test_the_generator_decides_everything():
    camera = SensorNoise(CAMERA, 0.3, 5.0, NoiseConfig())
    again = SensorNoise(CAMERA, 0.3, 5.0, NoiseConfig())
    first, second, other = (
        c.corrupt_depth(flat(2.0), generator(s)) for c, s in ((camera, 7), (again, 7), (camera, 8))
    )
    np.testing.assert_array_equal(first, second)
    assert (first != other).mean() > 0.5


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"depth_m_per_m2": -1.0}, "at least 0"),
        ({"dropout": 0.9}, "dropout in 0..0.5"),
        ({"edge_hole_probability": 1.5}, "must be in 0..1"),
        ({"edge_jump": 0.0}, "edge_jump must be positive"),
    ],
)
def test_nonsense_is_refused(fields, text):
    with pytest.raises(ValueError, match=text):
        NoiseConfig(**fields)
