"""Nothing that a configuration, a pipeline, a log, an artifact or a label can hold runs code or leaves its folder."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import zipfile
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.cli.main import main
from kendama_cli.config.site import bundled_root
from kendama_cli.errors import KendamaError
from kendama_cli.log.messages import RolloutMessage
from kendama_cli.log.writer import McapLog
from kendama_cli.report.page import make_report
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.store import durable
from kendama_cli.store.checkpoint import DurableAppendFile
from kendama_cli.store.codecs import load_artifact, save_artifact
from kendama_cli.store.garbage import collect_garbage
from kendama_cli.store.store import Store

CANARY = "canary"
MODULE = "kendama_canary"
"""A module beside the user's files whose import leaves the canary."""


def code(canary: Path) -> tuple[str, ...]:
    """Values that make one loader or another run a program, or import a module."""
    touch = f"touch {canary}"
    return (
        f"!!python/object/apply:os.system ['{touch}']",
        f"!!python/object/new:os.system ['{touch}']",
        f"!!python/object/apply:subprocess.Popen [['touch', '{canary}']]",
        f"!!python/name:{MODULE}.x ''",
        f"!!python/module:{MODULE} ''",
        f"{{_target_: os.system, command: '{touch}'}}",
        f"{{_target_: {MODULE}.x}}",
        f"{{_target_: hydra.utils.call, _args_: ['os.system', '{touch}']}}",
        f"'${{oc.create:{{_target_: os.system, command: {touch}}}}}'",
        f'\'${{python:__import__("os").system("{touch}")}}\'',
        f'\'${{eval:__import__("os").system("{touch}")}}\'',
        f"'${{hydra:runtime.{MODULE}}}'",
        f"'$({touch})'",
        f"'`{touch}`'",
        f"'; {touch} ;'",
        f"'{{{{ cycler.__init__.__globals__.os.system(\"{touch}\") }}}}'",
    )


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty current folder whose surroundings are watched: nothing appears there, and no canary anywhere."""
    inside = tmp_path / "around" / "inside"
    inside.mkdir(parents=True)
    (inside / f"{MODULE}.py").write_text(f"open({str(tmp_path / 'around' / CANARY)!r}, 'w').close()\nx = print\n")
    (tmp_path / "around" / "secret.yaml").write_text("a: 1\n")
    monkeypatch.chdir(inside)
    monkeypatch.syspath_prepend(str(inside))
    monkeypatch.setenv("KENDAMA_DEBUG", "1")
    before = seen(tmp_path / "around", inside)
    yield inside
    assert seen(tmp_path / "around", inside) == before
    assert not list(tmp_path.rglob(CANARY))


def seen(around: Path, inside: Path) -> dict[str, bytes]:
    """All files around the folder, but not in it."""
    return {str(path): path.read_bytes() for path in around.rglob("*") if path.is_file() and inside not in path.parents}


def attempt(*arguments: str) -> None:
    """``kendama ARGUMENTS``: it may refuse in one line, and nothing else."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        refused = None
        try:
            main(list(arguments))
        except KendamaError as error:
            refused = str(error)
    assert refused is None or len(refused.splitlines()) == 1


def canary(place: Path) -> Path:
    return place.parent / CANARY


@pytest.mark.slow
def test_no_value_of_a_configuration_is_run(place: Path) -> None:
    sound = (bundled_root() / "conf/game/kendama.yaml").read_text()
    (place / "conf/game").mkdir(parents=True)
    attempts = 0
    for number, value in enumerate(code(canary(place))):
        for key in ("more", "rope", "_target_"):
            (place / f"conf/game/x{number}.yaml").write_text(f"{sound}\n{key}: {value}\n")
            attempt("config", f"game=x{number}")
            attempts += 1
        attempt("config", f"+game.more={value}")
        attempt("plan", "-p", "imitation", f"capture.path={value}")
        attempts += 2
    assert attempts == 80


