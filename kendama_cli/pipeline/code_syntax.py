"""The syntax of a module, read for its digest: what of it counts, what it imports, and imports that cannot be known.

Comments and blank lines never count. In our own modules neither do docstrings, declarations of stages, meanings of
settings and what a type checker alone reads: nothing of ours reads them. In a stranger's module everything else counts.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.schema.settings import setting

BY_NAME = ("import_module", "__import__", "run_module", "find_spec", "resolve_name", "files", "get_data")
"""Functions that take the name of a module as their first argument."""
COMPUTED = ("import_module", "__import__", "run_module", "spec_from_file_location", "run_path", "SourceFileLoader")
"""Functions that import what their first argument says, which may be computed."""
IMPORT_ERRORS = {"ImportError", "ModuleNotFoundError", "Exception", "BaseException"}

Syntax = list[object]
"""``[digest, imports, computed]``, as an index keeps it: an import is ``[module, line, may be absent]``."""


def read_syntax(file: Path, name: str, *, is_ours: bool) -> Syntax:
    """Return the digest and imports of the module ``name`` in ``file``; of one that does not parse, of its bytes."""
    data = file.read_bytes()
    try:
        tree = ast.parse(data, filename=str(file))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return [hashlib.sha256(data).hexdigest(), [], []]
    is_package = file.name == "__init__.py"
    statements = list(_statements(tree.body))
    imports = [found for node, guarded in statements for found in _imports(node, name, is_package, guarded=guarded)]
    computed: list[int] = []
    # ours import by name what a declaration names, libraries, and what is offered to users
    if not is_ours and any(function.encode() in data for function in {*BY_NAME, *COMPUTED}):
        named, computed = _named(tree, name, is_package)
        imports += named
    if is_ours:
        _drop_silent(tree)
    return [hashlib.sha256(ast.dump(tree).encode()).hexdigest(), sorted(imports), computed]


def _statements(body: Sequence[ast.stmt]) -> Iterator[tuple[ast.AST, bool]]:
    """Yield every statement that runs, and whether an import in it may fail: nothing else imports by a statement."""
    waiting: list[tuple[ast.AST, bool]] = [(node, False) for node in body]
    while waiting:
        node, guarded = waiting.pop()
        if isinstance(node, ast.If):
            checked, unchecked = _is_type_checking(node.test), _is_type_checking(getattr(node.test, "operand", None))
            waiting += [(one, guarded) for one in (() if checked else node.body)]
            waiting += [(one, guarded) for one in (() if unchecked else node.orelse)]
            continue
        yield node, guarded
        caught = guarded or _catches_import_errors(node)
        waiting += [(one, caught) for one in getattr(node, "body", ()) if isinstance(one, ast.AST)]
        for field in ("orelse", "finalbody", "handlers", "cases"):
            waiting += [(one, guarded) for one in getattr(node, field, ())]


def _is_type_checking(test: ast.AST | None) -> bool:
    return getattr(test, "attr", getattr(test, "id", "")) == "TYPE_CHECKING"


def _catches_import_errors(node: ast.AST) -> bool:
    if isinstance(node, ast.Try):
        types = [handler.type for handler in node.handlers]
    elif isinstance(node, ast.With):
        calls = [item.context_expr for item in node.items if isinstance(item.context_expr, ast.Call)]
        types = [argument for call in calls if _function(call) == "suppress" for argument in call.args]
    else:
        return False
    named = {getattr(one, "id", "") for kind in types if kind is not None for one in ast.walk(kind)}
    return None in types or bool(named & IMPORT_ERRORS)


def _imports(node: ast.AST, name: str, is_package: bool, *, guarded: bool) -> Iterator[list[object]]:
    if isinstance(node, ast.Import):
        yield from ([alias.name, node.lineno, guarded] for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = _absolute("." * node.level + (node.module or ""), name, is_package)
        yield [base, node.lineno, guarded]
        # each may be a module in it, or a value
        yield from ([f"{base}.{alias.name}", node.lineno, True] for alias in node.names)


def _absolute(module: str, name: str, is_package: bool) -> str:
    level = len(module) - len(module.lstrip("."))
    if not level:
        return module
    here = name.split(".") if is_package else name.split(".")[:-1]
    here = here[: len(here) - level + 1]
    return ".".join([*here, module[level:]] if module[level:] else here)


def _named(tree: ast.Module, name: str, is_package: bool) -> tuple[list[list[object]], list[int]]:
    """Return what is imported by a text, and the lines at which a module is imported whose name is computed."""
    called = {
        alias.asname: alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname is not None
    }
    imports: list[list[object]] = []
    computed: list[int] = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not (node.args or node.keywords):
            continue
        function = called.get(_function(node), _function(node))
        if function not in BY_NAME and function not in COMPUTED:
            continue
        keywords = sorted(node.keywords, key=lambda one: one.arg != "name")
        first = node.args[0] if node.args else keywords[0].value
        if function in BY_NAME and isinstance(first, ast.Constant) and isinstance(first.value, str):
            imports.append([_absolute(first.value.partition(":")[0], name, is_package), node.lineno, True])
            if function in COMPUTED:
                imports[-1][2] = False
        elif function in COMPUTED:
            package, dot, _ = _leading(first).partition(".")
            if not dot or function not in BY_NAME:
                computed.append(node.lineno)
            elif package:  # some module in it: all of it counts
                imports.append([package, node.lineno, False])
    return imports, computed


def _leading(node: ast.AST) -> str:
    """Return the constant beginning of a text; a dot where it begins with the name of the module's own package."""
    while True:
        if isinstance(node, ast.JoinedStr) and node.values:
            node = node.values[0]
        elif isinstance(node, ast.FormattedValue):
            node = node.value
        elif isinstance(node, ast.BinOp):
            node = node.left
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):  # a method of the text
            node = node.func.value
        else:
            is_own = isinstance(node, ast.Name) and node.id in ("__package__", "__name__")
            return "." if is_own else str(node.value) if isinstance(node, ast.Constant) else ""


def _function(call: ast.Call) -> str:
    return str(getattr(call.func, "attr", getattr(call.func, "id", "")))


def _drop_silent(tree: ast.Module) -> None:
    """Take out of a module of ours what changes no result."""
    body = [one for item in tree.body for one in (item.orelse if _is_for_checkers(item) else [item])]  # type: ignore[attr-defined]
    tree.body = [item for item in body if not _is_declaration(item)]
    for node in (tree, *(node for node, _ in _statements(tree.body))):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            # bare strings do nothing wherever they stand: docstrings of modules, classes, functions and fields
            node.body = [item for item in node.body if not _is_bare_string(item)]
    for node in ast.walk(tree):  # the meaning of a setting is read by people
        if isinstance(node, ast.Call) and _function(node) == setting.__name__ and node.args:
            node.args = [one for one in node.args if not isinstance(one, (ast.Constant, ast.JoinedStr))]


def _is_for_checkers(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and _is_type_checking(node.test)


def _is_declaration(node: ast.stmt) -> bool:
    """Return True if a stage is declared here: title and chapter must not count, and the key has the rest elsewhere."""
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call)
        and isinstance(node.value.func, ast.Name)
        and node.value.func.id == StageDeclaration.__name__
    )


def _is_bare_string(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
