"""Tracked bodies in the files of motion capture systems and robots: places, turns, axes, gaps, and the ball."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.writer import Writer as McapWriter
from scipy.spatial.transform import Rotation

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import ConfigError, InputError
from kendama_cli.pipeline.code import FileIndex
from kendama_cli.pipeline.inputs import file_contents, resolve_files
from kendama_cli.plugins.mocap.settings import BodyCapture
from kendama_cli.schema.settings import build

ROOT = Path(__file__).parents[3]
CONF = ROOT / "conf" / "capture"


def settings(path, **changes):
    data = yaml.safe_load((CONF / "body.yaml").read_text()) | {"path": str(path)}
    for key, value in changes.items():
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return build(BodyCapture, data, "capture")


def motion():
    """A bundled swing and a tilt about its y axis; the body sits 0.1 m along its own x from the cup."""
    rows = np.loadtxt(ROOT / "data/demonstrations/swing-01.csv", delimiter=",", comments=("#", "t"))
    t_s = rows[:, 0]
    return t_s, rows[:, 1:], Rotation.from_rotvec(0.4 * np.sin(np.pi * t_s / t_s[-1])[:, None] ** 2 * [0.0, 1.0, 0.0])


def motive(path, t_s, place_m, turns, gap=()):
    """As Motive 1.22 writes it: y up, quaternions x y z w, a rigid body and a marker that is never seen."""
    to_file = Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # ours to its axes: y is up
    seen, turned = to_file.apply(place_m), (to_file * turns * to_file.inv()).as_quat()
    lines = [
        "Format Version,1.22,Take Name,t,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global",
        "",
        ",,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,Marker",
        ",,cup,cup,cup,cup,cup,cup,cup,ball,ball,ball",
        ",,id,id,id,id,id,id,id,,,",
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,Position",
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z",
    ]
    for i, (t, p, q) in enumerate(zip(t_s, seen, turned, strict=True)):
        cells = [""] * 7 if i in gap else [f"{v:.6f}" for v in (*q, *p)]
        lines.append(",".join([str(i), f"{t:.6f}", *cells, "", "", ""]))
    path.write_text("\n".join(lines) + "\n")
    return path


def read(path, **changes):
    (hand,) = open_demonstrators(settings(path, **changes))
    samples = list(hand.samples())
    return (
        np.array([one.t_s for one in samples]),
        np.array([one.position_m for one in samples]),
        Rotation.from_quat(np.array([one.rotation_wxyz for one in samples]), scalar_first=True),
    )


def test_a_rigid_body_of_motive_gives_place_and_tilt_in_our_axes(tmp_path):
    t_s, cup_m, turns = motion()
    path = motive(tmp_path / "a.csv", t_s, cup_m - turns.apply([0.1, 0.0, 0.0]), turns, gap=range(50, 56))
    made_s, made_m, made = read(path, body="cup", axes=["x", "-z", "y"], body_to_cup_m=[0.1, 0.0, 0.0])
    truth = np.column_stack([np.interp(made_s, t_s, column) for column in cup_m.T])
    assert len(made_s) == len(t_s) - 6
    assert made_m == pytest.approx(truth, abs=1e-5)
    tilt = 0.4 * np.sin(np.pi * made_s / t_s[-1]) ** 2
    assert made.as_rotvec()[:, 1] == pytest.approx(tilt, abs=1e-4)


def test_a_long_gap_is_told(tmp_path):
    path = motive(tmp_path / "a.csv", *motion(), gap=range(50, 70))
    with pytest.raises(InputError, match=r"0\.490 s: 'cup' is not seen for 0\.21 s; allowed: 0\.12 s"):
        open_demonstrators(settings(path, body="cup", axes=["x", "-z", "y"]))


def test_an_unknown_body_is_told_with_those_that_are_there(tmp_path):
    path = motive(tmp_path / "a.csv", *motion())
    with pytest.raises(InputError, match=r"no 'hand'; it has 'cup', 'ball'; set capture\.body to one of them"):
        open_demonstrators(settings(path, body="hand"))
    with pytest.raises(InputError, match="2 bodies and markers; it has 'cup', 'ball'"):
        open_demonstrators(settings(path))


def qualisys(path, t_s, place_m, turns):
    head = [
        f"NO_OF_FRAMES\t{len(t_s)}",
        "NO_OF_CAMERAS\t8",
        "NO_OF_BODIES\t1",
        "FREQUENCY\t100",
        "DATA_INCLUDED\t6D",
        "BODY_NAMES\tcup",
        "Frame\tTime\tX\tY\tZ\tRoll\tPitch\tYaw\tResidual\t" + "\t".join(f"Rot[{i}]" for i in range(9)),
    ]
    for i, (t, p, matrix) in enumerate(zip(t_s, place_m, turns.as_matrix(), strict=True)):
        values = [*(1e3 * p), 0, 0, 0, 0.3, *matrix.T.ravel()]
        head.append("\t".join([str(i + 1), f"{t:.5f}", *(f"{v:.6f}" for v in values)]))
    path.write_text("\n".join(head) + "\n")
    return path


def test_a_body_of_qualisys_6d(tmp_path):
    t_s, place_m, turns = motion()
    made_s, made_m, made = read(qualisys(tmp_path / "a.tsv", t_s, place_m, turns))
    assert made_s == pytest.approx(t_s)
    assert made_m == pytest.approx(place_m, abs=1e-6)
    assert (made.inv() * turns).magnitude().max() < 1e-5


def pose_message(kinds, t, p, q):
    """A geometry_msgs/PoseStamped of ROS 1 or 2, whichever ``kinds`` are of."""
    stamp = kinds["builtin_interfaces/msg/Time"](sec=int(1000 + t), nanosec=round((t % 1) * 1e9) % 10**9)
    numbered = {"seq": 0} if "seq" in kinds["std_msgs/msg/Header"].__dataclass_fields__ else {}
    return kinds["geometry_msgs/msg/PoseStamped"](
        header=kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="world", **numbered),
        pose=kinds["geometry_msgs/msg/Pose"](
            position=kinds["geometry_msgs/msg/Point"](*map(float, p)),
            orientation=kinds["geometry_msgs/msg/Quaternion"](*map(float, q)),
        ),
    )


def bag_of(folder, rows, compressed=None, storage="SQLITE3"):
    """A ROS 2 bag by rosbags, whose stamps are 4 ms before the times of its log."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    bag = rosbag2.Writer(folder, version=9, storage_plugin=rosbag2.StoragePlugin[storage])
    if compressed:
        bag.set_compression(rosbag2.CompressionMode[compressed], rosbag2.CompressionFormat.ZSTD)
    with bag:
        link = bag.add_connection("/cup/pose", "geometry_msgs/msg/PoseStamped", typestore=store)
        for t, p, q in rows:
            late_ns = int(1e9 * (1000 + t)) + 4_000_000
            message = pose_message(store.types, t, p, q)
            bag.write(link, late_ns, store.serialize_cdr(message, "geometry_msgs/msg/PoseStamped"))
    return folder


