"""A home by the names of today: results, what people and arms recorded, logs and runs that an older version wrote.

Everything new is written before anything old is deleted, and what has today's names is left: who was interrupted goes
on by the same command.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader

from kendama_cli.artifacts.policy import NamedArray, policy_digest
from kendama_cli.log.container_writer import ContainerWriter
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import STAGE_METADATA, MemoryFile, canonical_json
from kendama_cli.plugins.migration.renamed_text import new_override
from kendama_cli.schema.json_text import json_text
from kendama_cli.schema.messages import OUR_PACKAGE
from kendama_cli.schema.renames import SINCE, new_value, renamed, renamed_anywhere
from kendama_cli.schema.unpacking import unpacked_arrays
from kendama_cli.store import durable
from kendama_cli.store.codecs import pack_arrays
from kendama_cli.store.home import MARK, OLD_RETURNS, RUN
from kendama_cli.store.store import ARTIFACT_FILES, MANIFEST, Store, StoredResult, content_digest, key_of, read_manifest


def migrate_log(source: Path, target: Path) -> bool:
    """Write ``source`` by the names of today to ``target``; False, with nothing written, where it has them already.

    Messages keep their times, their order and, as fields are known by number, their bytes. Raises InputError where
    ``source`` is damaged, or no log.
    """
    before = LogFile(source)
    metadata = {name: _facts(values) if name == STAGE_METADATA else values for name, values in before.metadata.items()}
    writer = ContainerWriter(MemoryFile())
    schemas: dict[int, tuple[str, bytes]] = {}
    channels: dict[int, int] = {}
    changed = metadata != before.metadata
    with source.open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, Schema):
                schemas[record.id] = _schema(record.name, record.data)
                changed |= schemas[record.id] != (record.name, record.data)
            elif isinstance(record, Channel) and record.id not in channels:
                topic = renamed_anywhere("topic", record.topic)
                changed |= topic != record.topic
                channels[record.id] = writer.add_channel(topic, *schemas[record.schema_id])
            elif isinstance(record, Message):
                writer.add(channels[record.channel_id], record.log_time, record.data)
    if changed:
        with target.open("wb") as file:
            writer.finish(file, metadata)
    return changed


def _facts(values: Mapping[str, str]) -> dict[str, str]:
    """Return stage, settings and metrics of a log by the names of today; as they are where they are no JSON."""
    made = dict(values)
    change: dict[str, Callable[[Any], Any]] = {
        "settings": lambda nodes: {node: new_value(node, value) for node, value in nodes.items()},
        "metrics": lambda metrics: new_metrics(values.get("stage", ""), metrics),
    }
    for name in change.keys() & values.keys():
        held = json.loads(values[name])
        if isinstance(held, dict):
            made[name] = canonical_json(change[name](held))
    return made


def _schema(name: str, data: bytes) -> tuple[str, bytes]:
    """Return the name and the descriptors of a message of ours by the names of today."""
    package, _, own = name.rpartition(".")
    if package != OUR_PACKAGE:
        return name, data
    new, files = renamed("message", "log", own) or own, FileDescriptorSet.FromString(data)
    for file in files.file:
        for message in file.message_type:
            if file.package == OUR_PACKAGE and message.name == own:
                file.name, message.name = f"{package}/{new}.proto", new
                for field in message.field:
                    field.name = renamed("field", new, field.name) or field.name
    return f"{package}.{new}", files.SerializeToString(deterministic=True)


LOG = "log.mcap"
_STAGE = re.compile(r"\.(?:stages|plugins)\.(\w+)\.")
_POLICY = {"kind", "meaning", "arrays", "digest"}


@dataclass(frozen=True)
class Migration:
    """Numbers of what was rewritten, and of the results that cannot be made again but by a person or an arm."""

    results: int
    runs: int
    recordings: int


def migrate_home(store: Store) -> Migration:
    """Rewrite all in the home of ``store`` whose names changed; raises StoreError while a run goes on."""
    with store.alone():
        results = store.entries()
        contents = {one.content_digest: _new_content(one) for one in results}
        moved = {(one.stage, one.key): made for one in results if (made := _migrated(store, one, contents)) is not None}
        runs = sum(_migrated_run(store, path, moved) for path in _run_records(store.home))
        for path in sorted((store.home / "index" / "latest").glob("*/*.json")):
            _migrate_latest(path, contents)
        for one in results:
            new = moved.get((one.stage, one.key))
            if new is not None and new.key != one.key:
                durable.remove(store.result_path(one.stage, one.key))
        kept = {one.artifact for one in store.entries()}
        for folder in {one.artifact for one in results} - kept:
            durable.remove(folder)
        durable.write_sealed(store.home / MARK, {"home": "kendama", "names": SINCE})
    recordings = sum(not new.parts["code"] for new in moved.values())
    return Migration(len(moved), runs, recordings)


def new_parts(parts: Mapping[str, Any], contents: Mapping[str, str]) -> dict[str, Any]:
    """Return what a key is made of by the names of today; ``contents`` are digests of inputs, old to new."""
    return {
        **{name: value for name, value in parts.items() if name != OLD_RETURNS},
        "stage": renamed_anywhere("object", str(parts["stage"])),
        "returns": _returned(parts),
        "config": {node: new_value(node, value) for node, value in parts["config"].items()},
        "inputs": {name: contents.get(digest, digest) for name, digest in parts["inputs"].items()},
    }


def _returned(parts: Mapping[str, Any]) -> str:
    """Return the artifact that ``parts`` name, as it is called today."""
    return renamed_anywhere("object", str(parts["returns"] if "returns" in parts else parts[OLD_RETURNS]))


def _migrated(store: Store, result: StoredResult, contents: Mapping[str, str]) -> StoredResult | None:
    """Publish ``result`` by the names of today; None where it has them."""
    parts = new_parts(result.parts, contents)
    metrics, key = new_metrics(_declared(result), result.metrics), key_of(parts)
    files = _new_files(result)
    with store.scratch_folder() as folder:
        for path in durable.listed(result.artifact):
            if path.name == LOG and migrate_log(path, folder / LOG):
                files[LOG] = b""
            elif path.name == "metrics.json" and metrics != result.metrics:
                (folder / path.name).write_bytes(durable.canonical_json(metrics) + b"\n")
            elif path.name in files:
                (folder / path.name).write_bytes(files[path.name])
            elif path.name != MANIFEST:
                shutil.copyfile(path, folder / path.name)
        if not files and (key, parts, metrics) == (result.key, result.parts, result.metrics):
            return None
        return store.put(folder, result.stage, key, metrics, parts, made_with=result.made_with)


def _declared(result: StoredResult) -> str:
    """Return the name that the stage's declaration has; a pipeline may call it otherwise."""
    found = _STAGE.search(str(result.parts["stage"]))
    return found.group(1) if found else result.stage


