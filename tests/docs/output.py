"""Output that pages show is made by running the commands: ``python -m tests.docs.output --write PAGE`` refreshes it.

A page shows a command with its output in a block of this form; several commands may share a block::

    ```{code-block} console
    $ kendama runs
    no runs yet: kendama run
    ```

The blocks of a page run in order in one new folder, each line beginning with ``$ `` in bash on a terminal of 80 columns
(``pyte``, of the extra ``test``). What the screen shows at the end replaces the lines below the command. Long output is
shortened by the command itself, as a reader would: ``$ kendama config learn | head -5``. In front of a block,

- ``<!-- before: COMMAND -->`` runs a line that is not shown; ``$ROOT`` is the checkout (``cp $ROOT/data/x.csv y.csv``);
- ``<!-- output: slow -->`` anywhere on the page marks its test ``slow``: for pages that run longer than 20 s.

``tests/docs/test_output.py`` runs every page again and compares without times, dates, sizes, paths, hashes and blanks.
"""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import tempfile
import termios
from pathlib import Path

from tests.docs.measure import DOCS, ROOT, pages

COLUMNS, ROWS = 80, 400
BLOCK = re.compile(
    r"(?:^<!-- before: (?P<before>.+) -->\n+)?^```\{code-block\} console\n(?P<body>.*?)^```$", re.M | re.S
)
SLOW = "<!-- output: slow -->"
FOLDER = "kendama-first"
"""Name of the folder in which the commands of a page are typed."""
_VARIES = (
    (re.compile(r"\x1b\[[0-9;?]*[A-Za-z]"), ""),
    (re.compile(r"\d{4}-\d\d-\d\d(?:[T _]\d\d[:-]?\d\d(?:[:-]?\d\d)?)?"), "DATE"),
    (re.compile(r"\b\d{8}[-T]\d{6}\w*"), "DATE"),
    (re.compile(r"\b\d{5}-[0-9a-f]{6}\b"), "RUN"),
    (re.compile(r"-:--:--|\b\d+:\d\d(?::\d\d)?\b"), "TIME"),
    (re.compile(r"(?<![\w.])(?:about )?\d+(?:\.\d+)? ?(?:ms|s|min|minutes?|seconds?|h)\b"), "TIME"),
    (re.compile(r"(?<![\w.])\d+(?:\.\d+)? ?(?:B|kB|MB|GB|KiB|MiB|GiB)\b"), "SIZE"),
    (re.compile(r"(?<![\w.])(?:~|\.{0,2}|\.\w+)/[\w./+-]+"), "PATH"),
    (re.compile(r"\b(?=[0-9a-f]*\d)[0-9a-f]{7,}\b"), "HASH"),
    (re.compile(r"[━╸╺─]+"), "BAR"),
    (re.compile(r"\s+"), " "),
)


def shown() -> list[Path]:
    """Return the pages that show output."""
    return [path for path in pages() if BLOCK.search(path.read_text())]


def commands(body: str) -> list[str]:
    """Return the commands of a block."""
    return re.findall(r"^\$ (.*)$", body, re.M)


def comparable(text: str) -> list[str]:
    """Return the lines of an output without what differs from run to run."""
    for pattern, word in _VARIES[:-1]:
        text = pattern.sub(word, text)
    lines = [_VARIES[-1][0].sub(" ", line).strip() for line in text.splitlines()]
    return [line for line in lines if line]


def refreshed(text: str) -> str:
    """Return the text of a page with the output that its commands make now."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / FOLDER
        folder.mkdir()

        def made(block: re.Match[str]) -> str:
            if block["before"]:
                type_line(block["before"], folder)
            lines = [
                line for command in commands(block["body"]) for line in (f"$ {command}", *type_line(command, folder))
            ]
            head = f"<!-- before: {block['before']} -->\n\n" if block["before"] else ""
            return head + "```{code-block} console\n" + "\n".join(lines) + "\n```"

        return BLOCK.sub(made, text)


def type_line(line: str, folder: Path) -> list[str]:
    """Return the lines of a terminal on which ``line`` was typed in ``folder``."""
    import pyte

    screen = pyte.Screen(COLUMNS, ROWS)
    stream = pyte.ByteStream(screen)
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    done = subprocess.Popen(
        ["bash", "-c", line],
        cwd=folder,
        env=environment(folder),
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    )
    os.close(theirs)
    while True:
        try:
            data = os.read(ours, 65536)
        except OSError:  # Linux's answer where the other end is closed
            break
        if not data:
            break
        stream.feed(data)
    os.close(ours)
    done.wait()
    text = "\n".join(row.rstrip() for row in screen.display).strip("\n")
    return text.replace(str(folder), f"~/{FOLDER}").replace(str(ROOT), "~/kendama").splitlines()


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of a person at a terminal who has set nothing."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("KENDAMA", "PYTEST"))}
    path = f"{Path(sys.executable).parent}{os.pathsep}{kept['PATH']}"
    own = {"ROOT": str(ROOT), "PATH": path, "TERM": "xterm", "BROWSER": "true", "LANG": "C.UTF-8"}
    for name in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "CI"):
        kept.pop(name, None)
    return {**kept, **own}


def main(arguments: list[str]) -> None:
    """Write the pages named after ``--write``, or print those that show output."""
    if arguments[:1] != ["--write"]:
        print(*(path.relative_to(ROOT) for path in shown()), sep="\n")
        return
    for name in arguments[1:]:
        path = next(path for path in (Path(name), DOCS / name, ROOT / name) if path.is_file())
        path.write_text(refreshed(path.read_text()))


if __name__ == "__main__":
    main(sys.argv[1:])
