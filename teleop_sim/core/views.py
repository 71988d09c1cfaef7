"""What people look at beside the records: the scene in 3D, pictures, clouds, lines. A report never needs one.

Views are handed to a ``Show``, as records are to an ``Emit``. They exist so that others' viewers (Foxglove, Lichtblick,
Rerun) can show a run: a log without them says as much. Frames are right-handed, z up; ``WORLD`` is the records' frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

WORLD = "world"
"""Name of the frame that does not move."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""w, x, y, z."""

Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity, each 0 to 1."""

NO_TURN: Quaternion = (1.0, 0.0, 0.0, 0.0)
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame that hangs on another one.

    Its pose in its parent is ``position_m``, ``rotation``, then the joint's motion. A ``hinge`` turns by
    ``value - zero`` [rad] about ``axis`` through ``anchor_m``; a ``slide`` moves by it [m] along ``axis``; what is
    ``fixed`` stays. The one frame that is ``free`` is the robot's root, whose pose is ``PlantSample.pelvis``.

    Attributes:
        name, parent: of the frames. joint: whose value moves it, in ``SceneTree.joints``; empty: none.
        axis, anchor_m: in this frame. zero: value at which there is no motion.

    """

    name: str
    parent: str
    position_m: Vector = ORIGIN
    rotation: Quaternion = NO_TURN
    kind: Literal["fixed", "hinge", "slide", "free"] = "fixed"
    joint: str = ""
    axis: Vector = (0.0, 0.0, 1.0)
    anchor_m: Vector = ORIGIN
    zero: float = 0.0


@dataclass(frozen=True, slots=True)
class Solid:
    """A shape that moves with a frame.

    Attributes:
        frame: its name. name: of the shape, once in a scene.
        kind: ``box``, ``sphere`` (an ellipsoid), ``cylinder`` (along z), or ``mesh``.
        position_m, rotation: of its middle in the frame.
        size_m: from end to end along its own axes [m]; of a mesh, of the box round it.
        points_m, faces: of a mesh: corners in its own axes, and three corners a triangle.

    """

    frame: str
    name: str
    kind: Literal["box", "sphere", "cylinder", "mesh"]
    position_m: Vector
    rotation: Quaternion
    size_m: Vector
    colour: Colour
    points_m: tuple[Vector, ...] = ()
    faces: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class SceneTree:
    """All that stands and moves in a run; shown once, before the first ``PlantSample``.

    Attributes:
        t_s: simulated time. name: of the whole.
        frames: parents before children. solids: what is to be seen of them.
        joints: names of the columns of ``PlantSample.joints``.

    """

    t_s: float
    name: str
    frames: tuple[Frame, ...]
    solids: tuple[Solid, ...]
    joints: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Lens:
    """How a frame sees: a pinhole whose axes are right, down, forward; square pixels, middle in the middle."""

    t_s: float
    frame: str
    width_px: int
    height_px: int
    focal_px: float


@dataclass(frozen=True, slots=True)
class CameraPicture:
    """A picture that has arrived at the control station, as coded. ``media``: ``jpeg``, ``webp`` or ``png``."""

    t_s: float
    frame: str
    media: str
    data: bytes


@dataclass(frozen=True, slots=True)
class CloudShown:
    """A cloud that has arrived at the control station: its points in ``frame``, x, y, z in turn, as float32."""

    t_s: float
    frame: str
    points: bytes


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line for people. ``name``: who says it."""

    t_s: float
    level: Literal["info", "warning", "error"]
    name: str
    text: str


View = SceneTree | Lens | CameraPicture | CloudShown | LogLine
"""Whatever can be shown."""

Show = Callable[[View], None]
"""Where a part of the simulator puts what people may look at."""
