"""A scene as a URDF: what Rerun takes a robot's shapes from; Foxglove and Lichtblick can too.

One file for all that stands and moves, robot and world alike: its root is the world's frame. Masses and limits are not
in it: it is to be looked at. The format has boxes, spheres and cylinders: an ellipsoid is shown as the ball of the same
volume, and a mesh as the box round it.

Source: wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import math
from xml.sax.saxutils import quoteattr

from teleop_sim.core.views import WORLD, Frame, Quaternion, SceneTree, Solid

_JOINTS = {"fixed": "fixed", "hinge": "continuous", "slide": "prismatic", "free": "floating"}


def urdf(tree: SceneTree) -> str:
    """The text."""
    links = [_link(name, tree.solids) for name in (WORLD, *(frame.name for frame in tree.frames))]
    joints = [_joint(frame) for frame in tree.frames]
    return "\n".join((f"<robot name={quoteattr(tree.name)}>", *links, *joints, "</robot>", ""))


def _link(name: str, solids: tuple[Solid, ...]) -> str:
    seen = "".join(_visual(solid) for solid in solids if solid.frame == name)
    return f"<link name={quoteattr(name)}>{seen}</link>"


def _visual(solid: Solid) -> str:
    x, y, z = solid.size_m
    shape = {
        "box": f'<box size="{_row(x, y, z)}"/>',
        "mesh": f'<box size="{_row(x, y, z)}"/>',
        "sphere": f'<sphere radius="{_row(math.cbrt(x * y * z) / 2)}"/>',
        "cylinder": f'<cylinder radius="{_row(x / 2)}" length="{_row(z)}"/>',
    }[solid.kind]
    material = f'<material name={quoteattr(solid.name)}><color rgba="{_row(*solid.colour)}"/></material>'
    place = _origin(solid.position_m, solid.rotation)
    return f"\n<visual name={quoteattr(solid.name)}>{place}<geometry>{shape}</geometry>{material}</visual>"


def _joint(frame: Frame) -> str:
    parts = [
        f"<parent link={quoteattr(frame.parent)}/>",
        f"<child link={quoteattr(frame.name)}/>",
        _origin(frame.position_m, frame.rotation),
    ]
    if frame.kind in ("hinge", "slide"):
        parts.append(f'<axis xyz="{_row(*frame.axis)}"/>')
    if frame.kind == "slide":
        parts.append('<limit lower="-10" upper="10" effort="0" velocity="0"/>')
    name = frame.joint or f"{frame.name}.{frame.kind}"
    return f'<joint name={quoteattr(name)} type="{_JOINTS[frame.kind]}">{"".join(parts)}</joint>'


def _origin(position_m: tuple[float, float, float], rotation: Quaternion) -> str:
    return f'<origin xyz="{_row(*position_m)}" rpy="{_row(*_roll_pitch_yaw(rotation))}"/>'


def _roll_pitch_yaw(rotation: Quaternion) -> tuple[float, float, float]:
    """Turns about the fixed axes x, y, z, in that order."""
    w, x, y, z = rotation
    sine = 2 * (w * y - z * x)
    # Near straight up and down roll and yaw are one turn; a margin keeps rounding from choosing badly.
    if abs(sine) > 1.0 - 1e-9:
        return 2 * math.atan2(x, w), math.copysign(math.pi / 2, sine), 0.0
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, math.asin(sine), yaw


def _row(*values: float) -> str:
    return " ".join(f"{value:.9g}" for value in values)
