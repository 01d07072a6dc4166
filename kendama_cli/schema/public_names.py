"""Public names for parts of other packages, by the module that defines them.

They stand in ``kendama_cli.extension`` alone, as imports that type checkers carry out: read from there, they import
nothing, and the digest of a stranger's code finds what a name brings.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Mapping
from pathlib import Path

EXTENSION = "kendama_cli.extension"


@functools.cache
def homes() -> Mapping[str, str]:
    """Return the module that defines each public name."""
    tree = ast.parse(Path(__file__).parents[1].joinpath("extension.py").read_bytes())
    (offered,) = (node for node in tree.body if isinstance(node, ast.If))
    imports = (node for node in offered.body if isinstance(node, ast.ImportFrom))
    return {alias.name: str(node.module) for node in imports for alias in node.names}


def at_home(modules: list[str]) -> list[str]:
    """Return what a file imports with each public name as the module that defines it.

    A file that imports the extension without naming anything of it may use any name, so it has them all. The extension
    itself is left out: it only offers.
    """
    offered = [one.removeprefix(f"{EXTENSION}.") for one in modules if one.startswith(f"{EXTENSION}.")]
    if EXTENSION in modules and (not offered or "*" in offered):
        offered = list(homes())
    others = [one for one in modules if one != EXTENSION and not one.startswith(f"{EXTENSION}.")]
    return others + [homes()[name] for name in offered if name in homes()]
