"""Names that users wrote or runs recorded, and that changed: one table, from which each answer to an old name comes.

An old name is refused in one line with the new one; the part ``migration`` rewrites files of settings and homes by this
table. Where a name stands is said in new names: ``adapt.sensor_model.onset``.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["key", "value", "metric", "command", "topic", "message", "field", "pipeline", "group", "object"]

SINCE = "0.3"
"""The version that has the new names."""


@dataclass(frozen=True)
class Rename:
    """One name that changed; ``where`` is what holds it, empty for what stands alone.

    Of a key it is the group of keys, of a value the key, of a metric the stage's declaration, of a command the group of
    commands, of a field the message or the artifact.
    """

    kind: Kind
    where: str
    old: str
    new: str


KEYS = """
adapt: eyes sensor_model, steering correction, size swing_scale, tilt_share tilt_fraction
adapt.uncertainty: mass_share mass_fraction, joint_friction_share joint_friction_fraction, least_reach_m min_reach_m
adapt.sensor_model.onset: pull_m_s2 min_tension_m_s2
adapt.correction: believed_sigma_m max_sigma_m, settled_before_s freeze_before_catch_s
adapt.policy: lasting stop_at
capture: longest_gap_s max_gap_s, felt_share felt_fraction, fastest_m_s max_speed_m_s
capture.coupling: most_n max_force_n, most_n_s max_force_rate_n_s
encode: rest_share rest_fraction, margin_share margin_fraction
hardware: largest_correction_deg max_correction_deg
hardware.imperfection: joint_friction_share joint_friction_fraction, tracking_lost_share tracking_lost_fraction
identify: limit_share limit_ratio, slowest_rad_s min_speed_rad_s
interact: most_error_m max_error_m
interact.script: turn_rad rotation_rad
learn: bodies randomisation
learn.validation: bodies randomisation
learn.randomisation: narrowing workspace_shrink
learn.validation.randomisation: narrowing workspace_shrink
learn.count: streak learned_streak, cap max_rollouts, frozen solved_streak, evaluation evaluation_rollouts
learn.exploration: varied mutation_fraction, remembered elite_size
learn.goal: slowest_rad_s min_rate_rad_s, fastest_rad_s max_rate_rad_s
learn.decision: shortest_s min_s, longest_s max_s
learn.learner: fastest_rad_s max_rate_rad_s, drawn_rollouts sampled_rollouts
play: longest_try_s max_attempt_s, most_players max_players, most_tries max_attempts
play.ease: least_gravity_share min_gravity_fraction, most_cup_scale max_cup_scale
play.reach: aside_m lateral_m
predict: seen_fractions observed_fractions
predict.onset: pull_m_s2 min_tension_m_s2
rehearse: most_behind_rad max_tracking_error_rad, most_apart_rad max_twin_deviation_rad
robot: held_joints locked_joints
safety: limit_share limit_ratio
transfer: evaluation_n evaluation_rollouts, cap max_rollouts, frozen solved_streak
transfer: imitation_tries imitation_attempts
transfer.observation: believed_sigma_m max_sigma_m
transfer.catch: give_m_s contact_speed_m_s, give_braking_m_s2 contact_braking_m_s2
transfer.catch: settled_before_s freeze_before_catch_s
"""
VALUES = """
adapt.catch: seen visual, open open_loop
adapt.placement: given fixed
learn.harmonic.drives: suited auto
learn.learner: lucky random_replay, pump energy_pumping
learn.learner.kind: lucky random_replay, pump energy_pumping
learn.task: paper paper_caught
predict.detector: taught trained
predict.detector.kind: taught trained
safety: usual default
transfer: proof until_solved
"""
"""Values of a key, or of a group that names a file of ``conf/``."""
METRICS = """
adapt: in_the_way failure_reason, rollouts_to_lasting rollouts_to_robust, repeats_to_judge evaluations
adapt: shift_mm goal_shift_mm, side_miss_mm lateral_miss_mm, windows tau_windows
interact: contact_share contact_fraction
learn: rollouts_to_first rollouts_to_learned, rollouts_to_proof rollouts_to_solved, proven solved
learn: chance_rate random_success_rate, swings half_swings
predict: horizon_ms prediction_horizon_ms, seen_fraction observed_fraction
rehearse: behind_rms_mrad tracking_error_rms_mrad, behind_most_mrad tracking_error_max_mrad
rehearse: apart_from_twin_most_mrad twin_deviation_max_mrad
transfer: rollouts_to_proof rollouts_to_solved, proven solved, went_back reverted
transfer: imitation_tries imitation_attempts, seen_rate detection_rate
"""
COMMANDS = """
kendama: referee cross-check
kendama camera: teach train
kendama camera detect: --teach --train
kendama camera track: --teach --train
kendama report: --film --video
kendama setup: toy kendama
"""
TOPICS = "adapt: /adapt/drawn /adapt/perturbation, /adapt/proof /adapt/evaluation"
MESSAGES = "log: AdaptDraw AdaptPerturbation, AdaptProof AdaptEvaluation"
FIELDS = """
AdaptPerturbation: joint_friction_share joint_friction_fraction
AdaptRepeat: largest_shift_m max_shift_m
FrictionModel: fastest_rad_s max_speed_rad_s
"""
"""Fields of a message in logs, or of an artifact."""
PIPELINES = "pipelines: toy measurement"
GROUPS = "entry points: kendama.hands kendama.demonstrators"
OBJECTS = """
kendama_cli: kendama_cli.artifacts.toy_model:ToyModel kendama_cli.artifacts.kendama_model:KendamaModel
kendama_cli: kendama_cli.stages.interact.stage:Interact kendama_cli.plugins.interact.stage:Interact
kendama_cli: kendama_cli.stages.identify.stage:Identify kendama_cli.plugins.identification.friction_stage:Identify
kendama_cli: kendama_cli.stages.measure.stage:Measure kendama_cli.plugins.identification.swing_stage:Measure
kendama_cli: kendama_cli.stages.rehearse.stage:Rehearse kendama_cli.plugins.rehearsal.stage:Rehearse
kendama_cli: kendama_cli.artifacts.rehearsal:Rehearsal kendama_cli.plugins.rehearsal.artifact:Rehearsal
kendama_cli: kendama_cli.artifacts.interaction:InteractionResult kendama_cli.plugins.interact.artifact:InteractionResult
"""
"""``module:name`` of a stage's class or artifact, which stands in the key of what was recorded."""


