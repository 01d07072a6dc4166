"""The rope as a chain of links with mass: its state between two steps, and its compiled step."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rope import RopeLaw
from kendama_cli.physics.rope_chain import cup_sections_m, laid, link_lengths_m, node_masses_kg
from kendama_cli.robot_model.arm_motion import SAMPLE_S as STEP_S
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.rope_kernel import HEIGHT, PIVOT, REACTION, TENSION, air, pull
from kendama_cli.system.compiled import NONE, READ, READ_2D, WRITE, WRITE_2D, Array, boolean, compiled_as, float64

NODE, NODE_SPEED, NODE_KG, NODE_M = 0, 3, 6, 7
"""Columns of a chain's nodes: place, velocity, mass, and the length of the link that ends there."""
CHAIN_STEPS, CHAIN_PERIOD, CHAIN_GRAVITY, CHAIN_SLACK, CHAIN_CARRIED, CHAIN_BEGUN, CHAIN_TIE, CHAIN_OVER, CHAIN_BALL = (
    0, 1, 2, 3, 4, 5, 6, 9, 12,
)  # fmt: skip
"""Offsets in a chain's numbers (15,): sub-steps, the world's step, gravity, the pull below which the rope
counts as slack, whether the cup's speeds are those of the coming step, whether there was a step before, the speeds of
tie and axis in it (3), and the ball's that should have come of it (3)."""
LINK_N_M, LINK_S = 2e6, 1e-4
"""A link that does not stretch: 1 um under 2 N; what it was stretched is lost within the time."""
CONTACT_N_M, CONTACT_S = 1e5, 2e-4
"""The cup's surface under a node of the chain: 20 um under 2 N; a node comes out within the time."""
ROUNDED_M = 0.0005
"""Radius of the cup's edges under a chain with mass."""
MOST_ADDED = 12


@compiled_as(NONE(float64, float64, READ_2D, WRITE))
def _depth(out: float, up: float, solid: Array, at: Array) -> None:
    """Compute the depth of a point ``out`` from the cup's axis, ``up`` over the tie, and the way out, into ``at``.

    ``at`` (3,) are the depth, negative outside, and the normal's parts away from the axis and along it. ``solid``
    (k, 4) are the boxes, minimum and maximum of both, that turned about the axis make the cup; their corners are round.
    """
    at[0] = -1.0
    for k in range(solid.shape[0]):
        x, z = out - 0.5 * (solid[k, 0] + solid[k, 1]), up - 0.5 * (solid[k, 2] + solid[k, 3])
        a = abs(x) - 0.5 * (solid[k, 1] - solid[k, 0]) + ROUNDED_M
        b = abs(z) - 0.5 * (solid[k, 3] - solid[k, 2]) + ROUNDED_M
        if a > 0.0 and b > 0.0:
            far = math.sqrt(a * a + b * b)
            depth, nx, nz = ROUNDED_M - far, a / far, b / far
        elif a > b:
            depth, nx, nz = ROUNDED_M - a, 1.0, 0.0
        else:
            depth, nx, nz = ROUNDED_M - b, 0.0, 1.0
        if depth > at[0]:
            at[0], at[1], at[2] = depth, math.copysign(nx, x), math.copysign(nz, z)


@compiled_as(NONE(READ, READ, READ, WRITE))
def _tensions(  # noqa: PLR0912
    diagonal: Array, beside: Array, wanted: Array, pull: Array
) -> None:
    """Solve for the ``pull`` >= 0 of every link with  A pull >= desired, equal where it pulls; A is tridiagonal.

    Links that would shorten by themselves do not push. ``beside`` are the terms beside the diagonal of A, which are not
    positive in a chain that is not folded: then links are only ever added to those that pull (R. Chandrasekaran, A
    special case of the complementary pivot problem, Opsearch 7, 1970).
    """
    n = diagonal.size
    pulls = wanted > 0.0
    lower, side = np.empty(n), np.empty(n)
    for _ in range(MOST_ADDED):
        for i in range(n):
            lower[i], side[i] = diagonal[i], wanted[i]
            if i > 0 and pulls[i] and pulls[i - 1]:
                fraction = beside[i - 1] / lower[i - 1]
                lower[i] -= fraction * beside[i - 1]
                side[i] -= fraction * side[i - 1]
        for i in range(n - 1, -1, -1):
            if not pulls[i]:
                pull[i] = 0.0
            elif i + 1 < n and pulls[i + 1]:
                pull[i] = (side[i] - beside[i] * pull[i + 1]) / lower[i]
            else:
                pull[i] = side[i] / lower[i]
        added = False
        for i in range(n):
            if not pulls[i]:
                left = wanted[i]
                if i > 0:
                    left -= beside[i - 1] * pull[i - 1]
                if i + 1 < n:
                    left -= beside[i] * pull[i + 1]
                if left > 0.0:
                    pulls[i] = added = True
        if not added:
            break
    for i in range(n):
        pull[i] = max(pull[i], 0.0)


