"""Robot descriptions: from a URDF file to the bare chain that the dynamics need, and what was read and assumed.

Neither numpy nor DART is needed: a pipeline is planned with it.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from kendama_cli.errors import InputError
from kendama_cli.robot_model.arm_choice import choose_arm, is_free, is_stuck
from kendama_cli.robot_model.limit_doubts import doubts_of
from kendama_cli.robot_model.urdf_tree import INERTIA, PRINCIPAL, UrdfTree, end, masses_of, named, number, read_tree
from kendama_cli.schema.units import count_of
from kendama_cli.settings.robot import PER_JOINT, RobotSettings

UNLIMITED_RAD = 1e3
"""A continuous joint has no position limits; this stands for them."""
LARGEST = 1e3
"""No place, angle or axis of an arm has a number beyond it, in m and rad."""
NEXT_TO_NOTHING = "1e-12"
"""Mass [kg] and moments of inertia [kg m^2] of what has none, for DART warns of zeros."""
LIMITS = {"lower_rad": "lower", "upper_rad": "upper", "velocity_rad_s": "velocity", "effort_nm": "effort"}
"""The settings that give a limit beside the file, and the file's own words for it."""
UNITS = {"lower_rad": "rad", "upper_rad": "rad", "velocity_rad_s": "rad/s", "effort_nm": "Nm"}
FRICTION = {"viscous_nm_s": "damping", "coulomb_nm": "friction"}
RESERVED = ("world", "cup", "tie", "ball", "probe")
"""Names that DART or the logs give to other things."""


@dataclass(frozen=True)
class Description:
    """A chain from the root of ``tree`` to ``tip_link``, its turning ``joints``, their ``limits`` and friction.

    ``limits`` and ``friction`` have one number per joint by the name of the setting that overrides them, ``sources``
    the place where each was found. ``massless`` links are frames. ``assumed``, ``doubtful`` and ``missing`` are
    sentences; where something is missing, the arm cannot be simulated.
    """

    tree: UrdfTree
    tip_link: str
    joints: tuple[ET.Element, ...]
    limits: Mapping[str, tuple[float, ...]]
    friction: Mapping[str, tuple[float, ...]]
    sources: Mapping[str, str]
    massless: frozenset[str]
    assumed: tuple[str, ...]
    doubtful: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def path(self) -> str:
        """The file."""
        return self.tree.path

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Return the names of the joints from base to tip."""
        return tuple(joint.get("name", "") for joint in self.joints)

    def urdf(self) -> str:
        """Return the bare chain as a URDF: links with their inertia, the arm's joints revolute, all others fixed."""
        bare = ET.Element("robot", {"name": self.tree.name})
        bare.extend(_bare_link(name, link, self.massless) for name, link in self.tree.links.items())
        for joint in self.tree.joints:
            bare.append(_bare_joint(joint, turning=joint in self.joints))
        return ET.tostring(bare, encoding="unicode")

    def lines(self) -> list[str]:
        """Return the chosen joints and tip, and the assumptions and doubts, a line each."""
        chosen = f"{count_of(len(self.joints), 'joint')} from '{self.tree.root}' to '{self.tip_link}': "
        return [chosen + named(self.joints), *self.assumed, *self.doubtful]


def dart_name(link: str) -> str:
    """Return the name of ``link`` in DART, which takes a root called 'world' as its own and drops the first joint's
    pose.
    """
    return f"{link} of the robot" if link in RESERVED else link


def read_description(robot: RobotSettings) -> Description:
    """Read the URDF of ``robot``; joints off the chain, and ``locked_joints``, are held where they are at zero.

    What is before ``base_link`` is left out; without ``tip_link`` the arm is chosen (see choose_arm). Raises InputError
    where the file cannot be used (see describe_arm) or something is missing, all of it in one line.
    """
    found = describe_arm(robot)
    if found.missing:
        raise InputError(robot.path, "; ".join(found.missing))
    return found


def read_lines(robot: RobotSettings) -> list[str]:
    """Return what a run says of its arm in the closing lines; raises InputError as read_description does."""
    first, *others = read_description(robot).lines()
    return [f"{robot.called}: {first}", *others]


