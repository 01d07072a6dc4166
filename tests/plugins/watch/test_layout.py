"""The layout for Foxglove: every panel is placed, shows topics that the log has, and fields that they have."""

from kendama_cli.log.reader import LogFile
from kendama_cli.plugins.watch.layout import layout
from kendama_cli.schema.foxglove import CompressedImage
from tests.log.conftest import filled
from tests.log.made_logs import memory_log


def placed(node):
    """Ids of the panels in a tree of splits."""
    return [node] if isinstance(node, str) else [*placed(node["first"]), *placed(node["second"])]


def test_the_scene_and_a_plot_of_each_topic_with_changing_numbers_are_shown(tmp_path):
    log_file = tmp_path / "log.mcap"
    filled().finish(log_file, stage="adapt", settings={}, metrics={})
    made = layout(log_file)
    panels, log = made["configById"], LogFile(log_file)
    tabs = panels["Tab!plots"]["tabs"]
    assert sorted([*placed(made["layout"]), *(tab["layout"] for tab in tabs)]) == sorted(panels)
    assert panels["3D!scene"]["topics"] == {"/adapt/cup": {"visible": True}}
    assert [tab["title"] for tab in tabs] == ["/adapt/joints", "/adapt/repeat"], "one row of a table changes nothing"
    lines = [line["value"] for tab in tabs for line in panels[tab["layout"]]["paths"]]
    assert lines[:2] == ["/adapt/joints.joints[0].position", "/adapt/joints.joints[1].position"]
    for line in lines[2:]:
        topic, _, field = line.partition(".")
        assert log.table(topic)[field].nunique() > 1
    assert "/adapt/repeat.miss_m" in lines


def test_images_stand_side_by_side_and_a_log_without_anything_shows_its_source(tmp_path):
    for name, topics in (("two", ("/predict/image/left", "/predict/image/right")), ("none", ())):
        log = memory_log()
        for topic in topics:
            log.write(topic, 0.0, CompressedImage("camera", "jpeg", b""))
        log.finish(tmp_path / f"{name}.mcap", stage="predict", settings={}, metrics={})
    shown = layout(tmp_path / "two.mcap")
    assert shown["layout"] == {
        "direction": "row", "first": "Image!predict_image_left", "second": "Image!predict_image_right",
        "splitPercentage": 50,
    }  # fmt: skip
    assert placed(layout(tmp_path / "none.mcap")["layout"]) == ["SourceInfo!log"]
