"""A finished run as Python sees it: its settings, its outcome, and everything that its stages made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.log.reader import LogFile
from kendama_cli.pipeline.artifact_place import recorded_stage, stored_folder, stored_log
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.report import write_report
from kendama_cli.schema.registry import resolve
from kendama_cli.store.codecs import load_artifact


class Run:
    """A run of a pipeline: its settings, its outcome, and everything that its stages made."""

    def __init__(self, record: Mapping[str, Any], pipeline_folders: Sequence[Path]) -> None:
        self.record = dict(record)
        """The document that ``kendama run --json`` prints, with when, where and with which versions."""
        self.pipeline_folders = tuple(pipeline_folders)
        """Where the pipeline is looked for."""

    def __repr__(self) -> str:
        return f"<Run {self.name} of {self.pipeline}: {self.outcome}>"

    @property
    def name(self) -> str:
        """The run's name, as ``kendama runs`` lists it."""
        return str(self.record["run"])

    @property
    def pipeline(self) -> str:
        """The pipeline that was run."""
        return str(self.record["pipeline"])

    @property
    def overrides(self) -> list[str]:
        """Return the overrides of the configuration."""
        return list(self.record["overrides"])

    @property
    def outcome(self) -> str:
        """``done``, ``failed``, ``interrupted``, ``killed`` or ``running``."""
        return str(self.record["outcome"])

    @property
    def stages(self) -> list[str]:
        """The stages that ended or failed, in the pipeline's order."""
        return [str(stage["name"]) for stage in self.record["stages"]]

    def metrics(self, stage: str) -> dict[str, Any]:
        """Return the stage's metrics by name; units stand in the names.

        Parameters
        ----------
        stage : str
            One of ``stages``.

        Raises
        ------
        UsageError
            If the run has no such stage.
        """
        return dict(recorded_stage(self.record, stage)["metrics"])

    def folder(self, stage: str) -> Path:
        """Return the folder that stores the stage's artifact, metrics and log.

        Parameters
        ----------
        stage : str
            One of ``stages``.

        Raises
        ------
        UsageError
            If the run has no such stage, or its artifact is not stored.
        """
        return stored_folder(self.record, stage)

    def artifact(self, stage: str) -> Any:
        """Return the stage's artifact: the frozen dataclass that its declaration names.

        Parameters
        ----------
        stage : str
            One of ``stages``.

        Raises
        ------
        UsageError
            If the run has no such stage, or its artifact is not stored.
        StoreError
            If the artifact is damaged or gone.
        """
        folder = self.folder(stage)
        declaration = load_pipeline(self.pipeline, self.pipeline_folders).stage(stage, "stage").declaration
        return load_artifact(resolve(declaration.returns, f"stage '{stage}'"), folder)

    def log(self, stage: str) -> LogFile:
        """Return the stage's log; ``log(stage).table(topic)`` is a pandas DataFrame with ``t_s`` and a column per
        field.

        If a stage that moves or records failed, the log holds what was logged until then.

        Parameters
        ----------
        stage : str
            One of ``stages``.

        Raises
        ------
        UsageError
            If the run has no such stage, or its artifact is not stored.
        InputError
            If the log is damaged or gone.
        """
        return LogFile(stored_log(self.record, stage))

    def report(self, output: Path | str | None = None) -> Path:
        """Write the run's report, a self-contained HTML page.

        Parameters
        ----------
        output : path, optional
            File to write; by default one in the current folder.

        Returns
        -------
        Path
            Path of the file.

        Raises
        ------
        InputError
            If a log is damaged or gone.
        """
        return write_report([self.record], None if output is None else Path(output))
