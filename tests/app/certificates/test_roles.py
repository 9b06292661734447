import datetime as dt
import re
import stat

import pytest
import zenoh
from cryptography import x509

from app.certificates.authority import CertificateError
from app.certificates.roles import ROLES, write_roles
from app.nodes.recorder_network import REQUESTED

NOW = dt.datetime(2030, 1, 1, tzinfo=dt.UTC)


def write(folder, **changes):
    options = {"robots": ("ippon",), "hosts": ("localhost",), "days": 30, "now": NOW}
    return write_roles(folder, **{**options, **changes})


def test_each_role_has_certificate_key_and_a_profile_that_zenoh_reads(tmp_path):
    roles = write(tmp_path / "tls")
    assert [one.role for one in roles] == list(ROLES)
    for one in roles:
        assert one.new
        assert one.expires == NOW + dt.timedelta(days=30)
        zenoh.Config.from_file(str(one.profile))
        assert f"{tmp_path}/tls/{one.role}.key" in one.profile.read_text()
        key = tmp_path / "tls" / f"{one.role}.key"
        assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert stat.S_IMODE((tmp_path / "tls" / "ca.key").stat().st_mode) == 0o600


def test_what_is_there_stays_and_what_was_deleted_is_made_again(tmp_path):
    write(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    (tmp_path / "robot.pem").unlink()
    later = NOW + dt.timedelta(days=10)
    new = [one.role for one in write(tmp_path, now=later) if one.new]
    assert new == ["robot"]
    changed = {p.name for p in tmp_path.iterdir() if p.read_bytes() != before[p.name]}
    assert changed == {"robot.pem", "robot.key"}


def test_the_rules_are_about_the_robot_that_is_named(tmp_path):
    write(tmp_path, robots=("site/scout",))
    text = (tmp_path / "navigator.json5").read_text()
    assert '"site/scout/cmd_vel"' in text
    assert '"ippon/' not in text


def test_a_robot_below_another_prefix_does_not_name_that_prefix(tmp_path):
    write(tmp_path, robots=("site/robot-1",))
    lacking = next(r.lacks for r in write(tmp_path, robots=("site", "site/robot-1")) if r.lacks)
    assert lacking == ("site",)


def test_who_watches_may_fetch_every_last_message(tmp_path):
    write(tmp_path)
    text = (tmp_path / "navigator.json5").read_text()
    rule = re.search(r'id: "fetch".*?key_exprs: \[(.*?)\]', text, re.DOTALL)
    allowed = [zenoh.KeyExpr(key) for key in re.findall(r'"([^"]+)"', rule[1])]
    for key in REQUESTED:
        assert any(one.includes(zenoh.KeyExpr(f"ippon/{key}")) for one in allowed), key


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"robots": ("a*",)}, "key prefix"),
        ({"days": 0}, "1 to 3650 days; got 0"),
        ({"hosts": ("a b",)}, "'a b' is neither"),
        ({"hosts": ("robot.local:7447",)}, "a port is not part of it"),
        ({"hosts": ("192.168.1.300",)}, "'192.168.1.300' is neither"),
        ({"hosts": ("a..b",)}, "'a..b' is neither"),
        ({"hosts": ("fe80::1%eth0",)}, "'fe80::1%eth0' is neither"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_written(tmp_path, changes, text):
    with pytest.raises(ValueError, match=text):
        write(tmp_path / "tls", **changes)
    assert not (tmp_path / "tls").exists()


def test_names_and_addresses_of_both_kinds_are_taken(tmp_path):
    hosts = ("localhost", "robot-1.local", "10.0.0.2", "::1", "fd00::20")
    write(tmp_path, hosts=hosts)
    certificate = x509.load_pem_x509_certificate((tmp_path / "navigator.pem").read_bytes())
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert [str(one.value) for one in names] == [*hosts, "127.0.0.1"]


def test_a_certificate_that_is_none_is_named(tmp_path):
    write(tmp_path)
    (tmp_path / "robot.pem").write_text("nonsense")
    with pytest.raises(CertificateError, match=r"robot.pem is no certificate"):
        write(tmp_path)


def test_a_folder_that_profiles_cannot_name_is_refused(tmp_path):
    with pytest.raises(CertificateError, match="take a plain path"):
        write(tmp_path / 'a"b')
