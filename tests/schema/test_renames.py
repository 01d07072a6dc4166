"""The table of names that changed: it is closed, and its new names are those of today."""

from __future__ import annotations

import dataclasses
import typing
from typing import Any

import pytest

from kendama_cli.log.messages import ReplayMessage
from kendama_cli.pipeline.nodes import node_schemas
from kendama_cli.schema.declaration import find_stage, stage_names
from kendama_cli.schema.registry import declared
from kendama_cli.schema.renames import RENAMES, new_fact, new_key, new_value, renamed_anywhere
from kendama_cli.schema.settings import variants
from tests.shipped_conf import CONF

SCHEMAS, _ = node_schemas()
DECLARATIONS = {name: find_stage(name) for name in stage_names()}
DECLARED_BY_0_2 = {
    "adapt": ("stages.adapt.stage:Adapt", "artifacts.motion_plan:CatchMotion"),
    "capture": ("stages.capture.stage:Capture", "artifacts.demonstration:DemonstrationSet"),
    "encode": ("stages.encode.stage:Encode", "artifacts.motion_plan:MotionPlan"),
    "identify": ("stages.identify.stage:Identify", "artifacts.friction_model:FrictionModel"),
    "interact": ("stages.interact.stage:Interact", "artifacts.interaction:InteractionResult"),
    "learn": ("stages.learn.stage:Learn", "artifacts.policy:PolicyArtifact"),
    "measure": ("stages.measure.stage:Measure", "artifacts.toy_model:ToyModel"),
    "predict": ("stages.predict.stage:Predict", "artifacts.prediction:PredictionStudy"),
    "rehearse": ("stages.rehearse.stage:Rehearse", "artifacts.rehearsal:Rehearsal"),
    "transfer": ("stages.transfer.stage:Transfer", "artifacts.transfer_result:TransferResult"),
}
"""The class and the artifact of each stage, below kendama_cli, which stand in the keys of what it recorded."""
MESSAGES = {kind.__name__ for one in DECLARATIONS.values() if one for kind in one.topics.values()}


def _hints(annotation: Any, path: list[str]) -> list[Any]:
    """The annotations of the fields at ``path`` below what ``annotation`` allows."""
    if not path:
        return [annotation]
    inner = [one for one in typing.get_args(annotation) if one is not Ellipsis]
    if typing.get_origin(annotation) is tuple or type(None) in inner:
        return [hint for one in inner for hint in _hints(one, path)]
    schemas = [typing.get_type_hints(schema, include_extras=True) for schema in variants(annotation).values()]
    return [hint for fields in schemas if path[0] in fields for hint in _hints(fields[path[0]], path[1:])]


def _fields(annotation: Any, path: list[str]) -> set[str]:
    """The names of the fields of all that stands at ``path``."""
    found = [one for hint in _hints(annotation, path) for one in (hint, *typing.get_args(hint))]
    return {field.name for hint in found for schema in variants(hint).values() for field in dataclasses.fields(schema)}


@pytest.mark.parametrize("one", [one for one in RENAMES if one.kind == "key"], ids=lambda one: f"{one.where}.{one.new}")
def test_a_new_key_is_one_of_the_settings_and_the_old_one_is_none(one):
    node, *path = one.where.split(".")
    names = _fields(SCHEMAS[node], path)
    assert one.new in names
    assert one.old not in names


def test_topics_messages_metrics_and_stages_of_the_table_are_todays():
    topics = {topic for stage in DECLARATIONS.values() if stage for topic in stage.topics}
    for one in RENAMES:
        if one.kind == "topic":
            assert one.new in topics
            assert one.old not in topics
        elif one.kind == "message":
            assert f"{one.new}Message" in MESSAGES
            assert f"{one.old}Message" not in MESSAGES
        elif one.kind == "metric":
            assert one.where in DECLARATIONS
        elif one.kind == "group":
            assert declared(one.new)
            assert not declared(one.old)
    assert ReplayMessage.__name__ in MESSAGES


@pytest.mark.parametrize(
    "one", [one for one in RENAMES if one.kind == "value"], ids=lambda one: f"{one.where}={one.new}"
)
def test_a_new_value_is_one_that_is_shipped_or_allowed_and_the_old_one_is_not(one):
    names = {path.stem for path in (CONF / one.where.replace(".", "/")).glob("*.yaml")}
    if not names:
        node, *path = one.where.split(".")
        names = {str(choice) for hint in _hints(SCHEMAS[node], path) for choice in typing.get_args(hint)}
    assert one.new in names
    assert one.old not in names


@pytest.mark.parametrize("name", DECLARED_BY_0_2)
def test_what_a_stage_of_0_2_recorded_has_the_class_and_the_artifact_of_today(name):
    stage = DECLARATIONS[name]
    assert stage is not None
    names = [renamed_anywhere("object", f"kendama_cli.{one}") for one in DECLARED_BY_0_2[name]]
    assert names == [stage.run, stage.returns]


def test_a_key_is_renamed_part_by_part_whatever_of_it_is_new_already():
    assert new_key("adapt.eyes.onset.pull_m_s2") == "adapt.sensor_model.onset.min_tension_m_s2"
    assert new_key("adapt.sensor_model.onset.pull_m_s2") == "adapt.sensor_model.onset.min_tension_m_s2"
    assert new_key("interact.script[3].turn_rad") == "interact.script[3].rotation_rad"
    assert new_key("mine.cap") == "mine.cap"


def test_groups_of_keys_are_renamed_with_all_that_they_hold():
    before = {"catch": "open", "eyes": {"onset": {"pull_m_s2": 6.0}}, "size": 1.0}
    after = {"catch": "open_loop", "sensor_model": {"onset": {"min_tension_m_s2": 6.0}}, "swing_scale": 1.0}
    assert new_value("adapt", before) == after
    assert new_value("scene", {"bodies": [{"name": "cap"}]}) == {"bodies": [{"name": "cap"}]}


def test_a_fact_is_a_metric_or_a_key():
    assert new_fact("learn.rollouts_to_proof") == "learn.rollouts_to_solved"
    assert new_fact("learn.count.cap") == "learn.count.max_rollouts"
    assert new_fact("roll.windows") == "roll.windows"