def test_the_first_file_imports_nothing(place: Path) -> None:
    sound = (bundled_root() / "conf/config.yaml").read_text()
    (place / "conf").mkdir()
    for more in (
        f"hydra: {{searchpath: ['pkg://{MODULE}']}}",
        f"hydra: {{callbacks: {{a: {{_target_: {MODULE}.x}}}}}}",
        f"hydra: {{launcher: {{_target_: {MODULE}.x}}}}",
        f"hydra: {{job: {{env_set: {{PATH: {place}}}}}}}",
    ):
        (place / "conf/config.yaml").write_text(f"{sound}\n{more}\n")
        attempt("config")
    (place / "conf/config.yaml").unlink()
    for override in (f"hydra.searchpath=[pkg://{MODULE}]", f"+hydra.searchpath=[pkg://{MODULE}]", "++hydra.mode=X"):
        attempt("config", override)


def test_no_value_of_a_pipeline_is_run(place: Path) -> None:
    for value in code(canary(place)):
        for text in (
            f"stages: {value}",
            f"stages: {{encode: {value}}}",
            f"stages: {{encode: {{stage: {value}}}}}",
            f"stages: {{encode: {{config: [{value}]}}}}",
            f"overrides: [{value}]\nstages: {{capture: {{config: [capture]}}}}",
        ):
            (place / "p.yaml").write_text(text)
            attempt("plan", "-p", "p.yaml")


def test_a_stage_is_named_by_its_entry_point_and_by_nothing_else(place: Path) -> None:
    for stage in (f"{MODULE}:x", MODULE, f"{MODULE}.x", "os:system", "../encode", "encode/../../x", f"{MODULE}:x()"):
        for text in (f"stages: {{encode: {{stage: '{stage}'}}}}", f"stages: {{'{stage}': {{stage: encode}}}}"):
            (place / "p.yaml").write_text(text)
            attempt("plan", "-p", "p.yaml")
            attempt("run", "-p", "p.yaml")
    for kind in (f"{MODULE}:x", "os.system", f"{MODULE}.x", "builtins:exec"):
        for group in ("capture", "hardware", "robot", "camera", "learn"):
            attempt("plan", f"{group}.kind={kind}")


def test_no_name_leaves_its_folder(place: Path) -> None:
    (place / ".kendama/runs/00001-abcdef").mkdir(parents=True)
    for name in ("../../secret", "..", "/etc/passwd", "../../../around/secret.yaml", "a/../../b", "~/x", "x\\..\\y"):
        for command in (
            ("report", name),
            ("report", "00001", name),
            ("motion", "show", name),
            ("motion", "export", name, "-o", "out.yaml"),
            ("plan", "-p", name),
            ("plan", "-p", "imitation", "--until", name),
            ("plan", f"game={name}"),
            ("plan", f"+{name}=1"),
            ("log", "export", name),
        ):
            attempt(*command)


class Evil:
    """Unpickled, it leaves the canary."""

    def __init__(self, canary: Path) -> None:
        self.canary = canary

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return os.system, (f"touch {self.canary}",)


def test_no_array_of_an_artifact_is_unpickled(place: Path) -> None:
    folder = place / "policy"
    folder.mkdir()
    save_artifact(PolicyArtifact, PolicyArtifact.seal("table", {}, {"q": np.zeros((2, 2))}), folder)
    sound = dict(np.load(folder / "arrays.npz"))
    evil = np.array([Evil(canary(place))], dtype=object)
    for name in sound:
        np.savez(folder / "arrays.npz", allow_pickle=True, **{**sound, name: evil})
        with pytest.raises(KendamaError):
            load_artifact(PolicyArtifact, folder)
    for member in (f"{next(iter(sound))}.npy", "../../../canary.npy", "/tmp/canary.npy", "x.pkl"):
        with zipfile.ZipFile(folder / "arrays.npz", "w") as archive:
            archive.writestr(member, pickle.dumps(Evil(canary(place))))
        with pytest.raises(KendamaError):
            load_artifact(PolicyArtifact, folder)


def test_no_type_that_an_artifact_names_is_made(place: Path) -> None:
    folder = place / "policy"
    folder.mkdir()
    for name in ("__class__", "__type__", "_target_", "type", "py/object", "kind"):
        for value in (f'"{MODULE}.x"', '"os.system"', f'{{"{name}": "{MODULE}:x"}}'):
            (folder / "artifact.json").write_text(f'{{"{name}": {value}, "arrays": []}}')
            with pytest.raises(KendamaError):
                load_artifact(PolicyArtifact, folder)


