"""A socket that listens: nothing heavy is imported here, so that a taken port is told at once."""

from __future__ import annotations

import socket

from kendama_cli.errors import UsageError

Listening = socket.socket


def listen(host: str, port: int) -> Listening:
    """A socket that listens there, 0 for any free port; raises UsageError."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listening = socket.create_server((host, port), family=family)
    except OSError as error:
        raise UsageError(
            f"cannot listen on {host}:{port} ({error.strerror or error}): choose another --port, or 0 for a free one"
        ) from None
    return listening
