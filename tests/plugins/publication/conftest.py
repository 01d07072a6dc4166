"""The made-up run of the report."""

from tests.report.conftest import logs, run, run_folder  # noqa: F401 - fixtures