def describe_arm(robot: RobotSettings) -> Description:
    """Read the URDF of ``robot`` as far as it goes; raises InputError where there is no tree or no such link in it."""
    tree = read_tree(robot.path)
    tree = tree.joined() if robot.base_link is None else tree.beyond(robot.base_link)
    for name in robot.locked_joints:
        if name not in (known := [joint.get("name", "") for joint in tree.joints]):
            remedy = f"set robot.locked_joints to some of: {', '.join(known)}"
            raise InputError(robot.path, f"has no joint '{name}'", remedy=remedy)
    tip, left_out, missing = robot.tip_link, "", list[str]()
    if tip is None:
        tip, left_out, doubt = choose_arm(tree, robot.locked_joints)
        missing += [doubt] if doubt else []
    if tip not in tree.links:
        beyond = f" beyond '{robot.base_link}'" if robot.base_link else ""
        remedy = f"set robot.tip_link to one of: {', '.join(sorted(tree.links))}"
        raise InputError(robot.path, f"has no link '{tip}'{beyond}", remedy=remedy)
    chain = tree.chain(tip)
    joints = tuple(joint for joint in chain if is_free(joint, robot.locked_joints))
    assumed = [f"left out as a gripper's: {left_out}"] if left_out else []
    massless, weightless, points = masses_of(tree, joints)
    missing = [*weightless, *missing, *_stuck(chain, robot.locked_joints), *_bad_numbers(tree)]
    if not joints and not any(is_stuck(one, robot.locked_joints) for one in chain):
        missing.append(f"has no moving joint on the way to '{tip}'; choose another robot.tip_link")
    missing += _miscounted(robot, tip, len(joints))
    limits, sources, absent = _limits(robot, joints)
    missing += absent
    if points:
        assumed.append(f"without inertia, taken as a point mass: {', '.join(points)}")
    friction = {}
    for key, word in FRICTION.items():
        own = tuple(max(number(_dynamics(joint, word)) or 0.0, 0.0) for joint in joints)
        given = getattr(robot, key)
        friction[key] = own if given is None else given
        sources[key] = f"robot.{key}" if given is not None else f"<dynamics {word}>" if any(own) else "none given"
    doubtful = doubts_of([joint.get("name", "") for joint in joints], limits, friction, sources)
    return Description(
        tree, tip, joints, limits, friction, sources, massless, tuple(assumed), tuple(doubtful), tuple(missing)
    )


def _dynamics(joint: ET.Element, word: str) -> str | None:
    element = joint.find("dynamics")
    return None if element is None else element.get(word)


def _miscounted(robot: RobotSettings, tip: str, n: int) -> list[str]:
    return [
        f"has {n} moving joints on the way to '{tip}', robot.{name} has {len(values)}; give one value per joint"
        for name in PER_JOINT
        if (values := getattr(robot, name)) is not None and len(values) != n
    ]


def _stuck(chain: list[ET.Element], held: Collection[str]) -> list[str]:
    """Return what to say of joints on the way to the tip that do not turn by themselves."""
    stuck = [joint for joint in chain if is_stuck(joint, held)]
    if not stuck:
        return []
    kinds = {
        "prismatic": "is prismatic (a rail, lift or slide)",
        "floating": "is floating (a base that moves freely)",
        "planar": "is planar (a base that drives)",
    }
    told = []
    for joint in stuck:
        kind, mimic = joint.get("type", ""), joint.find("mimic")
        unknown = f"is of type '{kind}'"
        is_so = f"mimics joint '{mimic.get('joint')}'" if mimic is not None else kinds.get(kind, unknown)
        told.append(f"joint '{joint.get('name')}' {is_so}")
    names = ",".join(joint.get("name", "") for joint in (*_of(chain, held), *stuck))
    turning = "allowed on the way to the tip: revolute, continuous, fixed"
    return [
        f"{' and '.join(told)}; {turning}; hold it where it is: robot.locked_joints=[{names}], begin after it: "
        f"robot.base_link={end(stuck[-1], 'child')}, or choose another robot.tip_link"
    ]


def _of(chain: list[ET.Element], held: Collection[str]) -> list[ET.Element]:
    """Return the joints of ``chain`` whose names are in ``held``."""
    return [joint for joint in chain if joint.get("name") in held]


