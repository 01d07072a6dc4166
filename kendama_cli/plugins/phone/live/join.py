"""Join of phones to 'kendama play --phone': pages, certificate and QR code, and a hand for each phone."""

from __future__ import annotations

import datetime
import io
import ipaddress
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

import segno
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from kendama_cli.plugins.phone.live.hand import PhoneHand

VALID_DAYS = 2
"""A certificate is for one game; phones refuse those that are valid for years."""


class PhoneJoin:
    """Phones join by a page of their own, and carry the cup by their sensors."""

    def pages(self) -> Mapping[str, tuple[str, bytes]]:
        """Return media type and content by name; ``phone.html`` is the page, the others its assets."""
        folder = resources.files(__package__) / "page"
        kinds = {"phone.html": "text/html", "phone.js": "text/javascript", "phone.css": "text/css"}
        return {name: (kind, (folder / name).read_bytes()) for name, kind in kinds.items()}

    def hand(self) -> PhoneHand:
        """Return the hand of a phone that joins."""
        return PhoneHand()

    def certificate(self, folder: Path, hosts: Sequence[str]) -> tuple[Path, Path, str]:
        """Write a certificate for ``hosts`` and its key to ``folder``; return both files and its SHA-256 fingerprint.

        It is signed by itself (X.509, ECDSA P-256): it keeps the line secret, and proves nobody's identity.
        """
        key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "kendama play")])
        now = datetime.datetime.now(datetime.UTC)
        certificate = (
            x509.CertificateBuilder()
            .subject_name(name)
            .issuer_name(name)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(hours=1))
            .not_valid_after(now + datetime.timedelta(days=VALID_DAYS))
            .add_extension(x509.SubjectAlternativeName([_host(one) for one in hosts]), critical=False)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
            .sign(key, hashes.SHA256())
        )
        files = folder / "certificate.pem", folder / "key.pem"
        files[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
        files[1].touch(mode=0o600)
        files[1].write_bytes(
            key.private_bytes(
                serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
            )
        )
        return *files, certificate.fingerprint(hashes.SHA256()).hex(":").upper()

    def code(self, address: str) -> tuple[str, bytes]:
        """Return the QR code of an address, as lines for a terminal and as an SVG picture."""
        made, lines, picture = segno.make_qr(address, error="m"), io.StringIO(), io.BytesIO()
        made.terminal(lines, compact=True)
        made.save(picture, kind="svg", scale=4, light="white")
        return lines.getvalue(), picture.getvalue()


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)
