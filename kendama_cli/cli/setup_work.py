"""Writing and showing a setup.yaml."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.artifacts.kendama_model import KendamaModel
from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.config.laboratory import read_setup
from kendama_cli.config.site import Site
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.finished_run import Run
from kendama_cli.pipeline.record import find_run
from kendama_cli.settings.setup import (
    SIGMAS_95,
    LaboratorySetup,
    MeasuredDrag,
    MeasuredNumber,
    MeasuredPlace,
)

NOTE = "# Measured values of a laboratory, each with its standard deviation: kendama run setup=FILE\n"
SPEED_M_S = 3.0


def refuse_setup(output: Path) -> None:
    """Raise UsageError where the setup ``output`` cannot be written."""
    refuse_output(output, "a setup is YAML", ".yaml", ".yml")


def amended(output: Path, **measured: Any) -> LaboratorySetup:
    """Write ``measured`` into the setup ``output``, whose other entries stay; the setup as it is now."""
    refuse_setup(output)
    empty = LaboratorySetup(**dict.fromkeys((field.name for field in dataclasses.fields(LaboratorySetup)), None))
    made = dataclasses.replace(read_setup(output) if output.exists() else empty, **measured)
    content = {name: value for name, value in dataclasses.asdict(made).items() if value is not None}
    write_output(output, (NOTE + yaml.safe_dump(_lists(content), sort_keys=False, allow_unicode=True)).encode())
    return made


def keep_toy(site: Site, run: str | None, output: Path) -> None:
    """Store rope and drag of the run's stage ``measure``; raises UsageError if it has none."""
    found = Run(find_run(site.home, run), site.pipeline_folders)
    if "measure" not in found.stages:
        raise UsageError(f"run {found.name} has no stage 'measure'; 'kendama run -p measurement' measures the kendama")
    kendama: KendamaModel = found.artifact("measure")
    source = f"run {found.name}, a free swing of {kendama.duration_s:.0f} s"
    value, sigma = kendama.drag_n_s_m(SPEED_M_S)
    rope = MeasuredNumber(round(kendama.rope_m, 6), round(kendama.rope_sigma_m, 7), source)
    drag = MeasuredDrag(max(kendama.linear_n_s_m, 0.0), max(kendama.quadratic_n_s2_m2, 0.0), value, sigma, source)
    amended(output, rope_m=rope, drag=drag)
    show_setup(output, as_json=False)


def show_setup(file: Path, *, as_json: bool) -> None:
    """Show a row per measured value."""
    setup = read_setup(file)
    if as_json:
        render.document(dataclasses.asdict(setup))
        return
    render.table(list(_rows(setup)), head=("measured", "value", "+- (95 %)", "unit", "by"))
    render.text(f"{file}; use it with setup={file}")


def _rows(setup: LaboratorySetup) -> Iterator[Sequence[str]]:
    if (rope := setup.rope_m) is not None:
        yield "rope", f"{1e3 * rope.value:.2f}", f"{1e3 * SIGMAS_95 * rope.sigma:.2f}", "mm", rope.source
    if (drag := setup.drag) is not None:
        off = f"{1e3 * SIGMAS_95 * drag.sigma_at_3_m_s:.3f}"
        yield "drag at 3 m/s", f"{1e3 * drag.at_3_m_s:.3f}", off, "mN s/m", drag.source
    if (delay := setup.camera_delay_s) is not None:
        yield "camera's delay", f"{1e3 * delay.value:.2f}", f"{1e3 * SIGMAS_95 * delay.sigma:.2f}", "ms", delay.source
    for name, offset in (("marker to cup", setup.marker_to_cup_m), ("body to cup", setup.body_to_cup_m)):
        if offset is not None:
            yield name, _millimetres(offset.value), _millimetres(offset.sigma, SIGMAS_95), "mm", offset.source
    for one in setup.cameras or ():
        place, turn = one.camera.position_m, [math.degrees(sigma) for sigma in one.sigma_rad]
        yield f"camera {one.camera.name}", _millimetres(place), _millimetres(one.sigma_m, SIGMAS_95), "mm", one.source
        shown = " ".join(f"{SIGMAS_95 * sigma:.2f}" for sigma in turn)
        yield f"camera {one.camera.name}, turned", "", shown, "deg", one.source


def place(value: Sequence[float], sigma: Sequence[float], source: str) -> MeasuredPlace:
    """Return a measured place from arrays."""
    x, y, z = (round(float(one), 6) for one in value)
    sigma_x, sigma_y, sigma_z = (round(float(one), 7) for one in sigma)
    return MeasuredPlace((x, y, z), (sigma_x, sigma_y, sigma_z), source)


def _millimetres(values: Sequence[float], times: float = 1.0) -> str:
    return " ".join(f"{1e3 * times * value:.2f}" for value in values)


def _lists(value: Any) -> Any:
    """Return tuples as lists, which YAML can represent."""
    if isinstance(value, dict):
        return {name: _lists(item) for name, item in value.items()}
    return [_lists(item) for item in value] if isinstance(value, list | tuple) else value