def _new_content(result: StoredResult) -> str:
    """Return the digest of what later stages read of a result, once its names are those of today."""
    files, manifest = _new_files(result), read_manifest(result.artifact)
    assert manifest is not None
    changed = {name: {"sha256": durable.sha256(data)} for name, data in files.items() if name in ARTIFACT_FILES}
    return content_digest({"files": {**manifest["files"], **changed}})


def _new_files(result: StoredResult) -> dict[str, bytes]:
    """Return the files of an artifact that hold names which changed, by the names of today."""
    body_path, packed = result.artifact / "artifact.json", result.artifact / "arrays.npz"
    if not body_path.exists():
        return {}
    before = json.loads(body_path.read_bytes())
    kind = _returned(result.parts).rpartition(":")[2]
    arrays = {name: renamed("field", kind, name) for name in before} if isinstance(before, dict) else {}
    new = {name: value for name, value in arrays.items() if value is not None}
    held = unpacked_arrays(packed.read_bytes()) if packed.exists() else {}
    body = _with_policies({new.get(name, name): _moved(value, new) for name, value in before.items()}, held)
    files: dict[str, bytes] = {}
    if body != before:
        files[body_path.name] = durable.canonical_json(body) + b"\n"
    if new.keys() & held.keys():
        files[packed.name] = pack_arrays({new.get(name, name): value for name, value in held.items()})
    return files


