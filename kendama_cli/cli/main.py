"""The ``kendama`` command: carries it out and turns every error into one line and an exit code.

Nothing here imports the command line's parser: a run with nothing to do is told from its files alone.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

from kendama_cli.cli import render
from kendama_cli.cli.repeat import repeat_run
from kendama_cli.errors import KendamaError
from kendama_cli.pipeline.unchanged import Question, question

INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; 0 done, 1 a stage failed, 2 wrong usage or configuration, 130 interrupted."""
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        asked = question(sys.argv[1:] if arguments is None else arguments)
        repeated = None if "_KENDAMA_COMPLETE" in os.environ else repeat_run(asked)
        code = _parsed(asked) if repeated is None else repeated
    except KendamaError as error:
        if os.environ.get("KENDAMA_DEBUG"):
            raise
        render.error(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        code = INTERRUPTED
    except BrokenPipeError:
        # the reader of our output (head, less) has left: nobody to tell, and nothing to flush at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    except Exception as error:
        if os.environ.get("KENDAMA_DEBUG"):
            raise
        render.error(f"{type(error).__name__}: {error} (not foreseen; KENDAMA_DEBUG=1 shows its traceback)")
        code = 1
    if code == INTERRUPTED:  # typer itself turns Ctrl-C inside a command into this code
        render.error("interrupted; what was finished is kept, the same command goes on from there")
    return code


def _parsed(asked: Question) -> int:
    from kendama_cli.cli.parsed import run_command  # noqa: PLC0415 - typer, and all commands

    return run_command(asked)


def _interrupt(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
