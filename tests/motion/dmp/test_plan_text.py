"""Primitives as text: nothing is lost, and what is wrong is named."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
import yaml

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.plan_text import TextFormat, plan_from_text, plan_text
from tests.motion.swings import demonstration, settings


@pytest.fixture(scope="module", params=[1, 3], ids=["one", "average"])
def plan(request: pytest.FixtureRequest) -> MotionPlan:
    swings = [demonstration(1.8 + 0.2 * i) for i in range(request.param)]
    return dataclasses.replace(encode_demonstrations(swings, settings()), tau_scale=1 / 3)


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_every_number_comes_back_to_the_last_bit(plan: MotionPlan, form: TextFormat) -> None:
    again = plan_from_text(plan_text(plan, form), form)
    for field in dataclasses.fields(plan):
        one, other = getattr(plan, field.name), getattr(again, field.name)
        assert np.array_equal(one, other), field.name
        assert np.shape(one) == np.shape(other)


def test_json_is_json_and_yaml_is_yaml(plan: MotionPlan) -> None:
    first = json.loads(plan_text(plan, "json"))
    assert first == yaml.safe_load(plan_text(plan, "yaml"))
    assert first["duration_s"] == plan.duration_s


def changed(plan: MotionPlan, **values: object) -> str:
    return json.dumps({**json.loads(plan_text(plan, "json")), **values})


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"format": "other"}, "no movement primitive: its 'format' is 'other', not 'kendama motion 1'"),
        ({"weight": 1}, "unknown key 'weight'"),
        ({"duration_s": "long"}, "'duration_s' must hold numbers in rows of equal length"),
        ({"duration_s": [1.0]}, "'duration_s' must be a number, not"),
        ({"duration_s": -1.0}, "duration_s must be positive and finite, not -1.0"),
        ({"goal_m": [0.0]}, r"goal_m must have shape \(3,\), not \(1,\)"),
        ({"goal_m": [0.0, float("nan"), 0.0]}, "goal_m holds a value that is not finite"),
        ({"weights": [[1.0], [1.0, 2.0], [1.0]]}, "'weights' must hold numbers in rows of equal length"),
        ({"coordinates": "xyz"}, "'coordinates' must be a list of names"),
        ({"widths": [0.0] * 20}, "widths must be positive; the smallest is 0"),
    ],
)
def test_what_is_wrong_is_named(plan: MotionPlan, values: dict[str, object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        plan_from_text(changed(plan, **values), "json")


def test_a_missing_key_is_named(plan: MotionPlan) -> None:
    document = json.loads(plan_text(plan, "json"))
    del document["centers"]
    with pytest.raises(ValueError, match="the key 'centers' is missing"):
        plan_from_text(json.dumps(document), "json")


@pytest.mark.parametrize(
    ("form", "text", "says"),
    [
        ("json", "{\n  oops", "line 2: not JSON"),
        ("yaml", "a: [1,\nb: 2", "line 3: not YAML"),
        ("yaml", "just words", "its 'format' is 'str'"),
        ("json", "", "line 1: not JSON"),
    ],
)
def test_text_that_is_something_else_is_told_with_its_line(form: TextFormat, text: str, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        plan_from_text(text, form)
