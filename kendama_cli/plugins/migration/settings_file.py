"""Files of settings by the names of today: those of an older version are rewritten in place."""

from __future__ import annotations

import re
from pathlib import Path

from kendama_cli.config.site import Site
from kendama_cli.errors import UsageError
from kendama_cli.plugins.migration.renamed_text import renamed_yaml
from kendama_cli.schema.renames import new_key
from kendama_cli.store import durable

_PACKAGE = re.compile(r"^#\s*@package\s+(\S+)", re.MULTILINE)


def migrate_file(site: Site, path: Path) -> list[tuple[str, str]]:
    """Rewrite a YAML of settings, of a pipeline or of overrides; return each old name with its new one.

    A file in a group of a ``conf`` folder has keys of that group. Raises UsageError for what is no YAML of keys.
    """
    try:
        text = path.read_text(encoding="utf-8")
        made, changed = renamed_yaml(text, _prefix(site, path, text))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise UsageError(f"--migrate {path}: it cannot be read ({reason}); name a YAML file of settings") from None
    if changed:
        durable.write_file(path, made.encode(), option="--migrate")
    return changed


def _prefix(site: Site, path: Path, text: str) -> str:
    """Return the dotted key below which the file's keys stand; empty for those of a whole configuration."""
    if package := _PACKAGE.search(text):
        named = package.group(1)
        return "" if named in ("_global_", "_group_") else new_key(named)
    folder = path.resolve().parent
    roots = [root.resolve() for root in site.conf_folders]
    inside = next((folder.relative_to(root) for root in roots if folder.is_relative_to(root)), None)
    if inside is None:  # a conf folder that is not in use
        parts = folder.parts
        inside = Path(*parts[parts.index("conf") + 1 :]) if "conf" in parts else Path()
    return new_key(".".join(inside.parts))
