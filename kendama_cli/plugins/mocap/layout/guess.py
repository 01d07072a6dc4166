"""``kendama capture layout``: guess, show the evidence, draw the path, write the YAML."""

from __future__ import annotations

import re
import shutil
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from kendama_cli.cli import render
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, bundled_root, group_options
from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.devices.demonstrator.settings import FileCapture
from kendama_cli.devices.recordings.columnar import columnar_texts
from kendama_cli.devices.recordings.recording_format import NPZ, PARQUET, TABLE, format_of, name_of, text_of
from kendama_cli.errors import InputError, KendamaError, UsageError
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.mocap.layout.fit import Fit, fits
from kendama_cli.plugins.mocap.layout.reading import Reading
from kendama_cli.plugins.mocap.layout.readings import body_readings, table_readings
from kendama_cli.plugins.shared.recordings.reader import KNOWN
from kendama_cli.store.durable import write_file

MOST_EQUALS = 4


@dataclass(frozen=True)
class Layout:
    """The best fit of a recording, those that fit as well, and how the capture stage takes it."""

    best: Fit
    equal: tuple[Fit, ...]
    settings: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    refused: str = ""


def guess(site: Site, paths: Sequence[str], rate_hz: float | None) -> list[Fit]:
    """Return the fits of the first file, the best first; raises InputError where it cannot be a recording of a cup."""
    first = paths[0]
    usual = _capture(site, {"kind": "file", "path": first})
    assert isinstance(usual, FileCapture)
    readings = _readings(first, usual, rate_hz)
    found = fits(first, readings, usual.plausible)
    if found[0].problem:
        remedy = "cut the swing out of it, or tell the rate by --rate; the columns may be no places of a hand in metres"
        raise InputError(
            first, f"no reading of it is a swing; {found[0].reading.track}: {found[0].problem}", remedy=remedy
        )
    return found


def layout(site: Site, paths: Sequence[str], fit: Fit, equal: Sequence[Fit]) -> Layout:
    """Return the layout of ``fit`` for all files, as the capture stage reads them."""
    settings = {**fit.reading.settings(fit.axes), "path": paths[0] if len(paths) == 1 else list(paths)}
    try:
        hands = open_demonstrators(_capture(site, settings))
    except KendamaError as wrong:
        return Layout(fit, tuple(equal), settings, refused=str(wrong))
    notes = tuple(note for hand in hands for note in getattr(hand, "warnings", ()))
    return Layout(fit, tuple(equal), settings, (f"{len(hands)} swing{'s' * (len(hands) > 1)}", *notes))


def _readings(path: str, usual: FileCapture, rate_hz: float | None) -> list[Reading]:
    form = format_of(Path(path), remedy=KNOWN)
    if form in (PARQUET, NPZ):
        return table_readings(path, columnar_texts(path, form)[0], usual, rate_hz)
    if form is TABLE:
        return table_readings(path, text_of(path, Path(path).read_bytes(), remedy=KNOWN), usual, rate_hz)
    return body_readings(path, form)


def _capture(site: Site, settings: Mapping[str, Any]) -> Any:
    """Return the settings of the node ``capture`` for what a YAML of one's own would hold."""
    config = composed(site, [f"capture={settings['kind']}", "capture.path=recording"])
    return build_settings({**config, "capture": _merged(config["capture"], settings)})["capture"]


def _merged(base: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    both = {
        key: _merged(base[key], value) if isinstance(value, Mapping) and isinstance(base.get(key), Mapping) else value
        for key, value in other.items()
    }
    return {**base, **both}


def name_for(site: Site, path: str) -> str:
    """Return a name for the YAML of a recording: of its file, and not one that comes with kendama."""
    name = re.sub(r"\W+", "_", name_of(path)).strip("_") or "recording"
    bundled = {file.stem for file in (bundled_root() / "conf/capture").glob("*.yaml")}
    return f"{name}_recording" if name in bundled or name[0].isdigit() else name


def write_yaml(site: Site, name: str, made: Layout) -> Path:
    """Write ``conf/capture/NAME.yaml`` in this folder; raises UsageError where another layout stands there."""
    file = Path("conf/capture") / f"{name}.yaml"
    told = [f"# {one.about}: {one.value} ({one.evidence})" for one in findings(made.best)]
    plain = yaml.safe_dump(dict(made.settings), sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    text = "\n".join(
        ["# Guessed by 'kendama capture layout'; the keys that are missing come from its kind.", *told, plain]
    )
    if file.exists() and file.read_text(encoding="utf-8") != text:
        raise UsageError(f"{file} is there already with another layout; give --name NAME, or delete it")
    if name in group_options(site, "capture") and not file.exists():
        raise UsageError(f"--name {name}: kendama has capture={name} itself; give another name")
    write_file(file.absolute(), text.encode())
    return file


def findings(fit: Fit) -> list[Any]:
    """Return all findings of a fit, in the order in which a reader asks."""
    return [*fit.reading.findings, *fit.findings()]


def show(made: Layout, lines: Sequence[str]) -> None:
    """Print the findings with their evidence, the sketch, and what fits as well."""
    wide = max(60, shutil.get_terminal_size((80, 0)).columns)
    for one in findings(made.best):
        told = f"{one.about:<12} {one.value}: {one.evidence}"
        render.text(textwrap.fill(told, wide, subsequent_indent=" " * 13, break_on_hyphens=False))
    render.text("\n" + "\n".join(f"    {line}" for line in lines) + "\n")
    for note in made.notes:
        render.text(note)
    if not made.best.is_swing:
        render.text(
            "with no axis up does a ball on a rope rise and come down near the cup: is it a swing of a kendama?"
        )
    for number, fit in enumerate(made.equal[:MOST_EQUALS], start=2):
        render.text(f"fits as well ({number}): {described(fit)}")
    if made.refused:
        render.text(f"as it stands, a run would refuse it: {made.refused}")


def described(fit: Fit) -> str:
    """Return a fit in one line."""
    axes = [("-" if sign < 0 else "") + fit.reading.axes[i] for i, sign in fit.axes]
    guessed = f", {fit.reading.guessed}" if fit.reading.guessed else ""
    return f"{fit.reading.track}{guessed}, {axes[2]} up (near the cup in {fit.rise.caught:.0%})"