def _rows() -> Iterator[Rename]:
    tables: Mapping[Kind, str] = {
        "key": KEYS,
        "value": VALUES,
        "metric": METRICS,
        "command": COMMANDS,
        "topic": TOPICS,
        "message": MESSAGES,
        "field": FIELDS,
        "pipeline": PIPELINES,
        "group": GROUPS,
        "object": OBJECTS,
    }
    for kind, text in tables.items():
        for line in filter(None, text.splitlines()):
            where, _, pairs = line.partition(": ")
            for pair in pairs.split(", "):
                old, new = pair.split(" ")
                yield Rename(kind, where, old, new)


RENAMES = tuple(_rows())
_NEW = {(one.kind, one.where, one.old): one.new for one in RENAMES}
_INDEX = re.compile(r"\[\d+\]$")


def renamed(kind: Kind, where: str, old: str) -> str | None:
    """Return the new name of ``old``; None where it did not change."""
    return _NEW.get((kind, where, old))


def new_key(key: str) -> str:
    """Return a dotted key of the configuration by the names of today; each part may have its old or its new one."""
    known, made = "", ""
    for part in key.split("."):
        name = _INDEX.sub("", part)
        new = _NEW.get(("key", known, name), name)
        known, made = _joined(known, new), _joined(made, new + part.removeprefix(name))
    return made


def new_value(key: str, value: Any) -> Any:
    """Return a value at a dotted ``key`` (new names) as it is called today; groups of keys with all that they hold."""
    if isinstance(value, Mapping):
        return {
            (name := renamed("key", key, str(old)) or str(old)): new_value(_joined(key, name), one)
            for old, one in value.items()
        }
    if isinstance(value, list | tuple):
        return [new_value(key, one) for one in value]
    return renamed("value", key, value) or value if isinstance(value, str) else value


def renamed_anywhere(kind: Kind, old: str) -> str:
    """Return the new name of ``old`` where names of its kind are unique; ``old`` itself where it did not change."""
    return next((one.new for one in RENAMES if (one.kind, one.old) == (kind, old)), old)


def new_fact(key: str) -> str:
    """Return ``node.key`` or ``stage.metric``, as ``kendama runs`` takes them, by the names of today."""
    stage, _, metric = key.partition(".")
    return f"{stage}.{new}" if (new := renamed("metric", stage, metric)) else new_key(key)


def now_called(old: str, new: str) -> str:
    """Return the words after what was not found: ``; since 0.3 it is called 'new'``; empty where it is ``old``."""
    return "" if new == old else f"; since {SINCE} it is called '{new}'"


def near_old_value(key: str, value: object) -> str:
    """Return the value of today whose old name is spelled nearest to a ``value`` of ``key``; empty if none is near."""
    old = {one.old: one.new for one in RENAMES if (one.kind, one.where) == ("value", new_key(key))}
    return next((old[word] for word in difflib.get_close_matches(str(value), old, n=1, cutoff=0.6)), "")


def value_now_called(key: str, value: object, allowed: Iterable[str]) -> str:
    """Return the same for a value of ``key``, in an error that lists what is ``allowed``; empty where none changed."""
    new = renamed("value", new_key(key), str(value))
    return now_called(str(value), new) if new in set(allowed) and new is not None else ""


def command_now_called(where: str, message: str) -> str:
    """Return the same for a command or option of the group ``where`` that ``message`` says is not there."""
    said = (one for one in RENAMES if one.kind == "command" and one.where == where)
    found = (now_called(one.old, one.new) for one in said if re.search(rf"(?<![\w-]){one.old}(?![\w-])", message))
    return next(found, "")


def _joined(before: str, name: str) -> str:
    return f"{before}.{name}" if before else name
