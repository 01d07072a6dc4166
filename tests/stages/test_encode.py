import dataclasses
import re

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration, DemonstrationSet
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import InputError, StageError
from kendama_cli.motion.dmp.plan_text import plan_text
from kendama_cli.motion.dmp.primitive import play, sample_plan
from kendama_cli.stages.encode.stage import Encode
from tests.memory_context import MemoryContext
from tests.motion.swings import demonstration, path, settings


def encode(demonstrations, ctx=None, **changes):
    given = {"capture": DemonstrationSet(tuple(demonstrations))}
    return Encode(encode=settings(**changes)).run(given, ctx or MemoryContext())


def test_one_demonstration_is_enough():
    made = encode([demonstration()])
    assert isinstance(made.artifact, MotionPlan)
    assert made.artifact.tau_scale == 1.0
    assert made.metrics["n_parameters"] == 22
    assert made.metrics["spread_mm"] == pytest.approx(0, abs=1e-9)
    assert made.metrics["outliers"] == "none"
    assert made.metrics["duration_spread_s"] == 0


def test_many_of_other_durations_and_rates_give_one_primitive():
    swings = [
        demonstration(1.7, 120, name="a"),
        demonstration(2.2, 60, name="b"),
        demonstration(2.0, 250, name="c", head_s=0.5),
    ]
    metrics = encode(swings).metrics
    assert metrics["rmse_mm"] < 0.5
    assert metrics["rmse_mm"] <= metrics["max_error_mm"]
    assert 0 < metrics["spread_mm"] < 1  # the same swing: what is left is where onset and end were found
    assert metrics["averaged"] == 3


def test_metrics_are_of_each_demonstration_by_its_own_primitive():
    """Two very different swings: the error stays that of one, the spread does not."""
    swing = demonstration()
    mirrored = dataclasses.replace(swing, name="mirror", position_m=-swing.position_m)
    alone, both = encode([swing]).metrics, encode([swing, mirrored]).metrics
    assert both["rmse_mm"] == pytest.approx(alone["rmse_mm"])
    assert both["max_error_mm"] == pytest.approx(alone["max_error_mm"])
    assert both["spread_max_mm"] > 100
    assert both["spread_mm"] > 50


def error_mm(plan):
    """The largest distance of a primitive from the formula of the swing of 1 s behind it, placed where it fits."""
    t = np.linspace(0, plan.duration_s, 400)
    made = play(plan, t).position_m
    onsets = np.linspace(0.0, 1.0 - plan.duration_s, 200)
    away = [made - path(onset + t, 1.0) for onset in onsets]
    return 1e3 * min(np.linalg.norm(one - one.mean(axis=0), axis=1).max() for one in away)


@pytest.mark.parametrize("rate_hz", [12, 14, 16])
def test_a_motion_of_fewer_samples_than_numbers_is_told_with_the_error_to_expect(rate_hz):
    made = encode([demonstration(1.0, rate_hz, head_s=0.3, tail_s=0.3, name="slow")])
    (told,) = made.warnings
    assert re.match(r"slow: \d+ samples show its motion of \S+ s \(\S+ Hz\), and the primitive has 22 numbers", told)
    expected_mm = float(re.search(r"expect an error of (\d+) mm at worst", told)[1])
    assert expected_mm == pytest.approx(error_mm(made.artifact), rel=0.5, abs=1)
    better_hz = int(re.search(r"record at (\d+) Hz or more", told)[1])
    finer = encode([demonstration(1.0, better_hz, head_s=0.3, tail_s=0.3)])
    assert finer.warnings == ()
    assert error_mm(finer.artifact) < 3


def test_a_motion_whose_samples_leave_more_than_the_mouths_play_unknown_is_refused():
    with pytest.raises(StageError, match=r"slow: 11 samples .* 39 mm at worst.*\(allowed: 25 mm"):
        encode([demonstration(1.0, 6, head_s=0.3, tail_s=0.3, name="slow")])


def test_the_log_holds_what_was_demonstrated_and_what_is_reproduced():
    ctx = MemoryContext()
    plan = encode([demonstration(name="a"), demonstration(2.2, name="b")], ctx).artifact
    children = {}
    for topic, t_s, message in ctx.log.messages:
        if topic != "/encode/weights":
            children.setdefault(topic, {}).setdefault(message.child, []).append((t_s, message.position_m))
    assert set(children["/encode/demonstrated"]) == {"a", "b"}
    assert set(children["/encode/own"]) == {"a", "b"}
    assert set(children["/encode/reproduced"]) == {"reproduced"}
    for name, samples in children["/encode/own"].items():
        there = np.array([position for _, position in children["/encode/demonstrated"][name]])
        assert np.linalg.norm(np.array([position for _, position in samples]) - there, axis=1).max() < 1e-3
    t_s, position_m = (np.array(column) for column in zip(*children["/encode/reproduced"]["reproduced"], strict=True))
    assert np.allclose(position_m, play(plan, t_s).position_m)
    for samples in children["/encode/demonstrated"].values():
        assert samples[0][0] == 0
        assert np.linalg.norm(samples[0][1]) < 1e-3  # relative to its start


def test_the_log_holds_the_weights_of_each_demonstration_and_of_the_average():
    ctx = MemoryContext()
    plan = encode([demonstration(name="a"), demonstration(2.2, name="b")], ctx).artifact
    weights = {
        (message.demonstration, message.coordinate): np.array(message.values)
        for topic, _, message in ctx.log.messages
        if topic == "/encode/weights"
    }
    assert set(weights) == {(name, axis) for name in ("a", "b", "reproduced") for axis in "xyz"}
    assert np.array_equal(weights["reproduced", "z"], plan.weights[2])
    assert np.allclose((weights["a", "x"] + weights["b", "x"]) / 2, plan.weights[0])


