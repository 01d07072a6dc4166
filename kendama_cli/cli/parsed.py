"""A command line that has to be parsed: typer's own complaints become one line and an exit code here."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import typer

from kendama_cli.cli import completion, render
from kendama_cli.cli.app import app
from kendama_cli.errors import UsageError
from kendama_cli.schema.renames import command_now_called

if TYPE_CHECKING:
    from kendama_cli.pipeline.unchanged import Question

USAGE = 2


def run_command(arguments: list[str], asked: Question | None) -> int:
    """Parse and carry out the command line; its exit code. Raises UsageError for what typer does not take.

    ``asked`` is what ``run`` was asked, as it was before anything changed the environment.
    """
    if os.environ.get("_KENDAMA_COMPLETE") == "complete_bash":
        render.text(completion.in_bash(lambda: app(args=[], standalone_mode=False, prog_name="kendama")))
        return 0
    try:
        code = app(args=arguments, standalone_mode=False, prog_name="kendama", obj=asked)
    except typer.Abort:
        raise KeyboardInterrupt from None
    except typer.TyperException as error:
        if error.format_message().startswith("Usage:"):  # no command was given
            render.text(error.format_message())
            return USAGE
        context = getattr(error, "ctx", None)
        told = " ".join(error.format_message().split()).rstrip(".")
        path = "" if context is None else str(context.command_path)
        if hint := command_now_called(path, told):
            raise UsageError(told.partition(". Did you mean")[0] + hint) from error
        raise UsageError(told + (f"; see '{path} --help'" if path else "")) from error
    return code if isinstance(code, int) else 0
