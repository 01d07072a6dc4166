"""``kendama --version``: the commit that the package comes from, Python, the machine and the libraries."""

from __future__ import annotations

import importlib.metadata
import json
import subprocess
from pathlib import Path

from kendama_cli.pipeline.record import versions

GIT_S = 5.0


def version_text() -> str:
    """Return one line for kendama and its commit, one for Python, machine and libraries."""
    found = versions()
    commit = _checked_out(Path(__file__).parents[2]) or _installed_from()
    libraries = ", ".join(f"{name} {version}" for name, version in found.items() if name not in ("kendama", "machine"))
    own = f"kendama {found['kendama']}{f' ({commit})' if commit else ''}"
    return f"{own}\n{libraries}, {found['machine']}"


def _checked_out(root: Path) -> str | None:
    """Return the commit of the clone that the package runs from, and a mark if it was changed since; None outside
    of a clone.
    """
    if not (root / ".git").exists() or not (root / "pyproject.toml").is_file():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=10", "--dirty=, changed since", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=GIT_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return f"commit {done.stdout.strip()}" if done.returncode == 0 else None


def _installed_from() -> str | None:
    """Return the commit that pip installed from a repository, as it noted it (PEP 610); None for any other origin."""
    try:
        noted = importlib.metadata.distribution("kendama-cli").read_text("direct_url.json")
        origin = json.loads(noted or "{}")
        return f"commit {origin['vcs_info']['commit_id'][:10]}"
    except (importlib.metadata.PackageNotFoundError, ValueError, KeyError, TypeError):
        return None
