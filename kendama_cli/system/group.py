"""Folders that a group shares: what is made in one, its members may change, whatever the umask of who made it."""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path

OF_A_GROUP = stat.S_ISGID | stat.S_IWGRP


def share_with_group(path: Path) -> None:
    """Let the group write a new file or folder whose folder a group shares (setgid, and the group may write)."""
    with contextlib.suppress(OSError):  # somebody else's: it is as they made it
        if os.stat(path.parent).st_mode & OF_A_GROUP == OF_A_GROUP:
            mode = os.stat(path).st_mode
            os.chmod(path, stat.S_IMODE(mode) | (0o2770 if stat.S_ISDIR(mode) else 0o660))
