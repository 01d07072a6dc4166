"""Objects that the combinations of a sweep share stay as made: nobody who plans a run changes them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.config.site import find_site
from kendama_cli.config.sweep import composed_each
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import Remembered, build_settings
from kendama_cli.pipeline.plan import Planner, check_ready
from kendama_cli.pipeline.sweep import SweepJob, distinct
from kendama_cli.store.store import Store


class Copying(Remembered):
    """Keeps a deep copy of everything as it was when it was made."""

    def __init__(self) -> None:
        super().__init__()
        self.made: list[tuple[str, Any, Any]] = []

    def once(self, what: str, of: tuple[object, ...], make: Callable[[], Any]) -> Any:
        def noted() -> Any:
            value = make()
            if what not in ("schemas", "index"):  # types; and the index, which grows
                self.made.append((what, value, copy.deepcopy(value)))
            return value

        return super().once(what, of, noted)


def test_planning_a_sweep_changes_nothing_that_its_runs_share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    site, known = find_site(tmp_path / "home"), Copying()
    declared = load_pipeline("kendama", site.pipeline_folders)
    combinations = [["learn.alpha=0.5", f"seed={seed}"] for seed in range(3)] + [["game.rope.length_m=0.39", "seed=0"]]
    configs = list(composed_each(site, [[*declared.overrides, *texts] for texts in combinations]))
    assert configs[0]["robot"] is configs[2]["robot"]
    before = copy.deepcopy(configs)
    settings = [build_settings(config, known) for config in configs]
    planners = [Planner(Store(site.home), declared, one, site.data_roots, known) for one in settings]
    jobs = distinct([SweepJob(texts, planner) for texts, planner in zip(combinations, planners, strict=True)])
    assert len(jobs) == 4
    for job in jobs:
        check_ready(job.planner, armed=False)
        for plan in job.planner.plan():
            job.planner.files(plan.spec.name)
            if plan.key is not None:
                job.planner.remember(plan)
    assert configs == before
    assert len(known.made) > 30
    assert [what for what, value, as_made in known.made if value != as_made] == []
