from types import SimpleNamespace

from app.messages.motion import StampedTwist
from app.nodes.simulated_drive import SimulatedDrive

SECOND = 1_000_000_000


def twist(stamp_s):
    return StampedTwist(stamp_ns=round(stamp_s * SECOND), linear_m_s=0.5, yaw_rate_rad_s=0.0)


def test_a_command_is_followed_once_and_only_while_its_image_is_young():
    drive = SimulatedDrive()
    drive.take(one := twist(9.1))
    assert drive.fresh(10 * SECOND) is one
    assert drive.fresh(10 * SECOND) is None
    drive.take(twist(8.9))
    assert drive.fresh(10 * SECOND) is None
    drive.take(unstamped := twist(0.0))
    assert drive.fresh(10 * SECOND) is unstamped
    fast = SimulatedDrive(2.0)
    fast.take(two := twist(8.1))
    assert fast.fresh(10 * SECOND) is two


def test_how_the_base_moves_after_the_last_command_is_noted():
    drive = SimulatedDrive()
    drive.take(twist(1.0))
    drive.fresh(SECOND)
    drive.note(SimpleNamespace(linear_m_s=0.5, yaw_rate_rad_s=0.1), SECOND)
    drive.take(twist(0.5))
    drive.fresh(2 * SECOND)
    drive.note(SimpleNamespace(linear_m_s=0.0, yaw_rate_rad_s=0.0), 2 * SECOND)
    assert drive.speeds() == [(0.5, 0.1, 0.0), (0.0, 0.0, 1.0)]
