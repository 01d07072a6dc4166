"""A pytest plugin: a block's conformance suite, run on the part that the configuration chooses.

    pytest -p kendama_cli.conformance --suite robot --override hardware=mine

The suites come by the entry point group ``kendama.suites``: camera, controller, demonstrator, detector,
learner, robot.
Each lists its laws as ``CHECKS`` and makes what they are tried on from the configuration, by ``subject``; configuration
is found and overridden as ``kendama run`` does it in the current folder.
"""

from __future__ import annotations

import dataclasses
import importlib.util
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.errors import ConfigError, InputError, KendamaError, MissingPartError, UsageError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.schema.registry import comes_with, declared

SUITES = "kendama.suites"
_FOUND = pytest.StashKey[dict[str, Any]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that choose a part and arm a robot."""
    group = parser.getgroup("kendama", "conformance of parts of kendama")
    group.addoption(
        "--override",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="override configuration, as kendama run",
    )
    group.addoption("--suite", action="append", default=[], metavar="BLOCK", help="the suite of a block: robot, say")
    group.addoption("--arm", action="store_true", help="let a robot move that may be real; clear its surroundings")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a conformance suite once per law."""
    if "law" in metafunc.fixturenames:
        checks = metafunc.module.CHECKS
        metafunc.parametrize("law", checks, ids=[check.__name__.removeprefix("check_") for check in checks])


def pytest_configure(config: pytest.Config) -> None:
    """Compose the configuration once, before any test; raises pytest.UsageError, a line without a traceback."""
    try:
        if suites := config.getoption("--suite"):
            config.args = [suite_file(name) for name in suites]
        site = find_site(None, None)
        settings = build_settings(composed(site, config.getoption("--override")))
        config.stash[_FOUND] = {
            name: resolve_files(value, name, site.data_roots) if dataclasses.is_dataclass(value) else value
            for name, value in settings.items()
        }
    except KendamaError as error:
        raise pytest.UsageError(str(error)) from None


def suite_file(suite: str) -> str:
    """Return the file of a suite; raises MissingPartError for one of a part that is not here, UsageError for others."""
    known = declared(SUITES)
    if line := suite not in known and comes_with(f"--suite {suite}", SUITES, suite):
        raise MissingPartError(suite, line)
    if suite not in known:
        raise UsageError(f"--suite is '{suite}'; allowed: {', '.join(sorted(known))}")
    spec = importlib.util.find_spec(known[suite].partition(":")[0])
    if spec is None or spec.origin is None:
        raise MissingPartError(suite, f"suite '{suite}' is not installed ({known[suite]})")
    return spec.origin


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    """Say in one line what the user did not give; a fault of the part keeps its traceback."""
    try:
        return (yield)
    except (ConfigError, InputError, MissingPartError, UsageError) as error:
        told = str(error)
    pytest.fail(told, pytrace=False)


@pytest.fixture(scope="session")
def configuration(pytestconfig: pytest.Config) -> Mapping[str, Any]:
    """Return settings by node, and ``armed``: True if a robot that may be real is armed."""
    return pytestconfig.stash[_FOUND] | {"armed": bool(pytestconfig.getoption("--arm"))}
