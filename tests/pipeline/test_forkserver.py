"""Stages that a sweep's workers share."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from kendama_cli.pipeline import forkserver

REQUEST: dict[str, Any] = {
    "stage": "measure",
    "declared": "measure",
    "settings": {"own": {"name": "own", "value": {"file": "track.csv", "depth_m": 0.03}}},
    "places": {"track.csv": "/here/track.csv"},
    "parts": {"config": {"own": {"file": "sha256:aa", "depth_m": 0.03}, "seed": 1}},
    "given": {},
    "seed": 1,
}


def asked(seed: int = 1, digest: str = "sha256:aa", depth_m: float = 0.03, place: str = "/here") -> dict[str, Any]:
    request = copy.deepcopy(REQUEST)
    request["seed"] = request["parts"]["config"]["seed"] = seed
    request["parts"]["config"]["own"] = {"file": digest, "depth_m": depth_m}
    request["settings"]["own"]["value"]["depth_m"] = depth_m
    request["places"] = {"track.csv": f"{place}/track.csv"}
    return request


@pytest.mark.parametrize(
    ("second", "made"),
    [
        (asked(), 1),
        (asked(seed=2), 1),
        (asked(digest="sha256:bb"), 2),
        (asked(depth_m=0.04), 2),
        (asked(place="/there"), 2),
    ],
    ids=["the same", "seed", "content of a file", "setting", "place"],
)
def test_a_constructed_stage_is_shared_by_requests_that_differ_in_seed_only(
    monkeypatch: pytest.MonkeyPatch, second: Mapping[str, Any], made: int
) -> None:
    prepared: list[Mapping[str, Any]] = []

    def prepare(request: Mapping[str, Any]) -> SimpleNamespace:
        prepared.append(request)
        return SimpleNamespace(declaration=SimpleNamespace(kind="computes"))

    monkeypatch.setattr(forkserver, "_prepared", prepare)
    stages = forkserver._Stages()
    first = stages.ready(asked())
    assert (stages.ready(second) is first) == (made == 1)
    assert len(prepared) == made