def many(odd=None):
    """Six swings of one kind, the fourth replaced by ``odd``."""
    rng = np.random.default_rng(4)
    made = []
    for i in range(6):
        swing = demonstration(2.0 + 0.05 * rng.standard_normal(), name=f"swing-{i}")
        made.append(dataclasses.replace(swing, position_m=swing.position_m * (1 + 0.04 * rng.standard_normal())))
    if odd is not None:
        made[3] = odd
    return made


def test_an_outlier_is_named_aloud_and_left_out_unless_it_is_to_be_kept():
    swing = demonstration(name="odd")
    wave = 0.25 * np.sin(3 * np.pi * swing.t_s / 2)[:, None] * np.array([0.0, 0.0, 1.0])
    odd = dataclasses.replace(swing, position_m=swing.position_m + wave)
    kept, dropped = encode(many(odd), outliers="keep"), encode(many(odd))
    assert kept.metrics["outliers"] == dropped.metrics["outliers"] == "odd"
    assert kept.metrics["averaged"] == 6
    assert dropped.metrics["averaged"] == 5
    assert kept.warnings == ("far from the others, but averaged in: odd",)
    assert dropped.warnings == ("left out of the average, far from the other 5: odd (encode.outliers=keep)",)
    assert dropped.metrics["spread_mm"] < kept.metrics["spread_mm"] / 2
    without = [one for one in many(odd) if one.name != "odd"]
    assert np.array_equal(dropped.artifact.weights, encode(without).artifact.weights)


def test_where_none_stands_apart_dropping_changes_nothing():
    kept, dropped = encode(many()), encode(many(), outliers="drop")
    assert kept.metrics == dropped.metrics
    assert np.array_equal(kept.artifact.weights, dropped.artifact.weights)


def test_a_demonstration_along_other_axes_is_refused_with_the_way_to_read_it():
    swing = demonstration(name="sideways")
    odd = dataclasses.replace(swing, position_m=swing.position_m[:, [1, 0, 2]])
    with pytest.raises(StageError, match=r"demonstration 'sideways' moves along other axes .* where x is its y"):
        encode(many(odd))


def test_the_average_carries_how_the_demonstrations_differ():
    plan = encode(many()).artifact
    assert plan.variation.shape == (6, 70)
    fraction = np.linspace(0, 1, 50)
    center = play(plan, fraction * plan.duration_s).position_m
    rng = np.random.default_rng(0)
    sampled = [sample_plan(plan, rng) for _ in range(20)]
    changes = [np.abs(play(one, fraction * one.duration_s).position_m - center).max() for one in sampled]
    # 4 % of a swing of 0.25 m
    assert 2e-3 < np.median(changes) < 2e-2


@pytest.mark.parametrize("form", ["yaml", "json"])
def test_a_plan_from_a_file_is_handed_on_as_it_is(tmp_path, form):
    plan = encode(many()).artifact
    file = tmp_path / f"swing.{form}"
    file.write_text(plan_text(plan, form))
    ctx = MemoryContext()
    made = Encode(encode=settings(plan=str(file))).run({}, ctx)
    for field in dataclasses.fields(plan):
        assert np.array_equal(getattr(made.artifact, field.name), getattr(plan, field.name))
    assert made.metrics["n_parameters"] == 22
    assert {topic for topic, _, _ in ctx.log.messages} == {"/encode/reproduced", "/encode/weights"}


def test_without_demonstrations_and_without_a_plan_it_says_what_to_set():
    with pytest.raises(StageError, match=r"no demonstrations; set encode.plan=FILE"):
        Encode(encode=settings()).run({}, MemoryContext())


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("swing.yaml", "format: x", r"swing\.yaml: no movement primitive: its 'format' is 'x'"),
        ("swing.json", "{", r"swing\.json: line 1: not JSON .* 'kendama motion export'"),
        ("swing.txt", "", r"swing\.txt: ends in '\.txt'; name it FILE\.yaml, FILE\.yml or FILE\.json"),
        ("swing.yaml", None, r"swing\.yaml: cannot be read \(No such file"),
    ],
)
def test_a_plan_that_cannot_be_read_is_named(tmp_path, name, content, message):
    file = tmp_path / name
    if content is not None:
        file.write_text(content)
    with pytest.raises(InputError, match=message):
        Encode(encode=settings(plan=str(file))).run({}, MemoryContext())


def test_a_plan_that_is_no_text_is_named(tmp_path):
    (tmp_path / "swing.yaml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"swing\.yaml: not UTF-8 text"):
        Encode(encode=settings(plan=str(tmp_path / "swing.yaml"))).run({}, MemoryContext())


@pytest.mark.parametrize("regression", ["lwr", "position"])
def test_every_regression_can_be_chosen(regression):
    assert encode([demonstration()], regression=regression).metrics["n_parameters"] == 22


def test_the_papers_setting_is_locally_weighted_with_20_functions():
    paper = settings("paper")
    assert paper.regression == "lwr"
    assert paper.functions == 20


def test_the_same_demonstrations_give_the_same_bytes():
    first, second = (encode([demonstration(), demonstration(2.1)]).artifact for _ in range(2))
    assert first.weights.tobytes() == second.weights.tobytes()


def test_a_demonstration_that_does_not_move_is_named():
    still = Demonstration("nap", np.arange(50) / 100, np.zeros((50, 3)))
    with pytest.raises(StageError, match=r"encode: demonstration 'nap': the hand never moves"):
        encode([demonstration(), still])
