"""Reason why the chosen motion does not catch: its miss, the cause, and the setting to change."""

from __future__ import annotations

from kendama_cli.adaptation.catch_search import MIN_APEX_M
from kendama_cli.adaptation.search_record import Bounds, Search
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.adaptation.trial import Attempt

TORQUE_SPENT = 0.999
"""A joint whose torque reached this fraction of its limit did not follow as it should."""


def obstacle(chosen: Attempt, settings: AdaptSettings, bounds: Bounds, limiting_joint: str, torque: str | None) -> str:
    """Return one line: the miss of the ``chosen`` motion, its cause, and which setting to change.

    ``limiting_joint`` is the arm's limit that forbids a faster motion, ``torque`` the joint whose torque was spent in
    its rollout, if any.
    """
    return f"{_how_near(chosen)}: {_cause(chosen, settings, bounds, limiting_joint, torque)}"


def policy_obstacle(chosen: Attempt, search: Search) -> str:
    """Return one line: the miss of the motion ``chosen`` by a search for the shape, and which setting to change."""
    played = sum(one.limit is None for one in search.attempts)
    if played == 0:
        return f"every motion that was tried is forbidden by {search.attempts[-1].limit}: lower adapt.policy.spread_m"
    return (
        f"{_how_near(chosen)}: {played} rollouts did not lead to a policy that lasts: raise adapt.policy.max_rollouts, "
        "or change adapt.policy.spread_m"
    )


def _how_near(nearest: Attempt) -> str:
    variation = nearest.variation
    at = f"at tau_scale {variation.tau_scale:.4g}"
    if variation.amplitude != 1.0:
        at += f" and amplitude {variation.amplitude:g}"
    if nearest.signed_miss_m is None:
        return (
            f"the ball never came down through the rim's plane; {at} it rose to {1e3 * nearest.apex_m:.0f} mm over it"
        )
    return f"nearest miss {1e3 * nearest.distance_m:.0f} mm {at}"


def _cause(nearest: Attempt, settings: AdaptSettings, bounds: Bounds, limiting_joint: str, torque: str | None) -> str:
    tau, (low, high) = nearest.variation.tau_scale, settings.tau_range
    lowest = bounds.lowest_tau(nearest.variation.amplitude)
    miss_m, side_m = abs(nearest.signed_miss_m or 0.0), abs(nearest.side_miss_m or 0.0)
    causes = (
        (nearest.limit is not None, f"it is forbidden by {nearest.limit}"),
        (torque is not None, f"{torque} has no more torque to give: place the arm otherwise (adapt.placement)"),
        (
            nearest.distance_m < bounds.mouth_m,
            "the ball came down into the cup and jumped out again: lower game.cup.restitution or deepen the cup",
        ),
        (
            side_m > max(bounds.mouth_m, miss_m),
            f"it comes down {1e3 * side_m:.0f} mm beside the swing plane, whatever tau is: raise adapt.max_shift_m",
        ),
        (
            lowest > low and tau - lowest < settings.tau_step,
            f"a faster motion is forbidden by {limiting_joint}: place the arm otherwise (adapt.placement)",
        ),
        (
            tau - low < settings.tau_step,
            f"a faster motion is forbidden by adapt.tau_range, which begins at {low:g}: lower it",
        ),
        (
            high - tau < settings.tau_step,
            f"a slower motion is forbidden by adapt.tau_range, which ends at {high:g}: raise it",
        ),
        (
            nearest.apex_m < MIN_APEX_M,
            "the swing is too weak for the rope: widen adapt.amplitudes or shorten game.rope.length_m",
        ),
    )
    named = (cause for holds, cause in causes if holds)
    return next(named, "no tau within the range does better: raise adapt.max_shift_m or widen adapt.amplitudes")
