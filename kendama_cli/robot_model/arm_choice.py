"""Choice of the arm in a robot's tree, and of the link that holds the tool, where the user has named none."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Collection
from typing import NamedTuple

from kendama_cli.robot_model.urdf_tree import MOVING, UrdfTree, end, named

FINGER = re.compile(r"finger|thumb|jaw|claw|knuckle|phalan|pincer|pinky|index", re.IGNORECASE)
GRIPPER = re.compile(r"grip(?!.*(yaw|roll|pitch|rot|twist|wrist))", re.IGNORECASE)
HAND = re.compile(r"hand|index|pinky|little|ring_", re.IGNORECASE)
TOOLS = tuple(
    re.compile(one, re.IGNORECASE)
    for one in (
        r"tool_?0$|tool_?frame|tcp|tool_?cent",
        r"end_?eff|(^|_)eef?(_?link|_?frame)?$|grasp",
        r"gripper_?(frame|cent)|(^|_)tool|flange",
        r"hand$|palm|gripper",
    )
)
"""Names of frames that makers give to where a tool is held, the surest first."""
ASIDE = re.compile(
    FINGER.pattern
    + r"|middle|little|ring_|_ring|accelero|motor|camera|sensor|optical|depth|colou?r|imu|cover|visual|collision",
    re.I,
)
FEWEST_BEFORE, MOST_OF_FINGER, MOST_NAMED = 4, 5, 8
"""Beyond so many joints at least, three branches, or two alike, of so many joints at most are fingers, not arms; or of
the last number where their names say so."""


class Choice(NamedTuple):
    """The link that is taken for the tip, in words what was left out for it, and what is to be asked before."""

    tip_link: str
    left_out: str = ""
    doubt: str = ""


def is_free(joint: ET.Element, held: Collection[str]) -> bool:
    """Return True if ``joint`` turns at its own will."""
    return joint.get("type") in MOVING and joint.find("mimic") is None and joint.get("name") not in held


def is_stuck(joint: ET.Element, held: Collection[str]) -> bool:
    """Return True if ``joint`` moves as no joint of an arm does: it slides, floats, or mimics another."""
    return not is_free(joint, held) and joint.get("type") != "fixed" and joint.get("name") not in held


def choose_arm(tree: UrdfTree, held: Collection[str]) -> Choice:
    """Return the tip of the chain with the most turning joints, grippers and hands left out.

    Of the frames fixed behind the last joint the one is taken that is named as tools are, else the farthest. Chains
    beyond a rail are counted too where they are longer: who reads the joints says what to do about it.
    """
    chains = {link: tree.chain(link) for link in tree.links}
    hand = _hand(tree, chains, held)
    for excluded in (hand, frozenset[str]()):
        turning = {
            link: tuple(one.get("name", "") for one in chain if is_free(one, held))
            for link, chain in chains.items()
            if not any(one.get("name") in excluded for one in chain)
        }
        plain = [link for link in turning if not any(is_stuck(one, held) for one in chains[link])]
        maximum = max(len(turning[link]) for link in turning)
        reached = max((len(turning[link]) for link in plain), default=0)
        if maximum:
            break
    among = plain if reached == maximum else [link for link in turning if _ends_free(chains[link], held)]
    arms: dict[tuple[str, ...], list[str]] = {}
    for link in among:
        if len(turning[link]) == maximum:
            arms.setdefault(turning[link], []).append(link)
    tips = {joints: _tool_frame(links, chains) for joints, links in arms.items()}
    joints, tip = next(iter(tips.items()))
    if len(tips) > 1:
        listed = ", ".join(tips.values())
        return Choice(
            tip, "", f"has {len(tips)} chains of {maximum} moving joints; set robot.tip_link to one of: {listed}"
        )
    beyond = [one for one in tree.joints if one.get("name") in excluded and _hangs_on(one, arms[joints], tree)]
    if not beyond:
        return Choice(tip)
    left_out = named(beyond)
    if len(arms[joints]) == 1 or not any(pattern.search(tip) for pattern in TOOLS):  # no frame is there to hold a tool
        farther = max(chains, key=lambda link: len(chains[link]) if beyond[0] in chains[link] else 0)
        doubt = (
            f"ends in what may be a gripper ({left_out}): set robot.tip_link={tip} for an arm of {maximum} joints, or "
            f"robot.tip_link={farther} to take it along"
        )
        return Choice(tip, left_out, doubt)
    return Choice(tip, left_out)


def _ends_free(chain: list[ET.Element], held: Collection[str]) -> bool:
    """Return True if the last joint that moves is one that turns at its own will, not a finger that slides."""
    moving = [one for one in chain if is_free(one, held) or is_stuck(one, held)]
    return not moving or is_free(moving[-1], held)


def _tool_frame(links: list[str], chains: dict[str, list[ET.Element]]) -> str:
    """Return that of ``links`` on the same last joint where a tool is held."""
    kept = [link for link in links if not ASIDE.search(link)] or links
    for pattern in TOOLS:
        fitting = [link for link in kept if pattern.search(link) and len(links) > 1]
        if fitting:
            return max(fitting, key=lambda link: len(chains[link]))
    farthest = max(len(chains[link]) for link in kept)
    return [link for link in kept if len(chains[link]) == farthest][-1]


def _hangs_on(joint: ET.Element, links: list[str], tree: UrdfTree) -> bool:
    return any(end(one, "parent") in links for one in tree.chain(end(joint, "child")))


def _hand(tree: UrdfTree, chains: dict[str, list[ET.Element]], held: Collection[str]) -> frozenset[str]:
    """Return the names of revolute joints that open and close a gripper or belong to a hand's fingers.

    Told by their names, by a joint that mimics them, or by two or more short branches alike at the end of an arm.
    """
    free = [joint for joint in tree.joints if is_free(joint, held)]
    moving = [joint for joint in tree.joints if is_free(joint, held) or is_stuck(joint, held)]
    beyond = {
        joint: [one for one in moving if one is not joint and joint in chains[end(one, "child")]] for joint in free
    }
    mimicked = {str(mimic.get("joint")) for joint in tree.joints if (mimic := joint.find("mimic")) is not None}
    hand: set[str] = set()
    for joint in free:
        name, leaf = joint.get("name", ""), end(joint, "child")
        last = not beyond[joint]
        if (
            FINGER.search(name)
            or (last and (FINGER.search(leaf) or GRIPPER.search(name)))
            or (name in mimicked and not any(one in free for one in beyond[joint]))
        ):
            hand.add(name)
    for link in tree.links:  # the branches that begin at a link, or at one that is fixed to it
        before = [one for one in chains[link] if is_free(one, held)]
        if len(before) < FEWEST_BEFORE or (link in tree.parents and tree.parents[link] not in moving):
            continue
        branches = [one for one in beyond[before[-1]] if one in free and _holder(tree, one, moving) == link]
        depths = sorted(
            max(sum(one in free for one in chains[end(last, "child")]) for last in (branch, *beyond[branch]))
            - len(before)
            for branch in branches
        )
        named_so = all(HAND.search(one.get("name", "")) for one in branches)
        alike = len(depths) > 2 or (len(depths) == 2 and depths[0] == depths[1])
        if alike and depths[-1] <= (MOST_NAMED if named_so else MOST_OF_FINGER):
            hand |= {one.get("name", "") for branch in branches for one in (branch, *beyond[branch])}
    return frozenset(hand)


def _holder(tree: UrdfTree, joint: ET.Element, moving: list[ET.Element]) -> str:
    """Return the moving link that holds ``joint``, through any fixed links between."""
    link = end(joint, "parent")
    while link in tree.parents and tree.parents[link] not in moving:
        link = end(tree.parents[link], "parent")
    return link
