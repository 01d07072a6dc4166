"""Kind of a stage in one run: settings choose within its declaration; code counts where it is chosen."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

import kendama_cli
from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.errors import ConfigError
from kendama_cli.pipeline.catalogue import StageSpec, load_pipeline
from kendama_cli.pipeline.nodes import build_settings, node_schemas
from kendama_cli.pipeline.plan import Planner, kind_of
from kendama_cli.pipeline.stage_code import code_targets
from kendama_cli.schema.declaration import Kind, StageDeclaration, find_stage
from kendama_cli.schema.registry import declared
from kendama_cli.store.store import Store


@dataclass(frozen=True)
class Simulated:
    moves: ClassVar[bool] = False


@dataclass(frozen=True)
class Person:
    live: ClassVar[bool] = True


@dataclass(frozen=True)
class Arm:
    moves: ClassVar[bool] = True


def spec(kind: Kind) -> StageSpec:
    stage = StageDeclaration("toy", "", "", "toy:Toy", "toy:Given", settings={}, topics={}, kind=kind)
    return StageSpec("toy", stage, {}, {"device": "hardware", "hand": "capture"}, seeded=False)


@pytest.mark.parametrize(
    ("declared", "settings", "does"),
    [
        ("computes", {"device": Simulated()}, "computes"),
        ("moves", {"device": Simulated()}, "computes"),
        ("records", {"hand": Person()}, "records"),
        ("moves", {"hand": Person()}, "records"),
        ("moves", {"hand": Person(), "device": Arm()}, "moves"),
        ("moves", {"device": Arm(), "hand": Person()}, "moves"),
    ],
)
def test_settings_say_what_is_done(declared: Kind, settings: dict[str, Any], does: str) -> None:
    assert kind_of(spec(declared), settings) == does


@pytest.mark.parametrize(("declared", "settings"), [("computes", {"hand": Person()}), ("records", {"device": Arm()})])
def test_a_stage_may_not_do_more_than_it_declares(declared: Kind, settings: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=rf"stage 'toy' declares that it {declared}, but its settings"):
        kind_of(spec(declared), settings)


def planner(home: Path, *overrides: str, pipeline: str = "kendama") -> Planner:
    site = find_site(home)
    pipeline = load_pipeline(pipeline, site.pipeline_folders)
    return Planner(Store(home), pipeline, build_settings(composed(site, list(overrides))), site.data_roots)


def test_files_are_computed_from_and_another_code_is_no_reason_to_swing_again(tmp_path: Path) -> None:
    files, device = planner(tmp_path), planner(tmp_path, "capture=mocap")
    capture = files.pipeline.stages[0]
    assert (files.kind("capture"), device.kind("capture")) == ("computes", "records")
    assert files.parts(capture, {})["code"]
    assert device.parts(capture, {})["code"] == {}


def test_what_live_cameras_show_is_recorded_and_what_is_rendered_or_replayed_is_computed(tmp_path: Path) -> None:
    def kind(*overrides: str) -> str:
        return planner(tmp_path, *overrides, pipeline="swingup").kind("transfer")

    assert kind("camera=device") == "records"
    assert kind() == kind("camera=file") == "computes"
    with pytest.raises(ConfigError, match=r"stage 'predict' declares that it computes, .* 'camera' .* choose others"):
        planner(tmp_path, "camera=device")


def test_a_recording_that_is_stored_says_how_it_is_recorded_anew(tmp_path: Path) -> None:
    asked = planner(tmp_path, "capture=mocap")
    (waiting, *_) = asked.plan()
    assert waiting.key is not None
    with asked.store.scratch_folder() as folder:
        (folder / "swings.json").write_text("{}")
        asked.store.put(folder, "capture", waiting.key, {}, {})
    (kept, *_) = asked.plan()
    assert (kept.result is not None, kept.reasons) == (True, ("recorded before; --force capture records anew",))


def test_a_simulated_arm_computes_and_one_that_may_be_real_moves(tmp_path: Path) -> None:
    real = planner(tmp_path, "hardware=command", "hardware.host=localhost", "hardware.port=4000")
    assert (planner(tmp_path).kind("transfer"), real.kind("transfer"), real.kind("learn")) == (
        "computes",
        "moves",
        "computes",
    )


def test_the_code_of_each_reader_of_recordings_counts_for_a_stage_that_may_read_them(tmp_path: Path) -> None:
    made = planner(tmp_path, pipeline="measurement")
    (measure,) = made.pipeline.stages
    targets = set(declared("kendama.recordings").values())
    assert targets
    assert targets <= set(code_targets(measure, made.settings["measure"], node_schemas()[0]))


def test_the_code_of_the_chosen_parts_counts_and_that_of_others_and_of_the_chapter_does_not(tmp_path: Path) -> None:
    made = planner(tmp_path)
    code = {one.name: set(made.parts(one, {})["code"]) for one in made.pipeline.stages}
    assert "kendama_cli/devices/robot/udp/twin_client.py" in code["transfer"]
    assert "kendama_cli/devices/demonstrator/file.py" in code["capture"]
    assert "kendama_cli/plugins/mocap/live.py" not in code["capture"]
    for name, files in code.items():
        assert f"kendama_cli/stages/{name}/stage.py" in files
        declaration = find_stage(name)
        assert declaration is not None
        assert {f"{kind.__module__.replace('.', '/')}.py" for kind in declaration.topics.values()} <= files
        assert not [file for file in files if file.startswith("kendama_cli/report/") or "chapter" in file], name


def test_no_declaration_of_a_part_counts_so_one_part_more_reruns_nothing(tmp_path: Path) -> None:
    counted = set()
    for pipeline in ("kendama", "swingup"):
        made = planner(tmp_path, pipeline=pipeline)
        counted |= {file for one in made.pipeline.stages for file in made.parts(one, {})["code"]}
    package = Path(kendama_cli.__file__).parent
    declaring = {path.relative_to(package.parent).as_posix() for path in package.rglob("*.py") if declares(path)}
    assert len(declaring) > 6
    assert counted.isdisjoint(declaring)
    assert "kendama_cli/learning/__init__.py" in counted, "where a declaration would count"


def declares(file: Path) -> bool:
    """Return True if a ``Variant`` is made in ``file``."""
    return any(
        isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("Variant(")
        for node in ast.parse(file.read_text()).body
    )


def test_targets_are_the_run_the_artifact_the_messages_the_settings_and_the_chosen_parts(tmp_path: Path) -> None:
    stage = find_stage("predict")
    assert stage is not None
    settings = build_settings(composed(find_site(tmp_path), []))
    schemas, broken = node_schemas()
    assert broken is None
    one = StageSpec("predict", stage, {}, {"predict": "predict", "camera": "camera"}, seeded=True)
    targets = set(code_targets(one, {node: settings[node] for node in ("predict", "camera")}, schemas))
    assert targets >= {stage.run, stage.returns, "kendama_cli.vision.settings", "kendama_cli.stages.predict.messages"}
    assert any(target.startswith("kendama_cli.devices.camera.virtual:") for target in targets)
    assert any(target.startswith("kendama_cli.vision.detection.colour_detector:") for target in targets)
