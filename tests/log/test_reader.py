"""The log reader: values back to the bit, every flipped or missing byte found, foreign files read."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.writer import CompressionType, Writer

from kendama_cli.errors import InputError
from kendama_cli.log.export import describe
from kendama_cli.log.reader import LogFile, logged_settings
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.adapt.messages import AdaptRepeatMessage
from tests.log.conftest import filled
from tests.log.made_logs import memory_log
from tests.shipped_conf import configured, plain


def test_values_come_back_to_the_bit(log_file):
    rng = np.random.default_rng(3)
    wanted = np.array([rng.standard_normal(3) for _ in range(300)])
    log = LogFile(log_file)
    cup = log.table("/adapt/cup")
    assert list(cup.columns) == ["t_s", "parent", "child", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]
    assert np.array_equal(cup[["x_m", "y_m", "z_m"]].to_numpy(), wanted)
    assert (cup["qw"] == 1).all()
    assert np.allclose(cup["t_s"], 0.01 * np.arange(300), atol=1e-9, rtol=0)
    joints = log.table("/adapt/joints")
    assert list(joints.columns) == [
        "t_s",
        "a.position_rad",
        "a.velocity_rad_s",
        "b.position_rad",
        "b.velocity_rad_s",
    ]
    assert np.array_equal(joints["b.velocity_rad_s"], wanted[:, 2])
    repeats = log.table("/adapt/repeat")
    assert repeats["caught"].dtype == bool
    assert repeats["index"].tolist() == list(range(300))
    assert log.table("/learn/table")["values"].tolist() == [[0.0, 1.0, 2.0, 3.0]]


def test_describe_reports_channels_counts_times_and_stage(log_file):
    facts = describe(log_file)
    assert facts["stage"] == "adapt"
    assert facts["metrics"] == {"caught": True}
    assert facts["messages"] == 901
    assert facts["time_range_s"] == (0.0, 2.99)
    assert facts["duration_s"] == 2.99
    assert [(c["topic"], c["schema"], c["messages"]) for c in facts["channels"]] == [
        ("/adapt/cup", "foxglove.FrameTransform", 300),
        ("/adapt/joints", "foxglove.JointStates", 300),
        ("/adapt/repeat", "kendama.AdaptRepeat", 300),
        ("/learn/table", "kendama.QTable", 1),
    ]
    json.dumps(facts)


def _small(path: Path) -> bytes:
    """The bytes of a log of three messages."""
    log = memory_log()
    for index in range(3):
        log.write("/adapt/repeat", 0.1 * index, AdaptRepeatMessage(index=index, caught=True, miss_m=0.3))
    log.finish(path, stage="adapt", settings={}, metrics={})
    return path.read_bytes()


def test_every_flipped_byte_is_found(tmp_path):
    path = tmp_path / "log.mcap"
    whole = _small(path)
    for at in range(len(whole)):
        broken = bytearray(whole)
        broken[at] ^= 0x10
        path.write_bytes(broken)
        with pytest.raises(InputError) as caught:
            LogFile(path)
        assert "\n" not in str(caught.value)


def test_every_truncation_is_found_and_says_what_is_whole(tmp_path):
    path = tmp_path / "log.mcap"
    whole = _small(path)
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError) as caught:
            LogFile(path)
        problem = "not an MCAP file" if size < 8 else f"the MCAP file is cut short after {size} bytes"
        assert problem in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_truncated_log_says_how_many_messages_are_whole(tmp_path):
    path = tmp_path / "log.mcap"
    filled(20_000).finish(path, stage="adapt", settings={}, metrics={})
    path.write_bytes(path.read_bytes()[:-400_000])
    with pytest.raises(
        InputError, match=r"cut short after \d+ bytes \(\d{4,5} messages in \d+ chunks before it are whole\)"
    ):
        LogFile(path)


def test_a_flipped_byte_says_where(tmp_path):
    path = tmp_path / "log.mcap"
    filled(20_000).finish(path, stage="adapt", settings={}, metrics={})
    broken = bytearray(path.read_bytes())
    broken[len(broken) // 2] ^= 1
    path.write_bytes(broken)
    with pytest.raises(
        InputError, match=r"log.mcap, before byte \d+: the MCAP file is damaged \(.*\d+ chunks before it are"
    ):
        LogFile(path)


@pytest.mark.parametrize("content", [b"", b"t,x\n0,1\n", bytes(range(256)) * 40])
def test_what_is_no_mcap_file_is_named_so(tmp_path, content):
    path = tmp_path / "swing.mcap"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"swing.mcap: not an MCAP file .*; name an MCAP file"):
        describe(path)


def test_a_missing_file_and_a_folder_get_one_line(tmp_path):
    with pytest.raises(InputError, match=r"nowhere.mcap: cannot be read .No such file or directory."):
        LogFile(tmp_path / "nowhere.mcap")
    with pytest.raises(InputError, match=r"cannot be read .Is a directory."):
        LogFile(tmp_path)


def test_an_absent_topic_lists_those_that_exist(log_file):
    with pytest.raises(InputError, match="it has no topic '/adapt/bal'; it has /adapt/cup, /adapt/joints"):
        LogFile(log_file).table("/adapt/bal")


def _foreign(
    path: Path, messages: list[bytes], *, schema: tuple[str, str, bytes], encoding: str, **options: object
) -> None:
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="someone", library="elsewhere")
        channel = writer.register_channel("/pose", encoding, writer.register_schema(*schema))
        for number, data in enumerate(messages):
            writer.add_message(channel, 1_700_000_000_000_000_000 + number * 1_000_000, data, 0)
        writer.finish()


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"enable_crcs": False},
    ],
)
def test_foreign_json_is_flattened_whatever_the_container(tmp_path, options):
    rows = [{"position": {"x": 0.5 * n, "y": 1}, "name": "cup", "list": [1, 2]} for n in range(5)]
    schema = ("Pose", "jsonschema", b"{}")
    _foreign(tmp_path / "f.mcap", [json.dumps(row).encode() for row in rows], schema=schema, encoding="json", **options)
    table = LogFile(tmp_path / "f.mcap").table("/pose")
    assert table["position.x"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert table["list"].tolist()[0] == [1, 2]
    assert table["t_s"].diff().iloc[1] == pytest.approx(1e-3, abs=1e-6)
    assert LogFile(tmp_path / "f.mcap").stage == {}


def test_foreign_protobuf_is_read_by_its_embedded_descriptor(tmp_path):
    file = FileDescriptorProto(name="lab/hand.proto", package="lab", syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")  # not in the set, as some writers leave it out
    hand = file.message_type.add(name="Hand")
    hand.field.add(name="stamp", number=1, type=11, label=1, type_name=".google.protobuf.Timestamp")
    hand.field.add(name="tip", number=2, type=11, label=1, type_name=".lab.Point")
    hand.field.add(name="points", number=3, type=11, label=3, type_name=".lab.Point")
    hand.field.add(name="force_n", number=4, type=1, label=3)
    point = file.message_type.add(name="Point")
    point.field.add(name="x", number=1, type=1, label=1)

    pool = DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(file)
    made = GetMessageClass(pool.FindMessageTypeByName("lab.Hand"))
    data = made(stamp={"seconds": 2, "nanos": 500_000_000}, tip={"x": 3.0}, points=[{"x": 1.0}], force_n=[1, 2])
    descriptors = FileDescriptorSet(file=[file]).SerializeToString()
    messages = [data.SerializeToString(), made().SerializeToString()]
    _foreign(tmp_path / "f.mcap", messages, schema=("lab.Hand", "protobuf", descriptors), encoding="protobuf")
    table = LogFile(tmp_path / "f.mcap").table("/pose")
    assert table["stamp_s"].tolist()[0] == 2.5
    assert table["tip.x"].tolist()[0] == 3.0
    assert np.isnan(table["tip.x"].tolist()[1])
    assert table["points"].tolist() == [[{"x": 1.0}], []]
    assert table["force_n"].tolist() == [[1.0, 2.0], []]


@pytest.mark.parametrize(
    ("encoding", "schema", "says"),
    [
        (
            "cdr",
            ("Pose", "ros2msg", b"float64 x"),
            "topic '/pose' is encoded as 'cdr', only protobuf and json can be read",
        ),
        ("json", ("Pose", "jsonschema", b"{}"), "message 0 of topic '/pose' is no JSON"),
        ("protobuf", ("Pose", "protobuf", b"\xff\xff"), "the schema 'Pose' cannot be read"),
        ("protobuf", ("Pose", "protobuf", b""), "the schema 'Pose' cannot be read"),
    ],
)
def test_what_cannot_be_decoded_is_named_but_still_described(tmp_path, encoding, schema, says):
    path = tmp_path / "f.mcap"
    _foreign(path, [struct.pack("<d", 1.0)], schema=schema, encoding=encoding)
    assert describe(path)["channels"][0]["encoding"] == encoding
    with pytest.raises(InputError, match=f"f.mcap: {says}"):
        LogFile(path).table("/pose")


def test_settings_are_as_they_were_logged() -> None:
    assert logged_settings(GameSettings, plain("game", "kendama"), "game", Path("log.mcap")) == configured(
        GameSettings, "game", "kendama"
    )


def test_settings_of_another_version_name_the_log_and_what_differs() -> None:
    older = {**plain("game", "kendama"), "rope": {"length_m": 0.4}}
    with pytest.raises(
        InputError, match=r"^log.mcap: its settings 'game' are of another version \(.*game.rope.*again$"
    ):
        logged_settings(GameSettings, older, "game", Path("log.mcap"))