def split(folder, halves):
    """The bags ``halves`` as one bag of two files, as ``ros2 bag record --max-bag-size`` leaves them."""
    folder.mkdir()
    facts = [yaml.safe_load((half / "metadata.yaml").read_text()) for half in halves]
    whole = facts[0]["rosbag2_bagfile_information"]
    names = []
    for number, (half, one) in enumerate(zip(halves, facts, strict=True)):
        (name,) = one["rosbag2_bagfile_information"]["relative_file_paths"]
        names.append(f"bag_{number}{''.join(Path(name).suffixes)}")
        (half / name).rename(folder / names[-1])
    whole["relative_file_paths"] = names
    whole["files"] = [{**one["rosbag2_bagfile_information"]["files"][0], "path": name} for one, name in
                      zip(facts, names, strict=True)]  # fmt: skip
    whole["message_count"] = sum(one["rosbag2_bagfile_information"]["message_count"] for one in facts)
    (folder / "metadata.yaml").write_text(yaml.safe_dump(facts[0]))
    return folder


@pytest.mark.parametrize("halves", [1, 2])
@pytest.mark.parametrize(
    ("compressed", "storage"), [(None, "SQLITE3"), ("FILE", "SQLITE3"), ("MESSAGE", "SQLITE3"), (None, "MCAP")]
)
def test_poses_of_a_ros_2_bag_keep_their_own_stamps(tmp_path, monkeypatch, halves, compressed, storage):
    t_s, place_m, turns = motion()
    rows = list(zip(t_s, place_m, turns.as_quat(), strict=True))
    parts = [rows] if halves == 1 else [rows[:90], rows[90:]]
    bags = [bag_of(tmp_path / f"part{i}", part, compressed, storage) for i, part in enumerate(parts)]
    folder = bags[0].rename(tmp_path / "bag") if halves == 1 else split(tmp_path / "bag", bags)
    monkeypatch.chdir(tmp_path)
    capture = resolve_files(settings("bag"), "capture", [tmp_path])  # as the command line finds it
    assert [hand.name for hand in open_demonstrators(capture)] == ["bag"]
    made_s, made_m, made = read(capture.path[0])
    assert made_s == pytest.approx(t_s, abs=1e-6)
    assert made_m == pytest.approx(place_m, abs=1e-9)
    assert (made.inv() * turns).magnitude().max() < 1e-6
    assert set(file_contents(capture, FileIndex(tmp_path / "index"))) == {str(one) for one in folder.iterdir()}


