"""MCAP files with poses as the writers of others make them: mcap-ros2-support, rosbags and foxglove-sdk."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.writer import Writer
from scipy.spatial.transform import Rotation

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import InputError, MissingPartError
from tests.devices.demonstrator.files import file_settings, swing
from tests.plugins.mocap.test_body import settings

T, P = swing()
TURNS = Rotation.from_rotvec(0.4 * np.sin(np.pi * T / T[-1])[:, None] ** 2 * [0.0, 1.0, 0.0])
BEGAN_S = 1_700_000_000
LATE_NS = 4_000_000


def ros_header(t_s, frame="world"):
    return {"stamp": {"sec": BEGAN_S + int(t_s), "nanosec": round((t_s % 1) * 1e9)}, "frame_id": frame}


def log_time_ns(t_s):
    return BEGAN_S * 10**9 + round(1e9 * t_s) + LATE_NS


def xyz(values):
    return dict(zip("xyz", map(float, values), strict=True))


def xyzw(values):
    return dict(zip("xyzw", map(float, values), strict=True))


def ros_pose(t_s, place_m, turn):
    return {"header": ros_header(t_s), "pose": {"position": xyz(place_m), "orientation": xyzw(turn)}}


def ros_transform(t_s, place_m, turn, child="cup"):
    own = {"translation": xyz(place_m), "rotation": xyzw(turn)}
    return {"header": ros_header(t_s), "child_frame_id": child, "transform": own}


def ros_2(path, kind, messages, topic="/cup/pose"):
    """Written by mcap-ros2-support; the log is later than the senders' stamps."""
    writers, typesys = pytest.importorskip("mcap_ros2.writer"), pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with path.open("wb") as stream:
        writer = writers.Writer(stream)
        schema = writer.register_msgdef(kind, store.generate_msgdef(kind, ros_version=2)[0])
        for t_s, message in zip(T, messages, strict=True):
            writer.write_message(topic, schema, message, log_time=log_time_ns(t_s))
        writer.finish()
    return path


def poses_of_ros(path):
    kind = "geometry_msgs/msg/PoseStamped"
    return ros_2(path, kind, [ros_pose(t, p, q) for t, p, q in zip(T, P, TURNS.as_quat(), strict=True)])


def transforms_of_ros(path):
    """The cup, and a robot's link that stands still beside it, as /tf has them."""
    still = [0.0, 0.0, 0.0, 1.0]
    messages = [
        {"transforms": [ros_transform(t, [1, 2, 3], still, "link"), ros_transform(t, p, q)]}
        for t, p, q in zip(T, P, TURNS.as_quat(), strict=True)
    ]
    return ros_2(path, "tf2_msgs/msg/TFMessage", messages, "/tf")


def single_transforms_of_ros(path):
    messages = [ros_transform(t, p, q) for t, p, q in zip(T, P, TURNS.as_quat(), strict=True)]
    return ros_2(path, "geometry_msgs/msg/TransformStamped", messages, "/cup")


def of_foxglove(path, make, kind):
    """Written by foxglove-sdk, Foxglove's own library in Rust."""
    foxglove = pytest.importorskip("foxglove")
    context = foxglove.Context()
    channel = getattr(pytest.importorskip("foxglove.channels"), f"{kind}Channel")("/cup", context=context)
    messages = pytest.importorskip("foxglove.messages")
    with foxglove.open_mcap(path, context=context):
        for t_s, place_m, turn in zip(T, P, TURNS.as_quat(), strict=True):
            stamp = messages.Timestamp(BEGAN_S + int(t_s), round((t_s % 1) * 1e9))
            at, turned = messages.Vector3(**xyz(place_m)), messages.Quaternion(**xyzw(turn))
            channel.log(make(messages, stamp, at, turned), log_time=log_time_ns(t_s))
    return path


def _transform(messages, stamp, at, turned):
    return messages.FrameTransform(
        timestamp=stamp, parent_frame_id="world", child_frame_id="cup", translation=at, rotation=turned
    )


def poses_of_foxglove(path):
    def make(messages, stamp, at, turned):
        pose = messages.Pose(position=at, orientation=turned)
        return messages.PoseInFrame(timestamp=stamp, frame_id="world", pose=pose)

    return of_foxglove(path, make, "PoseInFrame")


def transforms_of_foxglove(path):
    return of_foxglove(path, lambda m, *own: m.FrameTransforms(transforms=[_transform(m, *own)]), "FrameTransforms")


def single_transforms_of_foxglove(path):
    return of_foxglove(path, _transform, "FrameTransform")


