"""Forks a child for each question on standard input, has the disk fail in it as asked, and answers how it ended.

Started with the shim preloaded: it is in every child, and does nothing until the child arms it.
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
import traceback
from pathlib import Path
from typing import Any

from kendama_cli.errors import KendamaError
from tests.faults.store_work import work


def carry_out(asked: dict[str, Any]) -> None:
    """Work in this process, which ends; what was told and how it ended goes to ``asked["told"]``."""
    told = os.open(asked["told"], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    journal = os.open(asked["journal"], os.O_WRONLY | os.O_CREAT) if asked["journal"] else -1
    shim = ctypes.CDLL(None)

    def tell(line: str) -> None:
        os.write(told, f"{line}\n".encode())
        if journal >= 0:
            data = line.encode()
            os.write(journal, b"T" + (len(data)).to_bytes(4, "little") + bytes(8) + data)

    ending = "done"
    shim.disk_arm(os.fsencode(asked["home"]), asked["at"], asked["kind"], asked["repeating"], journal)
    try:
        work(Path(asked["home"]), tell)
    except KendamaError as error:
        lines = str(error).splitlines()
        ending = "refused" if len(lines) == 1 else f"traceback {lines}"
    except BaseException:
        ending = f"traceback {traceback.format_exc()}"
    calls = shim.disk_calls()
    shim.disk_arm(b"", 0, 0, 0, -1)
    os.write(told, (json.dumps({"ending": ending, "calls": calls}) + "\n").encode())
    os._exit(0)


def main() -> None:
    for line in sys.stdin:
        pid = os.fork()
        if pid == 0:
            carry_out(json.loads(line))
        _, status = os.waitpid(pid, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


if __name__ == "__main__":
    main()
