"""The Python interface: ``import kendama_cli as kendama``.

What is exported here by name stays what it is from one minor version to the next; anything else may move. The same
configuration, cache and store are used as by the command line.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kendama_cli.api_models import configuration, encode, play, policy, site_of, swing
from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.config.compose import composed
from kendama_cli.errors import StageError
from kendama_cli.learning.interface import Policy
from kendama_cli.learning.state import SwingState
from kendama_cli.log.reader import LogFile
from kendama_cli.motion.dmp.primitive import DmpMotion
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.finished_run import Run
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner, check_forced, check_ready
from kendama_cli.pipeline.record import begin, find_run, past_runs
from kendama_cli.pipeline.runner import Runner, Silent
from kendama_cli.pipeline.where import of_results, open_cluster, open_store
from kendama_cli.simulation.dart.hand_world import Swing
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator

if TYPE_CHECKING:
    import gymnasium

__all__ = [
    "CameraModel",
    "CatchPose",
    "CatchPoseEstimator",
    "Demonstration",
    "DmpMotion",
    "LogFile",
    "MotionPlan",
    "Policy",
    "Run",
    "Swing",
    "SwingState",
    "configuration",
    "encode",
    "environment",
    "estimator",
    "open_run",
    "play",
    "policy",
    "run",
    "runs",
    "swing",
]


def _warn(line: str) -> None:
    warnings.warn(line, stacklevel=4)


def run(
    pipeline: str = "kendama",
    overrides: Sequence[str] = (),
    *,
    until: str | None = None,
    force: Sequence[str] = (),
    arm: bool = False,
    home: Path | str | None = None,
    config_dir: Path | str | None = None,
) -> Run:
    """Run a pipeline as ``kendama run`` does: what is cached is not computed again.

    Parameters
    ----------
    pipeline : str
        A pipeline's name, or the path of its YAML file.
    overrides : sequence of str
        ``KEY=VALUE`` or ``GROUP=CHOICE`` each, as on the command line.
    until : str, optional
        Run only what this stage needs, and the stage itself.
    force : sequence of str
        Stages to run although they are cached.
    arm : bool
        Permission for stages to move real hardware.
    home, config_dir : path, optional
        Store and runs; a folder with ``conf/`` and ``pipelines/``. As the options of the command line.

    Returns
    -------
    Run

    Raises
    ------
    UsageError, ConfigError
        If a name does not exist or a value does not fit.
    StageError
        If a stage failed, with its message; finished results are stored, and ``runs()[-1]`` is the run.
    """
    site = site_of(home, config_dir)
    declared = load_pipeline(pipeline, site.pipeline_folders).until(until)
    settings = build_settings(composed(site, [*declared.overrides, *overrides]))
    planner = Planner(open_store(site.home, settings, _warn), declared, settings, site.data_roots)
    check_ready(planner, armed=arm)
    forced = check_forced(declared, list(force))
    begun = begin(site.home, pipeline, of_results(overrides))
    with open_cluster(planner.store, settings, _warn) as cluster:
        record = Runner(planner, begun, Silent(), forced=forced, cluster=cluster).run()
    for stage in record.stages:
        if stage.error is not None:
            raise StageError(f"stage '{stage.name}' of run {record.run}: {stage.error}")
    return Run(find_run(site.home, record.run), site.pipeline_folders)


def runs(home: Path | str | None = None) -> list[Run]:
    """Return all runs whose record can be read, oldest first.

    Parameters
    ----------
    home : path, optional
        The store; by default ``KENDAMA_HOME`` or ``.kendama``.

    Returns
    -------
    list of Run

    Raises
    ------
    FormatError
        If a record was written by another version of the format.
    """
    site = site_of(home, None)
    return [Run(record, site.pipeline_folders) for record in past_runs(site.home)]


def open_run(name: str | None = None, home: Path | str | None = None) -> Run:
    """Return the run of this name (a unique prefix will do), or the newest.

    Parameters
    ----------
    name : str, optional
        Name as ``kendama runs`` lists it.
    home : path, optional
        The store; by default ``KENDAMA_HOME`` or ``.kendama``.

    Returns
    -------
    Run

    Raises
    ------
    UsageError
        If there is none, or more than one.
    """
    site = site_of(home, None)
    return Run(find_run(site.home, name), site.pipeline_folders)


def environment(overrides: Sequence[str] = (), hold_s: float = 0.05) -> gymnasium.Env[Any, Any]:
    """Return the swing-up as a Gymnasium environment (needs the extra ``gym``).

    Parameters
    ----------
    overrides : sequence of str
        Overrides as on the command line: ``["simulation/engine=dart", "learn/task=easy"]``; by default on the rail.
    hold_s : float
        Duration of an action [s].

    Returns
    -------
    gymnasium.Env
        ``kendama_cli.gym.SwingUp``: cup position and velocity, ball angle and rate, time left in; one of five
        accelerations out.

    Raises
    ------
    ConfigError
        If either is not allowed.
    ImportError
        If the extra ``gym`` is not installed.
    """
    from kendama_cli.gym import SwingUp  # noqa: PLC0415 - gymnasium is an extra

    made: gymnasium.Env[Any, Any] = SwingUp(overrides, hold_s)
    return made


def estimator(rim_height_m: float, overrides: Sequence[str] = ()) -> CatchPoseEstimator:
    """Return an estimator of the position and time at which a flying ball falls through the rim's plane, from
    images or positions.

    Parameters
    ----------
    rim_height_m : float
        Height of the plane in the world [m].
    overrides : sequence of str
        Overrides of ``game`` and ``predict``: gravity, drag, and ``predict/motion=ballistic|coloured``.

    Returns
    -------
    CatchPoseEstimator
        Feed it with ``update_pixels(camera, t_s, centre_px, covariance_px2)`` or ``update_position``, ask it by
        ``catch()``.

    Raises
    ------
    ConfigError
        If an override does not fit.
    """
    chosen = configuration(overrides)
    game, predict = chosen["game"], chosen["predict"]
    drag_per_s, drag_per_m = game.drag_per_mass
    return CatchPoseEstimator(game.gravity_m_s2, drag_per_s, rim_height_m, drag_per_m=drag_per_m, motion=predict.motion)