def test_a_record_that_names_another_folder_has_nothing_there_deleted(place: Path) -> None:
    store = Store(place / ".kendama")
    for number, artifact in enumerate(("../../..", "..", "/", str(place.parent), "../" * 9 + "etc")):
        record = {"stage": "a", "key": str(number), "artifact": artifact, "metrics": {}, "parts": {}, "made_with": {}}
        durable.write_sealed(store.result_path("a", str(number)), record)
        assert store.find("a", str(number)) is None
    run = {"run": "../../../secret", "outcome": "done", "stages": [], "printed": {"../../../../secret.yaml": "0"}}
    durable.write_sealed(store.home / "runs/00001-aaaaaa.json", {**run, "pipeline": "../x", "overrides": []})
    (store.home / "runs/00002-link").symlink_to(place.parent)
    (store.home / "checkpoints/a").mkdir(parents=True)
    (store.home / "checkpoints/a/link").symlink_to(place.parent)
    collect_garbage(store, keep_runs=0)
    attempt("cache", "gc")
    attempt("report")


LABELS = (
    "<script>document.title='taken'</script>",
    "</script><script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "'><svg onload=alert(1)>",
    '<a href="javascript:alert(1)">x</a>',
    "</title><script>alert(1)</script>",
    "</style><script>alert(1)</script>",
    "-->\n<script>alert(1)</script>",
    "<iframe src='https://example.org'></iframe>",
    "<meta http-equiv=refresh content='0;url=https://example.org'>",
    "&lt;script&gt;alert(1)&lt;/script&gt;",
    "<base href='https://example.org/'>",
)


ADDRESSES = ("href", "xlink:href", "src", "srcset", "action", "formaction", "data", "poster", "background", "ping")
"""Attributes whose value is an address; a report leads to its own places and holds its own images, and no other."""


class Active(HTMLParser):
    """Counts what could act in a page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.policy = ""

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policy = str(given["content"])
        elif tag in ("iframe", "object", "embed", "base", "form") or (tag == "meta" and "http-equiv" in given):
            self.found.append(tag)
        elif tag == "script" and given.get("type") != "application/json":
            self.found.append("script")
        for name, value in attributes:
            leads_on = name in ADDRESSES and not str(value).strip().startswith(("#", "data:image/", "data:,"))
            if name.startswith("on") or leads_on:
                self.found.append(f"{name}={value}")


def active(page: str) -> Active:
    parsed = Active()
    parsed.feed(page)
    return parsed


def log(path: Path, label: str) -> Path:
    made = McapLog({"/learn/rollout": RolloutMessage}, DurableAppendFile(path.with_suffix(".part")))
    made.write("/learn/rollout", 0.0, RolloutMessage(0, True, 1.0, False, 1.0, 0.1, 1))
    made.finish(path, stage=label, settings={label: {label: label}}, metrics={label: label, "n": 1})
    return path


def reports(place: Path, stage: str, label: str) -> tuple[Active, Active]:
    """The pages of one run and of two whose every label is ``label``."""
    name = label if stage == "made-up" else stage
    path = log(place / "log.mcap", label)
    entry = {"name": name, "stage": stage, "status": "failed", "error": label, "metrics": {label: label}}
    run = {"run": label, "pipeline": label, "overrides": [label, f"seed={label}"], "stages": [entry]}
    other = {**run, "overrides": ["seed=1"]}
    many = make_sweep_report(label, [(run, {name: path}), (other, {name: path})])
    return active(make_report(run, {name: path})), active(many)


@pytest.mark.parametrize("stage", ["made-up", "learn"])
def test_no_label_of_a_log_or_a_record_acts_in_a_report(place: Path, stage: str) -> None:
    """What acts in a page are its own scripts, each allowed by its digest, whatever the labels are."""
    harmless = reports(place, stage, "harmless")
    for page in harmless:
        assert set(page.found) <= {"script"}
        assert page.policy.startswith("default-src 'none'; ")
        assert page.policy.count("'sha256-") == len(page.found)
        assert "http" not in page.policy
    for label in LABELS:
        for page, usual in zip(reports(place, stage, label), harmless, strict=True):
            assert page.found == usual.found, f"{label}: {page.found}"
            assert page.policy == usual.policy