def test_a_bag_without_poses_lists_its_topics(tmp_path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with rosbag2.Writer(tmp_path / "bag", version=9) as bag:
        link = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        text = store.serialize_cdr(store.types["std_msgs/msg/String"](data="a"), "std_msgs/msg/String")
        bag.write(link, 1, text)
    with pytest.raises(InputError, match=r"no poses or transforms; its topics: /chatter \(std_msgs/msg/String, 1\)"):
        open_demonstrators(settings(tmp_path / "bag" / "metadata.yaml"))


def test_a_bag_that_was_never_closed_is_called_so(tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.db3").write_bytes(b"SQLite format 3\0")
    with pytest.raises(
        ConfigError, match=r"'bag' is a folder \(a ROS 2 bag without its metadata\.yaml: 'ros2 bag reindex"
    ):
        resolve_files(settings("bag"), "capture", [tmp_path])


def test_an_mcap_of_a_ros_1_bag_is_read(tmp_path):
    """Bytes by rosbags' own serialiser, the file by the library mcap, as its ``mcap convert`` names schemas."""
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    t_s, place_m, turns = motion()
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros1")
        schema = writer.register_schema("geometry_msgs/PoseStamped", "ros1msg", b"Header header\nPose pose")
        channel = writer.register_channel("/cup/pose", "ros1", schema)
        for t, p, q in zip(t_s, place_m, turns.as_quat(), strict=True):
            data = bytes(store.serialize_ros1(pose_message(store.types, t, p, q), "geometry_msgs/msg/PoseStamped"))
            writer.add_message(channel, log_time=int(1e9 * t) + 4_000_000, data=data, publish_time=0)
        writer.finish()
    made_s, made_m, made = read(tmp_path / "a.mcap")
    assert made_s == pytest.approx(t_s, abs=1e-6)
    assert made_m == pytest.approx(place_m, abs=1e-9)
    assert (made.inv() * turns).magnitude().max() < 1e-6


def with_ball(path, ends, up=1.0):
    """Swings one after another, a ball that hangs 0.4 m below at first and ends where ``ends`` says."""
    t_s, place_m, _ = motion()
    rows = []
    for end in ends:
        ball = np.tile([0.0, 0.0, -0.4], (len(t_s), 1))
        ball[len(t_s) // 2 :, 2] = end
        back = np.linspace(0, 1, 150)[:, None]
        way = place_m[-1] + (place_m[0] - place_m[-1]) * back**2 * (3 - 2 * back)
        rest = np.repeat(place_m[:1], 90, axis=0)
        cup = np.vstack((place_m, np.repeat(place_m[-1:], 90, axis=0), way, rest))
        tail = np.tile([0.0, 0.0, end], (90, 1)), np.tile([0.0, 0.0, -0.4], (len(cup) - len(place_m) - 90, 1))
        rows.append(np.hstack((cup, cup + np.vstack((ball, *tail)))))
    table = np.vstack(rows) * [1, 1, up, 1, 1, up]
    names = ["cup", "ball"]
    lines = [
        f"NO_OF_FRAMES\t{len(table)}",
        "NO_OF_MARKERS\t2",
        "FREQUENCY\t100",
        "MARKER_NAMES\t" + "\t".join(names),
        *("\t".join(f"{1e3 * v + 1e-3:.3f}" for v in row) for row in table),
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_catches_are_told_from_misses_where_the_ball_is_there(tmp_path):
    path = with_ball(tmp_path / "a.tsv", [0.05, -0.4, 0.05])
    hands = open_demonstrators(settings(path, body="cup", ball="ball"))
    assert [hand.name for hand in hands] == ["a-1", "a-3"]
    assert "left out, the ball was not caught: a-2 (capture.misses=keep)" in hands[0].warnings
    assert len(open_demonstrators(settings(path, body="cup", ball="ball", misses="keep"))) == 3


def test_a_ball_that_hangs_upward_tells_gravitys_sense(tmp_path):
    path = with_ball(tmp_path / "a.tsv", [0.05], up=-1.0)
    with pytest.raises(InputError, match=r"the ball hangs at rest 0\.40 m toward \+z, 180 deg from -z: -z points up"):
        open_demonstrators(settings(path, body="cup", ball="ball"))


@pytest.mark.recording
@pytest.mark.parametrize("stick", ["stick_right", "stick_left"])
@pytest.mark.parametrize("name", ["z_hop_1", "linear_accel_stick_motion"])
def test_persons_recordings_of_another_game_are_read_and_not_refused(recordings, name, stick):
    path = recordings / "diabolo" / f"{name}.csv"
    hands = open_demonstrators(settings(path, body=stick))
    assert hands
    for hand in hands:
        samples = list(hand.samples())
        turns = np.array([one.rotation_wxyz for one in samples])
        assert np.linalg.norm(turns, axis=1) == pytest.approx(1.0, abs=1e-9)
        assert (turns != turns[0]).any()
