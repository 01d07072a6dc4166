"""A socket that listens: nothing heavy is imported here, so that a taken port is reported at once."""

from __future__ import annotations

import socket

from kendama_cli.errors import UsageError

Listening = socket.socket


def listen(host: str, port: int) -> Listening:
    """Return a socket that listens there, 0 for any free port; raises UsageError."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listening = socket.create_server((host, port), family=family)
    except OSError as error:
        raise UsageError(
            f"cannot listen on {host}:{port} ({error.strerror or error}): choose another --port, or 0 for a free one"
        ) from None
    return listening


def own_address() -> str:
    """Return this machine's address in its network, loopback where it has none; nothing is sent to find out."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # an address for documentation: it only chooses an interface
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])
