"""Masses and moments of inertia of a URDF's links: frames that need none, and bodies that do."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from kendama_cli.robot_model.urdf_tree import UrdfTree, end, number

PRINCIPAL = ("ixx", "iyy", "izz")
INERTIA = (*PRINCIPAL, "ixy", "ixz", "iyz")
FRAMES = 1
"""Bodies without mass that may follow another: three joints at one place."""
TOLD_KG = 1e-3
"""A lighter link without inertia is not worth a word."""


def masses_of(tree: UrdfTree, joints: tuple[ET.Element, ...]) -> tuple[frozenset[str], list[str], list[str]]:
    """Return links without mass, what is said of bodies that need one, and links with mass but without inertia.

    A body is a link that a joint of the arm moves, with all that is fixed to it. One without mass is a frame if nothing
    of it is drawn and one of the next bodies has mass: makers put two or three joints at one place so.
    """
    massless, wrong, points = set[str](), list[str](), list[str]()
    bodies: dict[str, float] = {end(joint, "child"): 0.0 for joint in joints}
    drawn: dict[str, bool] = dict.fromkeys(bodies, False)
    for name, link in tree.links.items():
        inertial = link.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        text = None if mass is None else mass.get("value")
        kg = 0.0 if text is None else number(text)
        moved = [end(joint, "child") for joint in tree.chain(name) if joint in joints]
        if kg is None or kg < 0:
            if moved:
                wrong.append(f"link '{name}' has the mass '{text}'; it must be a positive number [kg]")
            kg = 0.0
        if kg == 0:
            massless.add(name)
        if moved:
            bodies[moved[-1]] += kg
            principal, negative = _principal(inertial)
            drawn[moved[-1]] |= any(principal) or any(link.find(tag) is not None for tag in ("visual", "collision"))
            if kg > 0 and negative:
                wrong.append(f"link '{name}' has {negative}; a moment of inertia is a number, and not negative")
            elif kg > TOLD_KG and not any(principal):
                points.append(f"'{name}'")
    order = list(bodies)
    light = [body for body in order if bodies[body] == 0]
    if any(
        drawn[one] or not any(bodies[body] for body in order[order.index(one) + 1 :][: FRAMES + 1]) for one in light
    ):
        listed = ", ".join(f"'{body}'" for body in light)
        reason = f"has no mass in the link{'s' if len(light) > 1 else ''} {listed}"
        wrong.insert(0, f"{reason}: no setting can give it; write their <inertial>, or choose another URDF")
    return frozenset(massless), wrong, points


def _principal(inertial: ET.Element | None) -> tuple[list[float], str]:
    """Return the moments of inertia about the three axes, and the first that is negative or not a number, in words."""
    inertia = None if inertial is None else inertial.find("inertia")
    texts = {name: "0" if inertia is None else inertia.get(name, "0") for name in INERTIA}
    values = {name: number(text) for name, text in texts.items()}
    bad = [f"{name}='{texts[name]}'" for name, value in values.items() if value is None]
    bad += [f"{name}='{texts[name]}'" for name in PRINCIPAL if (values[name] or 0.0) < 0]
    return [values[name] or 0.0 for name in PRINCIPAL], bad[0] if bad else ""