def json_of_foxglove(path):
    """Foxglove's schema in JSON, as its TypeScript library logs it, by Foxglove's plain writer."""
    writer = Writer(str(path))
    writer.start("", "test")
    schema = writer.register_schema("foxglove.PoseInFrame", "jsonschema", b"{}")
    channel = writer.register_channel("/cup", "json", schema)
    for t_s, place_m, turn in zip(T, P, TURNS.as_quat(), strict=True):
        stamp = {"sec": BEGAN_S + int(t_s), "nsec": round((t_s % 1) * 1e9)}
        pose = {"position": xyz(place_m), "orientation": xyzw(turn)}
        data = json.dumps({"timestamp": stamp, "frame_id": "world", "pose": pose}).encode()
        log_ns = log_time_ns(t_s)
        writer.add_message(channel, log_ns, data, log_ns)
    writer.finish()
    return path


WRITERS = [
    poses_of_ros,
    transforms_of_ros,
    single_transforms_of_ros,
    poses_of_foxglove,
    transforms_of_foxglove,
    single_transforms_of_foxglove,
    json_of_foxglove,
]


def check_hand(hand):
    samples = list(hand.samples())
    assert [one.t_s for one in samples] == pytest.approx(T, abs=1e-8)
    assert np.array([one.position_m for one in samples]) == pytest.approx(P, abs=1e-12)
    made = Rotation.from_quat([one.rotation_wxyz for one in samples], scalar_first=True)
    assert (made.inv() * TURNS).magnitude().max() < 1e-7


@pytest.mark.parametrize("write", WRITERS)
def test_poses_are_a_body_with_place_turn_and_the_senders_own_stamps(tmp_path, write):
    path = write(tmp_path / "a.mcap")
    (hand,) = open_demonstrators(settings(path, body="cup" if "transforms" in write.__name__ else None))
    check_hand(hand)


@pytest.mark.parametrize("write", [poses_of_ros, poses_of_foxglove])
def test_they_are_demonstrations_of_plain_files_too(tmp_path, write):
    (hand,) = open_files(file_settings(write(tmp_path / "a.mcap")))
    assert hand.name == "a"
    check_hand(hand)


def test_one_of_several_frames_is_chosen_by_its_name(tmp_path):
    path = transforms_of_ros(tmp_path / "a.mcap")
    with pytest.raises(InputError, match=r"2 bodies and markers; it has '/tf link', '/tf cup'; set capture\.body"):
        open_demonstrators(settings(path))
    (hand,) = open_files(file_settings(path, child="cup"))
    check_hand(hand)


def test_a_body_that_is_given_in_two_frames_is_two_bodies(tmp_path):
    """Places in one frame must not follow places in another."""
    messages = [ros_pose(t, p, q) for t, p, q in zip(T, P, TURNS.as_quat(), strict=True)]
    for one in messages[100:]:
        one["header"]["frame_id"] = "camera"
    path = ros_2(tmp_path / "a.mcap", "geometry_msgs/msg/PoseStamped", messages)
    with pytest.raises(InputError, match="it has '/cup/pose in world', '/cup/pose in camera'"):
        open_demonstrators(settings(path))


def test_senders_without_stamps_have_the_times_of_the_log(tmp_path):
    messages = [ros_pose(t, p, q) for t, p, q in zip(T, P, TURNS.as_quat(), strict=True)]
    for one in messages:
        one["header"]["stamp"] = {"sec": 0, "nanosec": 0}
    (hand,) = open_demonstrators(settings(ros_2(tmp_path / "a.mcap", "geometry_msgs/msg/PoseStamped", messages)))
    check_hand(hand)


def test_a_file_without_poses_says_what_it_has(tmp_path):
    messages = [{"data": "hello"} for _ in T]
    path = ros_2(tmp_path / "a.mcap", "std_msgs/msg/String", messages, "/notes")
    with pytest.raises(InputError, match=r"no poses or transforms; it has /notes \(std_msgs/msg/String, 201\)"):
        open_demonstrators(settings(path))


def test_a_message_that_is_cut_short_is_named(tmp_path):
    """As a faulty recorder writes it: the file's own checksums fit."""
    writer = Writer(str(tmp_path / "a.mcap"))
    writer.start("ros2", "test")
    schema = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", b"")
    channel = writer.register_channel("/cup", "cdr", schema)
    writer.add_message(channel, 1, b"\0\1\0\0" + bytes(11), 1)
    writer.finish()
    pytest.importorskip("rosbags")
    problem = r"message 1 of /cup: a message that is no geometry_msgs/msg/PoseStamped"
    with pytest.raises(InputError, match=problem):
        open_demonstrators(settings(tmp_path / "a.mcap"))


def test_without_rosbags_the_extra_is_named(tmp_path, monkeypatch):
    path = poses_of_ros(tmp_path / "a.mcap")
    monkeypatch.setitem(__import__("sys").modules, "rosbags.typesys", None)
    with pytest.raises(MissingPartError, match=r"needs the library rosbags: pip install '\.\[ros\]'"):
        open_demonstrators(settings(path))
