"""Groups of commands to which installed packages add: the entry point group ``kendama.commands``.

An entry point's name is the command's place (``course``, ``camera.track``), its value ``module:object`` a function with
the parameters that typer reads, or a ``typer.Typer`` with commands of its own. It is imported where it is typed, or
listed in a group's help.
"""

from __future__ import annotations

import sys
from typing import Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from kendama_cli.errors import KendamaError, UsageError
from kendama_cli.schema.registry import comes_with, declared, resolve

COMMANDS = "kendama.commands"
LONGEST_SUMMARY = 400
SECTIONS = {
    "Run": ("run", "plan", "sweep", "config"),
    "Look": ("report", "runs", "diff", "explain", "log"),
    "Record": ("camera",),
    "Robots": ("robot", "setup"),
    "Teach": (),
    "Housekeeping": ("docs", "doctor", "cache"),
}
"""Sections of ``kendama --help`` with our own commands in the order of use; a part's module has a ``SECTION``."""


def open_group(place: str = "") -> type[TyperGroup]:
    """Return the ``typer.Typer(cls=)`` of the group at ``place``: ``camera``, or empty for ``kendama`` itself."""
    before = f"{place}." if place else ""

    class OpenGroup(TyperGroup):
        """The group's own commands in their order, then those of packages."""

        def list_commands(self, ctx: Any) -> list[str]:
            """Return the names of all commands."""
            own = super().list_commands(ctx)
            names = (name.removeprefix(before) for name in sorted(declared(COMMANDS)) if name.startswith(before))
            return [*own, *(name for name in names if "." not in name and name not in own)]

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            """Write the commands with whole summaries, in the sections of ``kendama`` where they stand in some."""
            rows: dict[str, list[tuple[str, str]]] = {}
            for name in self.list_commands(ctx):
                command = self.get_command(ctx, name)
                if command is not None and not command.hidden:
                    section = "Commands" if place else section_of(name)
                    rows.setdefault(section, []).append((name, command.get_short_help_str(LONGEST_SUMMARY)))
            for section in sorted(rows, key=lambda one: (*SECTIONS, one).index(one)):
                with formatter.section(section):
                    formatter.write_dl(sorted(rows[section], key=lambda row: _order(section, row[0])))

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            """Return the command ``cmd_name``; None where there is none. Raises UsageError where a part brings it."""
            own = super().get_command(ctx, cmd_name)
            if own is not None:
                return _with_words(own)
            target = declared(COMMANDS).get(before + cmd_name)
            if target is not None:
                return _with_words(_brought(cmd_name, target, self))
            words = " ".join(("kendama", *(before + cmd_name).split(".")))
            if line := comes_with(f"'{words}'", COMMANDS, before + cmd_name):
                raise UsageError(line)
            return None

    return OpenGroup


def section_of(name: str) -> str:
    """Return the section of ``kendama --help`` in which the command ``name`` stands."""
    own = next((section for section, names in SECTIONS.items() if name in names), None)
    target = declared(COMMANDS).get(name, "")
    module = sys.modules.get(target.partition(":")[0])  # listing its group has imported it
    return own or str(getattr(module, "SECTION", "Others"))


def _with_words(command: Any) -> Any:
    """Return ``command`` whose arguments say in help what they take, not their types in Python."""
    for one in getattr(command, "commands", {}).values():
        _with_words(one)
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            parameter.display_type_rich = lambda ctx: ""
    return command


def _order(section: str, name: str) -> int:
    own = SECTIONS.get(section, ())
    return own.index(name) if name in own else len(own)


def _brought(name: str, target: str, group: TyperGroup) -> Any:
    """Return the command that ``target`` names; one that cannot be imported says so where it is typed, not in help."""
    outer = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=group.rich_markup_mode)
    try:
        found = resolve(target, f"command '{name}'")
    except KendamaError as error:
        loose = {"allow_extra_args": True, "ignore_unknown_options": True}
        outer.command(name, help=str(error), context_settings=loose)(_broken(error))
        return get_command(outer)
    if isinstance(found, typer.Typer):
        outer.add_typer(found, name=name)
        made: Any = get_command(outer)
        return made.commands[name]
    outer.command(name)(found)
    return get_command(outer)


def _broken(error: KendamaError) -> Any:
    """Return a command that raises ``error``."""

    def command(context: typer.Context) -> None:
        raise error

    return command
