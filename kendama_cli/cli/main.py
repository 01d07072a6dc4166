"""The ``kendama`` command: carries it out and turns every error into one line and an exit code.

Nothing here imports the command line's parser: a run with nothing to do is told from its files alone. Every other
command imports nothing of how that is told.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
from types import FrameType
from typing import TYPE_CHECKING

from kendama_cli.cli import render
from kendama_cli.errors import KendamaError, brings

if TYPE_CHECKING:
    from kendama_cli.pipeline.command_cache import CommandKey

INTERRUPTED = 130
KEPT = "what was finished is kept, the same command goes on from there"
NOT_KEPT = "what was not finished is not kept, the same command begins anew"


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; 0 done, 1 a stage failed, 2 wrong usage or configuration, 130 interrupted."""
    signal.signal(signal.SIGTERM, _interrupt)
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as nohup sets it
        signal.signal(signal.SIGHUP, _interrupt)
    words = sys.argv[1:] if arguments is None else arguments
    try:
        code = _carry_out(words)
        if sys.stdout is not None:
            sys.stdout.flush()
    except KendamaError as error:
        if os.environ.get("KENDAMA_DEBUG"):
            raise
        render.error(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        code = INTERRUPTED
    except BrokenPipeError:
        # the reader of our output (head, less) has left: nobody to tell, and nothing to flush at exit
        _discard_output()
        code = 1
    except (OSError, MemoryError) as error:
        if os.environ.get("KENDAMA_DEBUG"):
            raise
        render.error(_of_the_system(error))
        _discard_output()
        code = 1
    except Exception as error:
        if os.environ.get("KENDAMA_DEBUG"):
            raise
        if isinstance(error, ModuleNotFoundError):  # a part's library, of an extra
            render.error(f"this needs module '{error.name}', which is not installed; {brings(error.name or '')}")
            return 2
        render.error(f"{type(error).__name__}: {error} (unexpected; KENDAMA_DEBUG=1 shows its traceback)")
        code = 1
    if code == INTERRUPTED:  # typer itself turns Ctrl-C inside a command into this code
        render.error(f"interrupted; {NOT_KEPT if words[:1] == ['camera'] else KEPT}")
    return code


def _of_the_system(error: OSError | MemoryError) -> str:
    """Return the operation that the system refused, and the next step."""
    if isinstance(error, MemoryError):
        return "the memory is used up; end other programs, or ask for less at once"
    number, reason = error.errno or 0, error.strerror or str(error)
    hint = {errno.EMFILE: "; raise the limit (ulimit -n)", errno.ENFILE: "; end other programs"}.get(number, "")
    if error.filename is not None:
        return f"{error.filename}: {reason}{hint}"
    known = {errno.ENOENT: "the current folder is gone", errno.EMFILE: "a process needs more files"}
    return f"{known.get(number, 'the output cannot be written')}: {reason}{hint}"


def _discard_output() -> None:
    """Discard unwritten output, so that Python does not complain at the end that it cannot write it."""
    with contextlib.suppress(OSError, AttributeError, ValueError):  # closed, or none at all
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _carry_out(arguments: list[str]) -> int:
    asked: CommandKey | None = None
    if "run" in arguments and "_KENDAMA_COMPLETE" not in os.environ:
        from kendama_cli.cli.repeat import repeat_run  # noqa: PLC0415 - the store, which few commands need
        from kendama_cli.pipeline.command_cache import command_key  # noqa: PLC0415

        asked = command_key(arguments)
        repeated = repeat_run(asked)
        if repeated is not None:
            return repeated
    from kendama_cli.cli.app import run_command  # noqa: PLC0415 - typer, and all commands

    return run_command(arguments, asked)


def _interrupt(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