def _moved(value: Any, new: Mapping[str, str]) -> Any:
    """Return a field whose array has the name of the field."""
    return {"array": new[value["array"]]} if isinstance(value, dict) and value.get("array") in new else value


def _with_policies(body: Any, arrays: Mapping[str, Any]) -> Any:
    """Return an artifact with every policy in it meant and sealed by the names of today."""
    if isinstance(body, list):
        return [_with_policies(one, arrays) for one in body]
    if not isinstance(body, dict):
        return body
    if body.keys() != _POLICY:
        return {name: _with_policies(one, arrays) for name, one in body.items()}
    kind = renamed("value", "learn.learner", body["kind"]) or body["kind"]
    meaning = json_text(new_value("learn", json.loads(body["meaning"])))
    named = tuple(NamedArray(one["name"], arrays[one["values"]["array"]]) for one in body["arrays"])
    return {**body, "kind": kind, "meaning": meaning, "digest": policy_digest(kind, meaning, named)}


def _run_records(home: Path) -> list[Path]:
    found = durable.listed(home / "runs")
    return sorted(path for path in found if path.suffix == ".json" and RUN.fullmatch(path.stem))


def _migrated_run(store: Store, path: Path, moved: Mapping[tuple[str, str], StoredResult]) -> bool:
    """Rewrite the record of a run and the logs beside it; True where any name of it changed."""
    record = durable.read_sealed(path)
    if record is None:
        return False
    stages = []
    for stage in record["stages"]:
        new = moved.get((stage["name"], str(stage["key"])))
        metrics = new_metrics(stage["stage"], stage["metrics"]) if new is None else new.metrics
        found = {} if new is None else {"key": new.key, "artifact": str(new.artifact)}
        stages.append({**stage, **found, "metrics": {name: metrics[name] for name in _in_order(stage, metrics)}})
    alone = {stage["stage"] for stage in record["stages"]} == {"measure"}
    pipeline = renamed_anywhere("pipeline", record["pipeline"]) if alone else record["pipeline"]
    overrides = [new_override(text) for text in record["overrides"]]
    made = {**record, "pipeline": pipeline, "overrides": overrides, "stages": stages}
    changed = made != record
    for log in durable.listed(path.with_suffix("")):
        if log.suffix == ".mcap":
            with store.scratch_folder() as folder:
                if migrate_log(log, folder / log.name):
                    durable.copy_file(folder / log.name, log)
                    changed = True
    if made != record:
        durable.write_sealed(path, made)
    return changed


def new_metrics(stage: str, metrics: Mapping[str, Any]) -> dict[str, Any]:
    """Return the metrics of a stage, by its declaration's name, as they are called today."""
    return {
        renamed("metric", stage, name) or name: new_value(f"{stage}.{name}", value) if isinstance(value, str) else value
        for name, value in metrics.items()
    }


def _in_order(stage: Mapping[str, Any], metrics: Mapping[str, Any]) -> list[str]:
    """Return the metrics' names in the order in which the record of a run has them."""
    names = list(new_metrics(stage["stage"], stage["metrics"]))
    return names if set(names) == set(metrics) else list(metrics)


def _migrate_latest(path: Path, contents: Mapping[str, str]) -> None:
    """Rewrite what the next plan of a pipeline compares with."""
    latest = durable.read_index(path)
    if latest is None or not latest.get("parts"):
        return
    parts = new_parts(latest["parts"], contents)
    pipeline = path.parent.name
    if path.stem == "measure" and len(list(path.parent.iterdir())) == 1:
        pipeline = renamed_anywhere("pipeline", pipeline)
    durable.write_index(path.parents[1] / pipeline / path.name, {"key": key_of(parts), "parts": parts})
