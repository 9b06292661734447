"""A certificate authority in a folder, for a test or for a team without one of its own."""

import datetime as dt
import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

CA_YEARS: Final = 10
_BACKDATED: Final = dt.timedelta(hours=1)
"""So that a robot whose clock lags accepts a new certificate."""


class CertificateError(ValueError):
    """Certificates cannot be made; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Authority:
    """A certificate that signs others, and its key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey


def open_authority(folder: Path, now: dt.datetime) -> Authority:
    """Return the authority of a folder; a folder without one gets a new one.

    Args:
        folder: Holds ca.pem, and ca.key that only its owner may read.
        now: The present time, with its time zone.

    Raises:
        CertificateError: One of its two files is missing, damaged, or of another authority, or the
            authority has expired.
        OSError: They cannot be read or written.
    """
    certificate_file, key_file = folder / "ca.pem", folder / "ca.key"
    if certificate_file.exists() != key_file.exists():
        missing = key_file if certificate_file.exists() else certificate_file
        raise CertificateError(
            f"{missing} is missing; its other half is there: take another folder"
        )
    if not certificate_file.exists():
        made = _make_authority(now)
        write_private(key_file, _pem(made.key))
        certificate_file.write_bytes(made.certificate.public_bytes(serialization.Encoding.PEM))
        return made
    try:
        certificate = x509.load_pem_x509_certificate(certificate_file.read_bytes())
        key = serialization.load_pem_private_key(key_file.read_bytes(), None)
    except ValueError as error:
        raise CertificateError(f"{folder} holds no usable authority: {error}") from error
    if (
        not isinstance(key, ec.EllipticCurvePrivateKey)
        or key.public_key() != certificate.public_key()
    ):
        raise CertificateError(f"{key_file} is not the key of {certificate_file}")
    if certificate.not_valid_after_utc <= now:
        raise CertificateError(
            f"the authority in {folder} expired on {certificate.not_valid_after_utc:%Y-%m-%d}, and "
            "all that it signed with it: take another folder, and new certificates everywhere"
        )
    return Authority(certificate=certificate, key=key)


def issue(
    authority: Authority, name: str, hosts: Sequence[str], days: int, now: dt.datetime
) -> tuple[bytes, bytes]:
    """Return certificate and private key, PEM, of a process.

    Args:
        authority: Signs.
        name: Common name: what access control tells it by.
        hosts: Names and addresses under which it may be reached.
        days: How long it is valid, at most as long as the authority.
        now: The present time, with its time zone.
    """
    until = min(now + dt.timedelta(days=days), authority.certificate.not_valid_after_utc)
    key = ec.generate_private_key(ec.SECP256R1())
    signer = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key())
    names = x509.SubjectAlternativeName([general_name(host) for host in hosts])
    usages = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
    certificate = (
        _builder(name, authority.certificate.subject, key.public_key(), now, until)
        .add_extension(names, critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
        .add_extension(signer, critical=False)
        .sign(authority.key, hashes.SHA256())
    )
    return certificate.public_bytes(serialization.Encoding.PEM), _pem(key)


def expiry(certificate_pem: bytes) -> dt.datetime:
    """Return the end of a certificate's validity; raises ValueError if it is not a certificate."""
    return x509.load_pem_x509_certificate(certificate_pem).not_valid_after_utc


def host_names(certificate_pem: bytes) -> tuple[str, ...]:
    """Return names and addresses of a certificate; raises ValueError if it is not a certificate."""
    extensions = x509.load_pem_x509_certificate(certificate_pem).extensions
    try:
        names = extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(one.value) for one in names)


def common_name(certificate_pem: bytes) -> str:
    """Return whom a certificate is of; raises ValueError if it is not a certificate."""
    subject = x509.load_pem_x509_certificate(certificate_pem).subject
    return "".join(str(one.value) for one in subject.get_attributes_for_oid(NameOID.COMMON_NAME))


def write_private(path: Path, content: bytes) -> None:
    """Write a file that only its owner may read."""
    path.touch(mode=0o600)
    path.chmod(0o600)
    path.write_bytes(content)


def _make_authority(now: dt.datetime) -> Authority:
    key = ec.generate_private_key(ec.SECP256R1())
    subject = _name("IPPON certificate authority")
    usage = x509.KeyUsage(
        digital_signature=True, key_cert_sign=True, crl_sign=True, content_commitment=False,
        key_encipherment=False, data_encipherment=False, key_agreement=False,
        encipher_only=False, decipher_only=False,
    )  # fmt: skip
    until = now + dt.timedelta(days=365 * CA_YEARS)
    certificate = (
        _builder("IPPON certificate authority", subject, key.public_key(), now, until)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    return Authority(certificate=certificate, key=key)


def _builder(
    name: str,
    issuer: x509.Name,
    public_key: ec.EllipticCurvePublicKey,
    now: dt.datetime,
    until: dt.datetime,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .issuer_name(issuer)
        .public_key(public_key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _BACKDATED)
        .not_valid_after(until)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public_key), critical=False)
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def general_name(host: str) -> x509.GeneralName:
    """Return a host's name or address as a certificate spells it."""
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
