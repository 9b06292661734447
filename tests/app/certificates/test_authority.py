import datetime as dt

import pytest
from cryptography import x509
from cryptography.x509 import verification

from app.certificates.authority import CertificateError, expiry, issue, open_authority

NOW = dt.datetime(2030, 1, 1, tzinfo=dt.UTC)


def test_an_authority_is_made_once_and_signs(tmp_path):
    first, again = open_authority(tmp_path, NOW), open_authority(tmp_path, NOW)
    assert again.certificate == first.certificate
    pem, _ = issue(again, "robot", ("robot.local", "10.0.0.2", "::1"), 5, NOW)
    certificate = x509.load_pem_x509_certificate(pem)
    certificate.verify_directly_issued_by(first.certificate)
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["robot.local"]
    assert [str(a) for a in names.get_values_for_type(x509.IPAddress)] == ["10.0.0.2", "::1"]
    assert certificate.subject.rfc4514_string() == "CN=robot"
    assert expiry(pem) == NOW + dt.timedelta(days=5)


def test_a_strict_reader_accepts_a_certificate(tmp_path):
    """As Python from 3.13 on: key identifiers are there, as RFC 5280 demands."""
    authority = open_authority(tmp_path, NOW)
    pem, _ = issue(authority, "navigator", ("robot.local",), 5, NOW)
    store = verification.Store([authority.certificate])
    policy = verification.PolicyBuilder().store(store).time(NOW)
    verifier = policy.build_server_verifier(x509.DNSName("robot.local"))
    assert len(verifier.verify(x509.load_pem_x509_certificate(pem), [])) == 2


def test_half_an_authority_is_refused(tmp_path):
    open_authority(tmp_path, NOW)
    (tmp_path / "ca.key").unlink()
    with pytest.raises(CertificateError, match=r"ca.key is missing"):
        open_authority(tmp_path, NOW)


def test_a_damaged_or_foreign_key_is_refused(tmp_path):
    (tmp_path / "other").mkdir()
    open_authority(tmp_path, NOW)
    open_authority(tmp_path / "other", NOW)
    (tmp_path / "ca.key").write_bytes((tmp_path / "other" / "ca.key").read_bytes())
    with pytest.raises(CertificateError, match=r"is not the key of .*ca.pem"):
        open_authority(tmp_path, NOW)
    (tmp_path / "ca.key").write_text("nonsense")
    with pytest.raises(CertificateError, match="no usable authority"):
        open_authority(tmp_path, NOW)


def test_no_certificate_outlives_its_authority(tmp_path):
    authority = open_authority(tmp_path, NOW)
    end = authority.certificate.not_valid_after_utc
    later = end - dt.timedelta(days=100)
    pem, _ = issue(open_authority(tmp_path, later), "robot", ("localhost",), 365, later)
    assert expiry(pem) == end
    with pytest.raises(CertificateError, match="expired on 2039-12-30, and all that it signed"):
        open_authority(tmp_path, end)
