"""The made-up run of the reports' tests, whose logs have demonstrations and games."""

from tests.report.conftest import logs, run, run_folder

__all__ = ["logs", "run", "run_folder"]