def _limits(
    robot: RobotSettings, joints: tuple[ET.Element, ...]
) -> tuple[dict[str, tuple[float, ...]], dict[str, str], list[str]]:
    """Return the limits by setting, the source of each, and notes on those that neither file nor settings give."""
    limits: dict[str, tuple[float, ...]] = {}
    sources: dict[str, str] = {}
    for key, word in LIMITS.items():
        given = getattr(robot, key)
        sources[key] = f"the file's <limit {word}>" if given is None else f"robot.{key}"
        limits[key] = tuple(_of_file(joint, key) for joint in joints) if given is None else given
    missing, each = [], count_of(len(joints), "number")
    for key in ("velocity_rad_s", "effort_nm"):
        lacking = [joint for joint, value in zip(joints, limits[key], strict=False) if not value > 0]
        if lacking:
            zero = any(number(_limit(joint, LIMITS[key])) == 0 for joint in lacking)
            meant = " (0 stands for not known)" if zero else ""
            missing.append(
                f"gives no {LIMITS[key]} limit{meant} for {count_of(len(lacking), 'joint')}: {named(lacking)}; give it "
                f"beside the file: robot.{key}=[...] with {each} [{UNITS[key]}], from base to tip"
            )
    pairs = zip(joints, limits["lower_rad"], limits["upper_rad"], strict=False)
    if empty := [joint for joint, lower, upper in pairs if not lower < upper]:
        missing.append(
            f"has a lower limit that is not below its upper one for {count_of(len(empty), 'joint')}: "
            f"{named(empty)}; give both beside the file: robot.lower_rad=[...] and robot.upper_rad=[...] with {each} "
            "[rad]"
        )
    return limits, sources, missing


def _limit(joint: ET.Element, word: str) -> str | None:
    element = joint.find("limit")
    return None if element is None else element.get(word)


def _of_file(joint: ET.Element, key: str) -> float:
    """Return the limit of ``joint`` in the file; nan if there is none."""
    text = _limit(joint, LIMITS[key])
    if key in ("velocity_rad_s", "effort_nm"):
        value = number(text)
        return math.nan if value is None else value
    if joint.get("type") == "continuous":
        return UNLIMITED_RAD if key == "upper_rad" else -UNLIMITED_RAD
    try:
        value = 0.0 if text is None else float(text)  # URDF's own default
    except ValueError:
        return math.nan
    return max(min(value, UNLIMITED_RAD), -UNLIMITED_RAD)


def _bad_numbers(tree: UrdfTree) -> list[str]:
    """Return what to say of poses and axes that are not made of numbers, wherever in the tree they are."""
    wrong = []
    parts = [(f"joint '{joint.get('name')}'", joint) for joint in tree.joints]
    parts += [
        (f"link '{name}'", part) for name, link in tree.links.items() if (part := link.find("inertial")) is not None
    ]
    for where, element in parts:
        for tag, names in (("origin", ("xyz", "rpy")), ("axis", ("xyz",))):
            part = element.find(tag)
            for name in names if part is not None else ():
                text = part.get(name, "0 0 1") if part is not None else ""
                values = [number(word) for word in text.split()]
                if len(values) != 3 or not all(one is not None and abs(one) <= LARGEST for one in values):
                    wrong.append(f"{where} has <{tag} {name}='{text}'>; give 3 numbers up to {LARGEST:g}")
                elif tag == "axis" and element.get("type") in ("revolute", "continuous") and not any(values):
                    wrong.append(f"{where} has an axis without direction; give a unit vector")
    return wrong


def _bare_link(name: str, link: ET.Element, massless: Collection[str]) -> ET.Element:
    """Return the link with its inertia alone; a link without mass gets almost none, because DART's default is 1 kg."""
    bare = ET.Element("link", {"name": dart_name(name)})
    inertial = link.find("inertial")
    kept = ET.SubElement(bare, "inertial")
    inertia = dict.fromkeys(INERTIA, "0") | dict.fromkeys(PRINCIPAL, NEXT_TO_NOTHING)
    if name in massless or inertial is None:
        ET.SubElement(kept, "mass", {"value": NEXT_TO_NOTHING})
    else:
        kept.extend([part for tag in ("origin", "mass") if (part := inertial.find(tag)) is not None])
        own = inertial.find("inertia")
        if own is not None and any(number(own.get(axis)) for axis in PRINCIPAL):
            inertia = {axis: own.get(axis, "0") for axis in INERTIA}
    ET.SubElement(kept, "inertia", inertia)
    return bare


def _bare_joint(joint: ET.Element, *, turning: bool) -> ET.Element:
    """Return the joint as DART needs it; its limits come from the Description."""
    bare = ET.Element("joint", {"name": joint.get("name", ""), "type": "continuous" if turning else "fixed"})
    for side in ("parent", "child"):
        ET.SubElement(bare, side, {"link": dart_name(end(joint, side))})
    bare.extend([part for tag in ("origin", "axis") if (part := joint.find(tag)) is not None])
    return bare
