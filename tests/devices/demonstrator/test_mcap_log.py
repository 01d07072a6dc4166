"""Recordings in MCAP, and what becomes of every damaged byte."""

import json

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from mcap.writer import CompressionType, Writer

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.errors import InputError
from kendama_cli.schema import foxglove
from tests.devices.demonstrator.files import file_settings, read, swing
from tests.log.made_logs import memory_log

T, P = swing()


def schema_data():
    files = {}

    def collect(file):
        for dependency in file.dependencies:
            collect(dependency)
        proto = FileDescriptorProto()
        file.CopyToProto(proto)
        files[file.name] = proto

    collect(FrameTransform.DESCRIPTOR.file)
    return FileDescriptorSet(file=files.values()).SerializeToString()


def write_mcap(path, topics, *, compression=CompressionType.ZSTD, stamped=True):
    """``topics``: topic -> child -> (t_s, position_m); one of the topics may be JSON (child None)."""
    writer = Writer(str(path), compression=compression)
    writer.start("", "test")
    schema = writer.register_schema("foxglove.FrameTransform", "protobuf", schema_data())
    for topic, children in topics.items():
        if children is None:
            other = writer.register_schema("note", "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", other)
            writer.add_message(channel, 0, json.dumps({"a": 1}).encode(), 0)
            continue
        channel = writer.register_channel(topic, "protobuf", schema)
        for child, (t_s, position_m) in children.items():
            for t, (x, y, z) in zip(t_s, position_m, strict=True):
                message = FrameTransform(parent_frame_id="world", child_frame_id=child)
                if stamped:
                    message.timestamp.FromNanoseconds(round(t * 1e9))
                message.translation.x, message.translation.y, message.translation.z = x, y, z
                writer.add_message(channel, round(t * 1e9), message.SerializeToString(), round(t * 1e9))
    writer.finish()
    return path


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE])
def test_a_transform_topic_is_a_recording(tmp_path, compression, stamped):
    file = tmp_path / "a.mcap"
    if compression == CompressionType.LZ4:
        pytest.importorskip("lz4")
    write_mcap(file, {"/tf/cup": {"cup": (T + 5.0, P)}, "/notes": None}, compression=compression, stamped=stamped)
    t_s, position_m = read(file)
    assert np.allclose(t_s, T, atol=1e-8)
    assert np.array_equal(position_m, P)


def test_each_child_frame_is_a_demonstration(tmp_path):
    file = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T, P), "two": (T, 1.1 * P)}})
    assert [hand.name for hand in open_files(file_settings(file))] == ["one", "two"]
    (two,) = open_files(file_settings(file, child="two"))
    assert np.array_equal([sample.position_m for sample in two.samples()], 1.1 * P)


def test_the_usual_topic_is_taken_where_there_are_several(tmp_path):
    file = write_mcap(tmp_path / "a.mcap", {"/other": {"hand": (T, P)}, "/capture/cup": {"cup": (T, P)}})
    assert [hand.name for hand in open_files(file_settings(file))] == ["cup"]
    assert [hand.name for hand in open_files(file_settings(file, topic="/other"))] == ["hand"]


def test_a_capture_log_is_read_back_as_it_was(tmp_path):
    """What a capture stage logs, another capture reads: the same names, times and positions."""
    log = memory_log()
    for t, position in zip(T, P, strict=True):
        log.write("/capture/cup", t, foxglove.FrameTransform("world", "swing-07", position))
    log.finish(tmp_path / "log.mcap", stage="capture", settings={}, metrics={})
    (hand,) = open_files(file_settings(tmp_path / "log.mcap"))
    assert hand.name == "swing-07"
    assert np.array_equal([sample.position_m for sample in hand.samples()], P)
    assert np.allclose([sample.t_s for sample in hand.samples()], T, atol=1e-9)


def refusal(path, **changes):
    with pytest.raises(InputError) as caught:
        open_files(file_settings(path, **changes))
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_topic_that_is_not_there_lists_the_others(tmp_path):
    file = write_mcap(tmp_path / "a.mcap", {"/other": {"hand": (T, P)}, "/notes": None})
    message = refusal(file, topic="/cup")
    assert "no poses or transforms on the topic '/cup'" in message
    assert "/notes (note, 1), /other (foxglove.FrameTransform, 201)" in message
    assert "capture.topic" in message


def test_a_file_without_transforms(tmp_path):
    assert "it has /notes (note, 1)" in refusal(write_mcap(tmp_path / "a.mcap", {"/notes": None}))


def test_a_child_that_is_not_there_lists_the_others(tmp_path):
    file = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T, P)}})
    assert "no child frame 'two' on /capture/cup; it has 'one'" in refusal(file, child="two")


def test_a_gap_is_named_by_its_message(tmp_path):
    keep = np.r_[0:60, 90:201]
    file = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T[keep], P[keep])}})
    assert "message 61 of /capture/cup: a gap of 0.31 s" in refusal(file)


def test_a_nan_is_named_by_its_message(tmp_path):
    holed = P.copy()
    holed[17, 2] = np.nan
    file = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T, holed)}})
    assert "message 18 of /capture/cup: z is nan, not a finite number" in refusal(file)


def test_millimetres_in_an_mcap_are_reported_by_the_extent(tmp_path):
    file = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T, 1e3 * P)}})
    assert "the swing extends over 230.9 m" in refusal(file)
    assert "look at capture.topic and have the poses logged in metres" in refusal(file)


def test_wherever_it_is_cut_the_file_is_refused(tmp_path):
    whole = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T, P)}}).read_bytes()
    cut = tmp_path / "cut.mcap"
    for length in [9, 40, *range(60, len(whole), max(1, len(whole) // 60)), len(whole) - 1]:
        cut.write_bytes(whole[:length])
        assert "cut short" in refusal(cut) or "damaged" in refusal(cut)
    cut.write_bytes(whole[: len(whole) // 2])
    message = refusal(cut)
    assert f"the MCAP file is cut short after {len(whole) // 2} bytes (" in message
    assert "are whole); copy or record it again" in message


@pytest.mark.parametrize(
    "compression", [CompressionType.ZSTD, pytest.param(CompressionType.NONE, marks=pytest.mark.slow)]
)
def test_a_flipped_byte_never_changes_what_is_read(tmp_path, compression):
    """Either the file is refused, or the byte was one of the index that nothing is read from."""
    whole = write_mcap(tmp_path / "a.mcap", {"/capture/cup": {"one": (T, P)}}, compression=compression).read_bytes()
    bad = tmp_path / "bad.mcap"
    rng = np.random.default_rng(4)
    refused = 0
    for place in rng.choice(np.arange(8, len(whole)), 60, replace=False):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << int(rng.integers(8))
        bad.write_bytes(flipped)
        try:
            _, position_m = read(bad)
        except InputError:
            refused += 1
        else:
            assert np.array_equal(position_m, P)
    assert refused > 40


def test_no_mcap_at_all(tmp_path):
    file = tmp_path / "a.mcap"
    file.write_text("t_s,x_m\n0,1\n")
    assert "not an MCAP file (its 12 bytes do not begin with the MCAP magic)" in refusal(file)
