"""Writes episodes as a LeRobot dataset, format v3.0: Parquet and JSON, read by LeRobotDataset(repo_id, root=FOLDER).

Layout and columns follow what LeRobot 0.4 writes itself: ``data/`` has a row per frame, ``meta/`` the features, the
episodes with their statistics, and the task in words.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from kendama_cli.errors import StoreError, no_pyarrow
from kendama_cli.log.episode import Episodes

try:
    import pyarrow as pa
    import pyarrow.parquet
except ImportError:
    raise no_pyarrow("--format lerobot", "or export tables as CSV") from None

VERSION = "v3.0"
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_COUNTED = ("frame_index", "episode_index", "index", "task_index")

Columns = dict[str, Any]
"""Values of all frames by feature: (n,) or (n, k)."""


def write_dataset(made: Episodes, folder: Path) -> list[Path]:
    """Write ``made`` to ``folder``, which must be new or empty; the files written.

    Raises StoreError where the disk refuses.
    """
    columns = [_columns(made, number) for number in range(len(made.episodes))]
    whole = {key: np.concatenate([one[key] for one in columns]) for key in columns[0]}
    features = {key: _feature(key, values, made.names.get(key)) for key, values in whole.items()}
    first = {"chunk_index": 0, "file_index": 0}
    tables = {
        f"data/{_FILE.format(**first)}": pa.table({key: _arrow(values) for key, values in whole.items()}),
        f"meta/episodes/{_FILE.format(**first)}": pa.Table.from_pylist(list(_described(made, columns))),
    }
    info = {
        "codebase_version": VERSION,
        "robot_type": made.robot,
        "total_episodes": len(made.episodes),
        "total_frames": len(whole["index"]),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": made.fps,
        "splits": {"train": f"0:{len(made.episodes)}"},
        "data_path": f"data/{_FILE}",
        "video_path": None,
        "features": features,
    }
    documents = {"meta/info.json": info, "meta/stats.json": {key: _stats(values) for key, values in whole.items()}}
    try:
        for name, table in tables.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            pyarrow.parquet.write_table(table, folder / name)
        pd.DataFrame({"task_index": [0]}, index=[made.task]).to_parquet(folder / "meta/tasks.parquet")
        for name, document in documents.items():
            (folder / name).write_text(json.dumps(document, indent=4, ensure_ascii=False), encoding="utf-8")
    except OSError as wrong:
        raise StoreError(str(folder), f"cannot write '{folder}': {wrong.strerror or wrong}") from None
    return [folder / name for name in (*tables, "meta/tasks.parquet", *documents)]


def _columns(made: Episodes, number: int) -> Columns:
    episode = made.episodes[number]
    n = len(episode)
    before = sum(map(len, made.episodes[:number]))
    columns: Columns = {key: np.asarray(values, dtype=np.float32) for key, values in episode.vectors.items()}
    last = np.arange(n) == n - 1
    columns["next.done"] = last
    if episode.success is not None:
        columns["next.success"] = last & episode.success
    columns["timestamp"] = np.asarray(np.arange(n) / made.fps, dtype=np.float32)
    counted = (np.arange(n), np.full(n, number), before + np.arange(n), np.zeros(n))
    return columns | {key: np.asarray(values, dtype=np.int64) for key, values in zip(_COUNTED, counted, strict=True)}


def _described(made: Episodes, columns: Sequence[Columns]) -> Iterator[dict[str, Any]]:
    """Yield the row of each episode."""
    for number, values in enumerate(columns):
        stats = {f"stats/{key}/{name}": value for key, one in values.items() for name, value in _stats(one).items()}
        yield {
            "episode_index": number,
            "tasks": [made.task],
            "length": len(values["index"]),
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": int(values["index"][0]),
            "dataset_to_index": int(values["index"][-1]) + 1,
            **stats,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
        }


def _feature(key: str, values: Any, names: Sequence[str] | None) -> dict[str, Any]:
    shape = list(values.shape[1:]) or [1]
    return {"dtype": str(values.dtype), "shape": shape, "names": None if names is None else list(names)}


def _stats(values: Any) -> dict[str, list[Any]]:
    """Return the statistics of each number of a feature over its frames."""
    rows = values.reshape(len(values), -1)
    numbers = rows.astype(np.float64)
    return {
        "min": rows.min(axis=0).tolist(),
        "max": rows.max(axis=0).tolist(),
        "mean": numbers.mean(axis=0).tolist(),
        "std": numbers.std(axis=0).tolist(),
        "count": [len(rows)],
        **{name: np.quantile(numbers, share, axis=0).tolist() for name, share in _QUANTILES.items()},
    }


def _arrow(values: Any) -> pa.Array:
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
