"""The part of the Python interface that needs no run to be made: settings, motions, swings, and policies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, find_site
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.primitive import DmpMotion
from kendama_cli.motion.dmp.primitive import play as play_plan
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings

if TYPE_CHECKING:
    from kendama_cli.learning.interface import Policy
    from kendama_cli.pipeline.finished_run import Run
    from kendama_cli.simulation.dart.hand_world import Swing


def configuration(overrides: Sequence[str] = (), config_dir: Path | str | None = None) -> Mapping[str, Any]:
    """Return the checked settings of every node of the configuration: frozen dataclasses by the node's name, and
    ``seed``.

    Parameters
    ----------
    overrides : sequence of str
        ``KEY=VALUE`` or ``GROUP=CHOICE`` each, as on the command line.
    config_dir : path, optional
        A folder with ``conf/``.

    Returns
    -------
    mapping of str to settings
        ``configuration()["game"].rope.length_m`` and so on; units stand in the names.

    Raises
    ------
    ConfigError
        If a key does not exist or its value does not fit; the message names it.
    """
    return build_settings(composed(site_of(None, config_dir), list(overrides)))


def encode(demonstrations: Sequence[Demonstration], overrides: Sequence[str] = ()) -> MotionPlan:
    """Return the average dynamic movement primitive of demonstrations (equations.md eq. 3-5).

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        Each with ``t_s`` (n,) [s] and ``position_m`` (n, 3) [m]; x lies in the swing plane, z points up.
    overrides : sequence of str
        Overrides of the node ``encode``, as in ``["encode.functions=25"]``.

    Returns
    -------
    MotionPlan
        Goal, duration and weights of every coordinate.

    Raises
    ------
    ValueError
        If a demonstration does not move or is too short.
    ConfigError
        If an override does not fit.
    """
    config = composed(site_of(None, None), list(overrides))
    settings = build_settings({node: config[node] for node in ("seed", "encode")})  # all others take longer
    return encode_demonstrations(demonstrations, settings["encode"])


def play(plan: MotionPlan, t_s: Any) -> DmpMotion:
    """Play a primitive: return its motion at the times ``t_s`` (n,) [s] after its start.

    Parameters
    ----------
    plan : MotionPlan
        ``dataclasses.replace(plan, tau_scale=1.1)`` plays it ten per cent slower.
    t_s : array_like, shape (n,)
        In any order; after ``tau_scale * duration_s`` the motion stays on its goal.

    Returns
    -------
    DmpMotion
        ``position_m``, ``velocity_m_s`` and ``acceleration_m_s2``, each (n, coordinates).
    """
    return play_plan(plan, t_s)


def policy(run: Run, stage: str = "learn") -> Policy:
    """Return the policy that a run learned, to act by.

    Parameters
    ----------
    run : Run
        A run with a stage that gives a policy.
    stage : str
        That stage.

    Returns
    -------
    Policy
        ``begin_rollout()`` first, then ``act(SwingState(x_m, velocity_m_s, angle_rad, rate_rad_s), t_s)`` gives the
        cup's acceleration [m/s^2].

    Raises
    ------
    UsageError, StoreError
        If the run has no such stage, or its artifact is damaged or gone.
    StageError
        If it is not a policy that can be used.
    """
    from kendama_cli.learning.learners import make_policy  # noqa: PLC0415 - the learners' compiled code
    from kendama_cli.learning.verification import verify_policy  # noqa: PLC0415

    site = site_of(None, None)
    declared = load_pipeline(run.pipeline, (*run.pipeline_folders, *site.pipeline_folders))
    settings = build_settings(composed(site, [*declared.overrides, *run.overrides]))["learn"]
    artifact = run.artifact(stage)
    verify_policy(artifact, settings, f"run {run.name}")
    return make_policy(artifact, settings)


def swing(
    t_s: Any,
    cup_m: Any,
    overrides: Sequence[str] = (),
    *,
    rope_m: float | None = None,
    aside_m: float = 0.0,
    after_s: float = 1.0,
) -> Swing:
    """Simulate the ball while an upright cup is moved along a path, in DART and without an arm.

    Parameters
    ----------
    t_s : array_like, shape (n,)
        Rising instants [s].
    cup_m : array_like, shape (n, 3)
        The rope's tie point under the cup then [m]; x lies in the swing plane, z points up.
    overrides : sequence of str
        Overrides of the node ``game``, as in ``["game/air=linear"]``.
    rope_m : float, optional
        The rope's length [m]; by default ``game.rope.length_m``.
    aside_m : float
        Displacement of the ball along x from rest at the start [m].
    after_s : float
        Duration of the cup's rest at the end of the path [s].

    Returns
    -------
    Swing
        Cup and ball every millisecond, whether the ball was caught, and how far it missed.

    Raises
    ------
    ValueError
        If the path is not finite, its shapes do not fit, or its times do not rise.
    ConfigError
        If an override does not fit.
    SimulationError
        If the ball is flung away.
    """
    from kendama_cli.simulation.dart.hand_world import carry_cup  # noqa: PLC0415 - the simulator

    times, path = np.asarray(t_s, dtype=np.float64), np.asarray(cup_m, dtype=np.float64)
    if times.ndim != 1 or len(times) < 2 or path.shape != (len(times), 3):
        raise ValueError(f"t_s has shape {times.shape} and cup_m {path.shape}; allowed: (n,) and (n, 3), n from 2")
    if not (np.isfinite(path).all() and np.all(np.diff(times) > 0)):
        raise ValueError("the path has to be finite, and its times have to rise")
    game = configuration(overrides)["game"]
    return carry_cup(game, times, path, rope_m=rope_m, aside_m=aside_m, after_s=after_s)


def site_of(home: Path | str | None, config_dir: Path | str | None) -> Site:
    """Return the folders that ``home`` and ``config_dir``, or the environment, name."""
    return find_site(None if home is None else Path(home), None if config_dir is None else Path(config_dir))
