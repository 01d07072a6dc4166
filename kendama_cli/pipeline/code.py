"""The digest of a stage's code: every module it imports of its own package and of kendama's, by syntax tree.

Comments, blank lines and docstrings do not count, so that mending a sentence reruns nothing.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.util
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.store import durable

PACKAGE = "kendama_cli"
SETTLED_S = 2.0
"""A file changed more recently than this could change again within one tick of its time stamp: not indexed."""


class FileIndex:
    """Facts about files (digests, imports), remembered by size, time and inode; a cache that may be deleted."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[str, Any] = durable.read_index(path) or {}
        self._changed = False
        self.read: dict[str, list[int]] = {}
        """State of every file that facts were asked of, when it was read."""

    def facts(self, file: Path, kind: str, compute: Any) -> Any:
        """``compute(file)``, remembered while the file stays the same."""
        status = file.stat()
        stamp = [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]
        self.read[str(file)] = stamp
        name = f"{kind}:{file}"
        known = self._known.get(name)
        if known is not None and known[0] == stamp:
            return known[1]
        made = compute(file)
        if time.time() - max(status.st_mtime, status.st_ctime) > SETTLED_S:
            self._known[name] = [stamp, made]
            self._changed = True
        return made

    def save(self) -> None:
        """Keep what was learned for the next invocation."""
        if self._changed:
            durable.write_index(self._path, self._known)
            self._changed = False


def code_digests(targets: Sequence[str], index: FileIndex) -> dict[str, str]:
    """Digest of each module in the import closure of ``targets``, by its path from its package's parent.

    A target is a module, or ``module:name``. Imports are followed within kendama's package and those of the targets.
    Raises UsageError where a target's module cannot be found.
    """
    waiting = sorted({target.partition(":")[0] for target in targets})
    packages = {PACKAGE, *(module.partition(".")[0] for module in waiting)}
    origins = {package: _origin(package) for package in packages}
    for module in waiting:
        if _module_file(origins, module) is None:
            raise UsageError(f"module '{module}' is not installed; check the entry point or declaration that names it")
    digests: dict[str, str] = {}
    seen: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        file = _module_file(origins, name)
        if file is None:
            continue
        place = str(Path(*name.split("."))) + ("/__init__.py" if file.name == "__init__.py" else ".py")
        digest, imports = index.facts(file, f"code {name}", functools.partial(_read_module, name))
        digests[place] = digest
        parents = name.split(".")[:-1]
        waiting += [*imports, *(".".join(parents[: i + 1]) for i in range(len(parents)))]
    return dict(sorted(digests.items()))


def code_digest(place: str, index: FileIndex) -> str | None:
    """The digest of one module by its ``place`` as ``code_digests`` names it; None where it is not installed."""
    name = place.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package = name.partition(".")[0]
    file = _module_file({package: _origin(package)}, name)
    return None if file is None else str(index.facts(file, f"code {name}", functools.partial(_read_module, name))[0])


def _read_module(name: str, file: Path) -> list[Any]:
    tree = ast.parse(file.read_bytes(), filename=str(file))
    # what only a type checker reads changes no result
    tree.body = [item for item in tree.body if not _is_for_type_checkers(item)]
    nodes = list(_statements(tree))
    imports = sorted(_imports(nodes, name, is_package=file.name == "__init__.py"))
    tree.body = [item for item in tree.body if not _is_declaration(item)]
    for node in nodes:
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            # bare strings do nothing wherever they stand: docstrings of modules, classes, functions and fields
            node.body = [item for item in node.body if not _is_bare_string(item)]
    return [hashlib.sha256(ast.dump(tree).encode()).hexdigest(), imports]


def _is_declaration(node: ast.stmt) -> bool:
    """Whether a stage is declared here: title and chapter must not count, and what counts is in the key elsewhere."""
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call)
        and isinstance(node.value.func, ast.Name)
        and node.value.func.id == StageDeclaration.__name__
    )


def _is_for_type_checkers(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def _is_bare_string(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """The tree, and every statement in it: nothing else imports, or has a docstring, and most nodes are expressions."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            waiting += getattr(node, name, ())


def _imports(nodes: Sequence[ast.AST], name: str, *, is_package: bool) -> set[str]:
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                here = name.split(".") if is_package else name.split(".")[:-1]
                here = here[: len(here) - node.level + 1]
                base = ".".join([*here, base] if base else here)
            found |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
    return found


def _origin(package: str) -> Path | None:
    """The file that importing ``package`` runs."""
    spec = importlib.util.find_spec(package)
    return Path(spec.origin) if spec is not None and spec.origin else None


def _module_file(origins: Mapping[str, Path | None], module: str) -> Path | None:
    """The file of ``module`` where it is one of the packages in ``origins``."""
    package, *inside = module.split(".")
    origin = origins.get(package)
    if not inside or origin is None:
        return origin
    if origin.name != "__init__.py":
        return None
    base = origin.parent.joinpath(*inside)
    return next((file for file in (base / "__init__.py", base.with_suffix(".py")) if file.is_file()), None)
