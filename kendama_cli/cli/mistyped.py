"""Mistakes in commands and options: one line, with what to type instead."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Any

from kendama_cli.config.site import find_site, groups
from kendama_cli.pipeline.catalogue import pipeline_names
from kendama_cli.schema.declaration import stage_names
from kendama_cli.schema.hints import nearest
from kendama_cli.schema.renames import command_now_called

ROOT_KEYS = ("seed", "setup")


def mistake(error: Any, arguments: Sequence[str]) -> str:
    """Return one line for ``error``, a usage error of the parser, in ``arguments``."""
    context = getattr(error, "ctx", None)
    path = "" if context is None else str(context.command_path)
    told = " ".join(error.format_message().split()).rstrip(".")
    if hint := command_now_called(path, told):
        return told.partition(". Did you mean")[0] + hint
    option = getattr(error, "option_name", None)
    if option is not None and hasattr(error, "possibilities"):
        return _unknown_option(str(option), context, arguments)
    if told.startswith("No such command"):
        return _unknown_command(context, told, path)
    return told + (f"; see '{path} --help'" if path else "")


def _unknown_option(option: str, context: Any, arguments: Sequence[str]) -> str:
    path = str(context.command_path)
    takes_keys = any(parameter.name == "overrides" for parameter in context.command.params)
    if takes_keys and (line := _as_override(option, arguments)):
        return f"{option} is a key of the configuration, not an option; type {line} without dashes"
    options = [name for parameter in context.command.params for name in getattr(parameter, "opts", ())]
    hint = nearest(option.lstrip("-"), [name[2:] for name in options if name.startswith("--")], "--")
    return f"No such option: {option}{hint + ' See' if hint else '; see'} '{path} --help'"


def _as_override(option: str, arguments: Sequence[str]) -> str:
    """Return ``KEY=VALUE`` for an ``option`` that is a key; empty for any other."""
    key = option.lstrip("-")
    if "." not in key and "/" not in key and key not in (*groups(find_site()), *ROOT_KEYS):
        return ""
    for i, word in enumerate(arguments):
        name, equals, value = word.partition("=")
        if name == option:
            following = arguments[i + 1] if i + 1 < len(arguments) else "VALUE"
            value = value if equals else "VALUE" if following.startswith("-") else following
            return shlex.quote(f"{key}={value}")
    return ""


def _unknown_command(context: Any, told: str, path: str) -> str:
    """Return the message with the commands in the order of how near they are, the nearest as it is typed."""
    word = told.partition("'")[2].partition("'")[0]
    problem = f"No such command '{word}'"
    if context is None:
        return problem
    if context.parent is None and (line := _as_run(word)):
        return f"{problem}; type kendama run {line}"
    names = context.command.list_commands(context)
    if hint := nearest(word, names, f"{path} "):
        return f"{problem}{hint} See '{path} --help'"
    return f"{problem}; it has {', '.join(names)}; see '{path} --help'"


def _as_run(word: str) -> str:
    """Return what to type after ``kendama run`` for an override, a file, a stage or a pipeline; else nothing."""
    if "=" in word:
        return shlex.quote(word)
    if word in stage_names():
        return f"--until {word}"
    if word in pipeline_names(find_site().pipeline_folders):
        return f"-p {word}"
    return shlex.quote(f"capture.path={word}") if "." in word or "/" in word else ""