@compiled_as(boolean(READ, READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, WRITE, WRITE, WRITE))
def pull_chain(  # noqa: PLR0912, PLR0915, PLR0917
    ball_m: Array,
    ball_m_s: Array,
    tie_m: Array,
    tie_m_s: Array,
    up_m: Array,
    up_m_s: Array,
    rope: Array,
    nodes: Array,
    solid: Array,
    chain: Array,
    pulled: Array,
    force: Array,
) -> bool:
    """Return ``pull``, or with ``nodes`` (n + 1, 8) that of a chain with mass, which moves on by a step.

    The nodes are point masses, the first at the tie and the last the ball's centre; columns are NODE, NODE_SPEED, the
    mass, and the length of the link from the node before. Links do not push; the last one is the rope's spring and
    damper, the others hardly stretch. The links' forces f at the end of a sub-step of h seconds solve

        (f_i - k_i e_i) / (k_i h + c_i) = u_i - h sum_j B_ij f_j   where f_i > 0

    with e_i how far a link is stretched, u_i how fast it would grow without the links' forces, and B tridiagonal, by
    the nodes' masses and by how far the cup's surface, stiff and without friction, lets them move. The cup goes on as
    it accelerated in the last step, where it is not carried. ``chain`` holds CHAIN_STEPS and the other numbers of the
    chain, and what it remembers. Forces are means over the step, that on the ball so that DART moves it to where it has
    come here. False where the ball has gone far away.
    """
    near = pull(ball_m, ball_m_s, tie_m, tie_m_s, up_m, up_m_s, rope, pulled, force)
    if not near or nodes.shape[0] == 0:
        return near
    stiffness_n_m, damping_n_s_m, k1, k2, high = rope[1], rope[2], rope[10], rope[11], rope[HEIGHT]
    n, steps, period = nodes.shape[0] - 1, int(chain[CHAIN_STEPS]), chain[CHAIN_PERIOD]
    h, gravity = period / steps, chain[CHAIN_GRAVITY]
    stretched = pulled[TENSION] > 0.0
    air(ball_m_s, k1, k2, force)
    speed, axis, axis_rate, mean_n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    begun = chain[CHAIN_BEGUN] > 0.0
    for r in range(3):
        speed[r], over = tie_m_s[r], up_m_s[r]
        if begun and chain[CHAIN_CARRIED] == 0.0:  # DART moves bodies by the speeds of the step's end
            speed[r] += tie_m_s[r] - chain[CHAIN_TIE + r]
            over += up_m_s[r] - chain[CHAIN_OVER + r]
        chain[CHAIN_TIE + r], chain[CHAIN_OVER + r] = tie_m_s[r], up_m_s[r]
        axis[r], axis_rate[r] = (up_m[r] - tie_m[r]) / high, (over - speed[r]) / high
        nodes[0, NODE + r], nodes[0, NODE_SPEED + r] = tie_m[r], speed[r]
        nodes[n, NODE + r] = ball_m[r]
        # what else than rope, air and weight has changed the ball's speed since, as a contact does
        nodes[n, NODE_SPEED + r] = (
            nodes[n, NODE_SPEED + r] + ball_m_s[r] - chain[CHAIN_BALL + r] if begun else ball_m_s[r]
        )
        mean_n[r] = pulled[REACTION + r] = 0.0
    chain[CHAIN_BEGUN] = 1.0
    free, normal, held, along = np.empty((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros(n + 1), np.zeros((n + 1, 3))
    diagonal, beside, desired, pull_n = np.empty(n), np.zeros(n), np.empty(n), np.zeros(n)
    at, moment, vector = np.empty(3), np.zeros(3), np.empty(3)
    reach = 0.0
    for k in range(solid.shape[0]):
        reach = max(reach, solid[k, 1], solid[k, 3])
    for r in range(3):
        free[0, r] = speed[r]
    stiff = CONTACT_N_M * h * (h + CONTACT_S)
    for _ in range(steps):
        for i in range(1, n + 1):
            mass = nodes[i, NODE_KG]
            held[i] = 0.0
            for r in range(3):
                free[i, r] = nodes[i, NODE_SPEED + r]
            free[i, 2] -= h * gravity
            if i == n:
                for r in range(3):
                    free[i, r] += h * force[r] / mass
                break
            up = gap = 0.0
            for r in range(3):
                vector[r] = nodes[i, NODE + r] - nodes[0, NODE + r]
                up += vector[r] * axis[r]
                gap += vector[r] * vector[r]
            if gap > 4.0 * reach * reach or not -ROUNDED_M < up < reach + ROUNDED_M:
                continue
            out = math.sqrt(max(gap - up * up, 0.0))
            _depth(out, up, solid, at)
            if at[0] <= 0.0:
                continue
            turned = 0.0
            for r in range(3):
                lateral = (vector[r] - up * axis[r]) / out if out > 1e-9 else 0.0
                normal[i, r] = at[1] * lateral + at[2] * axis[r]
                turned += vector[r] * axis_rate[r]
            coming = leaving = 0.0
            for r in range(3):
                leaving += normal[i, r] * (speed[r] + up * axis_rate[r] - turned * axis[r])
                coming += normal[i, r] * free[i, r]
            held[i] = stiff / (mass + stiff)
            pushed = (h * CONTACT_N_M * at[0] + stiff * leaving) / (mass + stiff) - held[i] * coming
            for r in range(3):
                free[i, r] += pushed * normal[i, r]
                pulled[REACTION + r] -= mass * pushed * normal[i, r] / period
            moment[0] -= mass * pushed / period * (vector[1] * normal[i, 2] - vector[2] * normal[i, 1])
            moment[1] -= mass * pushed / period * (vector[2] * normal[i, 0] - vector[0] * normal[i, 2])
            moment[2] -= mass * pushed / period * (vector[0] * normal[i, 1] - vector[1] * normal[i, 0])
        for i in range(1, n + 1):
            size = 0.0
            for r in range(3):
                along[i, r] = nodes[i, NODE + r] - nodes[i - 1, NODE + r]
                size += along[i, r] * along[i, r]
            size = math.sqrt(size)
            growth = 0.0
            for r in range(3):
                along[i, r] /= max(size, 1e-9)
                growth += along[i, r] * (free[i, r] - free[i - 1, r])
            spring, damper = (stiffness_n_m, damping_n_s_m) if i == n else (LINK_N_M, LINK_N_M * LINK_S)
            ease = 1.0 / (spring * h + damper)
            desired[i - 1] = growth + spring * ease * (size - nodes[i, NODE_M])
            diagonal[i - 1] = ease
        for i in range(1, n + 1):  # what node i adds: to its own link and the next
            mass = nodes[i, NODE_KG]
            own = nxt = both = 0.0
            for r in range(3):
                own += along[i, r] * normal[i, r]
                if i < n:
                    nxt += along[i + 1, r] * normal[i, r]
                    both += along[i, r] * along[i + 1, r]
            diagonal[i - 1] += h * (1.0 - held[i] * own * own) / mass
            if i < n:
                diagonal[i] += h * (1.0 - held[i] * nxt * nxt) / mass
                beside[i - 1] = -h * (both - held[i] * own * nxt) / mass
        _tensions(diagonal, beside, desired, pull_n)
        for i in range(1, n + 1):
            mass, across = nodes[i, NODE_KG], 0.0
            for r in range(3):
                vector[r] = -pull_n[i - 1] * along[i, r] + (pull_n[i] * along[i + 1, r] if i < n else 0.0)
                across += vector[r] * normal[i, r]
            across *= held[i]
            for r in range(3):
                pushed = across * normal[i, r]
                nodes[i, NODE_SPEED + r] = free[i, r] + h / mass * (vector[r] - pushed)
                vector[r] = nodes[i, NODE + r] - nodes[0, NODE + r]
                nodes[i, NODE + r] += h * nodes[i, NODE_SPEED + r]
            if across != 0.0:  # the cup holds so much of the links' forces
                fraction = across * h / period
                for r in range(3):
                    pulled[REACTION + r] += fraction * normal[i, r]
                moment[0] += fraction * (vector[1] * normal[i, 2] - vector[2] * normal[i, 1])
                moment[1] += fraction * (vector[2] * normal[i, 0] - vector[0] * normal[i, 2])
                moment[2] += fraction * (vector[0] * normal[i, 1] - vector[1] * normal[i, 0])
        for r in range(3):
            mean_n[r] -= pull_n[n - 1] * along[n, r] * h / period
            pulled[REACTION + r] += pull_n[0] * along[1, r] * h / period
            nodes[0, NODE + r] += h * speed[r]
            axis[r] += h * axis_rate[r]
    size = square = 0.0
    for r in range(3):
        size += mean_n[r] * mean_n[r]
        square += pulled[REACTION + r] * pulled[REACTION + r]
        # the force with which DART moves the ball to where it has come here
        chain[CHAIN_BALL + r] = (nodes[n, NODE + r] - ball_m[r]) / period
        given = nodes[n, NODE_KG] * ((chain[CHAIN_BALL + r] - ball_m_s[r]) / period + (gravity if r == 2 else 0.0))
        pulled[r], force[r] = given - force[r], given
    # a loose end tugs at the ball too
    pulled[TENSION] = math.sqrt(size) if stretched and size > chain[CHAIN_SLACK] * chain[CHAIN_SLACK] else 0.0
    vector[0] = pulled[REACTION + 1] * moment[2] - pulled[REACTION + 2] * moment[1]
    vector[1] = pulled[REACTION + 2] * moment[0] - pulled[REACTION] * moment[2]
    vector[2] = pulled[REACTION] * moment[1] - pulled[REACTION + 1] * moment[0]
    far = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    fraction = 0.0 if square < 1e-12 else 1.0 / max(square, far / (2.0 * reach))
    for r in range(3):
        pulled[PIVOT + r] = tie_m[r] + fraction * vector[r]
    return True


LINKS = 24
SUB_STEPS, THEIR_KG = 50, 5e-5
"""Sub-steps of a step of the world for a chain of this mass or more; a lighter one swings faster across itself."""
SLACK_WEIGHTS = 3.0
"""A chain whose end pulls with less than so many times its weight counts as slack."""
NUMBERS = 15


class NoChain:
    """A rope without mass."""

    rope_kg = end_kg = 0.0
    arrays = np.empty((0, 8)), np.empty((0, 4)), np.zeros(NUMBERS)

    def lay(self, tie: tuple[Array, Array], ball: tuple[Array, Array], axis: Array) -> None:
        """Do nothing: there is nothing to lay."""


NO_CHAIN = NoChain()


class RopeChain(NoChain):
    """A chain of LINKS links of ``rope_kg`` in all, as long as the rope of ``law``, to a ball of ``ball_kg``.

    The cup is ``carried`` where its speeds are those of the coming step. ``end_kg`` is what of the chain moves with the
    ball; ``arrays`` are nodes, cup and numbers as pull_chain takes them.
    """

    def __init__(self, game: GameSettings, law: RopeLaw, rope_kg: float, ball_kg: float, *, carried: bool) -> None:
        if law.cup.side_m > 0.0:
            raise ConfigError(
                "game.cup.tie.kind",
                "'game.cup.tie.kind' is side: a rope with mass is tied on the cup's axis; choose "
                "hardware.imperfection.rope_kg=null, or game/cup=floor or handle",
            )
        self._profile, self.rope_kg = law.cup, rope_kg
        self._lengths_m = link_lengths_m(law.length_m, law.cup.used_m, LINKS)
        nodes, numbers = np.zeros((LINKS + 1, 8)), np.zeros(NUMBERS)
        nodes[:, NODE_KG] = node_masses_kg(rope_kg, self._lengths_m)
        nodes[1:, NODE_M] = self._lengths_m
        self.end_kg = float(nodes[-1, NODE_KG])
        nodes[-1, NODE_KG] += ball_kg
        numbers[CHAIN_STEPS] = math.ceil(SUB_STEPS * math.sqrt(max(1.0, THEIR_KG / rope_kg)))
        numbers[CHAIN_PERIOD] = STEP_S
        numbers[CHAIN_GRAVITY] = game.gravity_m_s2
        numbers[CHAIN_CARRIED] = carried
        numbers[CHAIN_SLACK] = SLACK_WEIGHTS * rope_kg * game.gravity_m_s2
        self.arrays = nodes, cup_sections_m(game.cup), numbers

    def lay(self, tie: tuple[Array, Array], ball: tuple[Array, Array], axis: Array) -> None:
        """Lay it the shortest way from ``tie`` to ``ball``, positions and velocities (3,), round the cup."""
        nodes, _, numbers = self.arrays
        (tie_m, tie_m_s), (ball_m, ball_m_s) = tie, ball
        nodes[:, NODE:NODE_SPEED] = tie_m + laid(self._profile, self._lengths_m, ball_m - tie_m, axis)
        fraction = np.append(0.0, np.cumsum(self._lengths_m) / sum(self._lengths_m))[:, None]
        nodes[:, NODE_SPEED:NODE_KG] = (1.0 - fraction) * tie_m_s + fraction * ball_m_s
        numbers[CHAIN_BEGUN] = 0.0
