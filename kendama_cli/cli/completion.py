"""Shell completion for stages, pipelines, runs, groups and keys. Never fails: at worst it offers nothing."""

from __future__ import annotations

import contextlib
import functools
import io
import os
import shlex
from collections.abc import Callable

from kendama_cli.config.site import find_site
from kendama_cli.errors import KendamaError

MOST_RUNS = 50
"""Number of runs whose stages are offered: each has a record to read."""


def in_bash(answer: Callable[[], object]) -> str:
    """Return the output of ``answer`` for the word under bash's cursor, as bash expects it.

    Bash cuts words at ``=``: ``capture=ii`` comes as three words, and only what follows the last ``=`` is replaced.
    """
    try:
        words, cursor = shlex.split(os.environ["COMP_WORDS"]), int(os.environ["COMP_CWORD"])
    except (KeyError, ValueError):  # ValueError: a quote that is still open
        return ""
    joined: list[str] = []
    for i, word in enumerate([*words, ""][: cursor + 1]):
        glued = joined and i > 1 and (word == "=" or words[i - 1] == "=")
        joined[-1:] = [joined[-1] + word] if glued else [*joined[-1:], word]
    os.environ.update(COMP_WORDS=shlex.join(joined), COMP_CWORD=str(len(joined) - 1))
    known = joined[-1].rpartition("=")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
        answer()
    cut = len(known[0] + known[1]) if "=" in words[max(cursor - 1, 0) : cursor + 1] else 0
    return "\n".join(line[cut:] for line in printed.getvalue().splitlines())


def quietly(offer: Callable[[str], list[str]]) -> Callable[[str], list[str]]:
    """Return ``offer`` for the words that begin as typed; empty where it fails."""

    @functools.wraps(offer)
    def complete(incomplete: str) -> list[str]:
        try:
            return [word for word in offer(incomplete) if word.startswith(incomplete)]
        except (KendamaError, OSError):
            return []

    return complete


@quietly
def pipelines(incomplete: str) -> list[str]:
    """Return the names of pipelines."""
    from kendama_cli.pipeline.catalogue import pipeline_names

    return pipeline_names(find_site().pipeline_folders)


@quietly
def stages(incomplete: str) -> list[str]:
    """Return the names of the stages of all pipelines."""
    from kendama_cli.pipeline.catalogue import load_pipeline, pipeline_names

    folders = find_site().pipeline_folders
    return sorted({spec.name for name in pipeline_names(folders) for spec in load_pipeline(name, folders).stages})


@quietly
def runs(incomplete: str) -> list[str]:
    """Return the ids of past runs, newest first."""
    from kendama_cli.store.home import run_names

    return run_names(find_site().home)[::-1]


@quietly
def selections(incomplete: str) -> list[str]:
    """Return the ids of past runs, newest first, and ``last``; after ``sweep:`` the names of sweeps."""
    from kendama_cli.pipeline.run_selection import LAST, SWEEP, sweep_names
    from kendama_cli.store.home import run_names

    home = find_site().home
    if incomplete.startswith(SWEEP):
        return [f"{SWEEP}{name}" for name in sweep_names(home)]
    return [*run_names(home)[::-1], LAST, SWEEP]


@quietly
def export_formats(incomplete: str) -> list[str]:
    """Return the formats of ``log export``."""
    from kendama_cli.pipeline.log_export import EXPORTERS
    from kendama_cli.schema.registry import declared

    return sorted(declared(EXPORTERS))


@quietly
def executors(incomplete: str) -> list[str]:
    """Return the executors."""
    from kendama_cli.settings.executor import EXECUTORS

    return EXECUTORS.kinds()


@quietly
def artifacts(incomplete: str) -> list[str]:
    """Return STAGE of the newest run, then RUN/STAGE of the newest runs that begin so."""
    from kendama_cli.pipeline.record import read_run
    from kendama_cli.store.home import run_names

    home, run = find_site().home, incomplete.partition("/")[0]
    names = run_names(home)[::-1]
    begun = [name for name in names if name.startswith(run)][:MOST_RUNS]
    records = [record for name in [*names[:1], *begun] if (record := read_run(home, name)) is not None]
    newest = [str(stage["name"]) for stage in records[0]["stages"]] if records else []
    return newest + [f"{record['run']}/{stage['name']}" for record in records[1:] for stage in record["stages"]]


@quietly
def overrides(incomplete: str) -> list[str]:
    """Return groups, keys, and the options of a group after its ``=``."""
    from kendama_cli.config import compose
    from kendama_cli.config.site import group_options, groups

    site = find_site()
    group, equals, _ = incomplete.partition("=")
    if equals:
        return [f"{group}={option}" for option in group_options(site, group)]
    names = groups(site)
    return [*(f"{name}=" for name in names), *(f"{key}=" for key in compose.keys(site) if key not in names)]
