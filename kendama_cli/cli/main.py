"""The ``kendama`` command: runs the app and turns every error into one line and an exit code."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

import typer

from kendama_cli.cli import completion, render
from kendama_cli.cli.app import app
from kendama_cli.errors import KendamaError

USAGE = 2
INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; 0 done, 1 a stage failed, 2 wrong usage or configuration, 130 interrupted."""
    signal.signal(signal.SIGTERM, _interrupt)
    if os.environ.get("_KENDAMA_COMPLETE") == "complete_bash":
        render.text(completion.in_bash(lambda: app(args=[], standalone_mode=False, prog_name="kendama")))
        return 0
    try:
        code = app(args=arguments, standalone_mode=False, prog_name="kendama")
    except KendamaError as error:
        if os.environ.get("KENDAMA_DEBUG"):
            raise
        render.error(str(error))
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except typer.TyperException as error:
        if error.format_message().startswith("Usage:"):  # no command was given
            render.text(error.format_message())
            return USAGE
        context = getattr(error, "ctx", None)
        where = f"; see '{context.command_path} --help'" if context is not None else ""
        render.error(" ".join(error.format_message().split()).rstrip(".") + where)
        return USAGE
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
    return code if isinstance(code, int) else 0


def _interrupt(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
