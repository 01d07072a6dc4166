import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import DemonstrationSet
from kendama_cli.errors import InputError
from kendama_cli.stages.capture.stage import Capture
from tests.devices.demonstrator.files import csv_lines, file_settings, swing, write
from tests.memory_context import MemoryContext


@pytest.fixture
def files(tmp_path):
    return [write(tmp_path / f"{name}.csv", csv_lines(scale)) for name, scale in (("one", 1.0), ("two", 1.2))]


def test_files_become_demonstrations_in_order(files):
    made = Capture(capture=file_settings(files)).run({}, MemoryContext())
    assert isinstance(made.artifact, DemonstrationSet)
    assert [one.name for one in made.artifact.demonstrations] == ["one", "two"]
    assert np.allclose(made.artifact.demonstrations[1].position_m, 1.2 * swing()[1], atol=1e-5)


def test_metrics_tell_number_rate_duration_and_speed(files):
    metrics = Capture(capture=file_settings(files)).run({}, MemoryContext()).metrics
    t, p = swing()
    speed = np.linalg.norm(np.diff(1.2 * p, axis=0), axis=1).max() * 100
    assert metrics["n_demonstrations"] == 2
    assert metrics["sample_rate_hz"] == pytest.approx(100)
    assert metrics["duration_s"] == pytest.approx(t[-1])
    assert metrics["peak_speed_m_s"] == pytest.approx(speed, rel=1e-3)


def test_every_sample_is_logged_as_a_transform_of_its_demonstration(files):
    ctx = MemoryContext()
    Capture(capture=file_settings(files)).run({}, ctx)
    assert {topic for topic, _, _ in ctx.log.messages} == {"/capture/cup"}
    children = [message.child for _, _, message in ctx.log.messages]
    assert children == ["one"] * 201 + ["two"] * 201


def test_a_bad_file_stops_it_before_anything_is_logged(files):
    files[1].write_text("t_s,x_m,y_m,z_m\n0,0,0,0\n")
    ctx = MemoryContext()
    with pytest.raises(InputError, match=r"two\.csv: one sample only"):
        Capture(capture=file_settings(files)).run({}, ctx)
    assert not ctx.log.messages
