"""From the start to the console: find it, walk up to it, find its handles. States INIT to FIX_HANDLE_DETECTION."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Any, Final

from teleop_sim.robot.commands import Cloud, Detect, Look, PlanarPose, Posture, Scan, Vector
from teleop_sim.robot.commands import Step as Stride
from teleop_sim.robot.programs.claims import claim_of_fix, claim_of_glimpse
from teleop_sim.robot.programs.doing import Doing
from teleop_sim.robot.programs.places import VIEW_M, before, facing_rad, middle, stance
from teleop_sim.robot.programs.steps import Program, Show, Step
from teleop_sim.robot.sightings import ConsoleFix, ConsoleGlimpse

TILT_RAD: Final = math.radians(30.0)
"""Head down to see the handles (WPI, val_task1.cpp)."""

SWEEP_RAD: Final = (0.0, 0.6, -0.6)
"""Where the head looks in successive tries to find the console. WPI looked straight ahead only; assumed."""

SURVEY_RAD: Final = 0.3
"""Head down by so much while the console is looked for: it stands lower than the eyes (assumed)."""

PLACE_M: Final = 0.5
"""Sweeps from within this distance replace each other in the map (assumed)."""


def pre_init(doing: Doing) -> Program:
    """Starts by itself."""
    return (yield from doing.done("/GOTO_STATE_INIT", "machine started, robot stands by itself"))


def init(doing: Doing) -> Program:
    """Default posture. WPI's wait for its map is left out: the map is made of the sweeps of later states."""
    yield from doing.let_go()
    if doing.memory.facts.pop("at_console", False):
        # Begun again from the console: step back, or it is too near to be seen.
        yield from doing.do(Stride(forward_m=-0.5))
    yield from doing.do(Posture("walk"))
    yield from doing.fill(doing.pacing.posture_reset_s, "posture reset")
    return (yield from doing.done("/REGULAR", "robot in default posture, task started"))


def detect_coarse(doing: Doing) -> Program:
    """Find the console in images, refine its heading by a plane fit in one sweep, choose where to walk."""
    _take_doubt(doing)
    yield from doing.do(Look(SURVEY_RAD, SWEEP_RAD[doing.tries % len(SWEEP_RAD)], doing.pacing.head_move_s))
    yield from doing.pause(doing.pacing.head_settle_s, "head settles")
    glimpse = yield from _glimpses(doing, doing.pacing.coarse_detections)
    if glimpse is None:
        # Nothing but the doubted place may be there: the next try looks at all of it again.
        doing.memory.facts["avoid"] = ()
        return (yield from doing.retry("/DETECT_PANEL_RETRY", "console not seen"))
    fix = yield from _sweep_for(doing, middle(glimpse))
    x, y, _ = fix.pose if fix else middle(glimpse)
    goal = before(x, y, fix.pose[2] if fix else facing_rad(glimpse), VIEW_M)
    doing.memory.facts.update(glimpse=glimpse, place=goal, offered=glimpse)
    # The picture is taken as the head looks that has found it.
    here = Look(SURVEY_RAD, SWEEP_RAD[doing.tries % len(SWEEP_RAD)], doing.pacing.head_move_s)
    yield Show(claim_of_glimpse("/DETECTED_PANEL", glimpse, here, here))
    return (yield from doing.done("/DETECTED_PANEL", f"console at {_xy(middle(glimpse))}, walk to {_xy(goal)}"))


def walk_to_see(doing: Doing) -> Program:
    """Walk to the place in front of the console."""
    goal: PlanarPose | None = doing.memory.facts.get("place")
    doing.memory.facts["offered"] = None
    if goal is None:
        return (yield from doing.retry("/WALK_RETRY", "no place to walk to"))
    if (yield from doing.walk((goal,), doing.pacing.walk_start_s)):
        return (yield from doing.done("/REACHED_PANEL", f"reached the place before the console {_xy(goal)}"))
    return (yield from doing.retry("/WALK_RETRY", "stopped short of the place before the console"))


def detect_handle_centre(doing: Doing) -> Program:
    """Head down, find both wheels from near. What is not there from near was seen wrong from afar."""
    yield from doing.do(Look(TILT_RAD, 0.0, doing.pacing.tilt_move_s))
    yield from doing.fill(doing.pacing.tilt_wait_s, "head tilts")
    glimpse = yield from _glimpses(doing, 1)
    if glimpse is not None or doing.tries == 0:
        tilt = Look(TILT_RAD, 0.0, doing.pacing.tilt_move_s)
        yield Show(claim_of_glimpse("/DETECTED_HANDLE", glimpse, tilt, tilt) if glimpse is not None else None)
    if glimpse is None:
        doing.memory.facts["doubted"] = doing.memory.facts.get("glimpse")
        return (yield from doing.retry("/DETECT_HANDLE_RETRY", "wheels not seen from near"))
    doing.memory.facts.update(glimpse=glimpse, doubted=None, avoid=())
    head = yield from doing.do(Look(0.0, 0.0, doing.pacing.head_move_s))
    text = f"handles at {_xy(glimpse.yaw_wheel)} and {_xy(glimpse.pitch_wheel)}"
    return (yield from doing.done("/DETECTED_HANDLE", text, head.duration_s))


def detect_fine(doing: Doing) -> Program:
    """Fit the console in the clouds around the place seen; the last of the wanted detections counts."""
    region = _region(doing)
    fix: ConsoleFix | None = None
    if region is not None:
        for _ in range(doing.pacing.fine_detections):
            fix = yield from _sweep_for(doing, region)
            if fix is None:
                break
    if fix is None:
        doing.memory.facts["doubted"] = doing.memory.facts.get("glimpse")
        return (yield from doing.retry("/DETECT_PANEL_FINE_RETRY", "console not found in the cloud"))
    doing.memory.facts.update(fix=fix, doubted=None)
    yield Show(claim_of_fix("/DETECTED_PANEL_FINE", fix, doing, otherwise=False))
    return (
        yield from doing.done("/DETECTED_PANEL_FINE", f"console fitted at {_xy(fix.pose)}, heading {fix.pose[2]:.2f}")
    )


def walk_to_panel(doing: Doing) -> Program:
    """Walk to where the right hand reaches all of the pitch wheel."""
    fix: ConsoleFix | None = doing.memory.facts.get("fix")
    if fix is None:
        return (yield from doing.retry("/WALK_TO_PANEL_RETRY", "no console to walk to"))
    goal = stance(fix, "right", doing.stand)
    doing.memory.facts["at_console"] = True
    if (yield from doing.walk((goal,), doing.pacing.walk_start_s)):
        return (yield from doing.done("/REACHED_PANEL_FINE", f"reached the console, standing at {_xy(goal)}"))
    return (yield from doing.retry("/WALK_TO_PANEL_RETRY", "stopped short of the console"))


def fix_handles(doing: Doing) -> Program:
    """See the handles once more from where they will be grasped; if that fails, the earlier fix must do."""
    if (yield from look_again(doing)):
        yield Show(claim_of_fix("/FIXED_HANDLE", doing.memory.facts["fix"], doing))
        return (yield from doing.done("/FIXED_HANDLE", "both handles seen again from the stance"))
    return (yield from doing.retry("/FIX_RETRY", "handles not found in the cloud"))


def look_again(doing: Doing) -> Generator[Step, Any, bool]:
    """One sweep for both handles; a fix that is found replaces the one remembered."""
    region = _region(doing)
    if region is None:
        return False
    fix = yield from _sweep_for(doing, region)
    if fix is not None:
        doing.memory.facts["fix"] = fix
    return fix is not None


def sweep(doing: Doing, region: Vector | None) -> Generator[Step, Any, Cloud | None]:
    """One sweep of the LIDAR, kept for the map."""
    reply = yield from doing.do(Scan(region))
    if not isinstance(reply.data, Cloud):
        return None
    x, y, _ = reply.data.origin
    kept: dict[tuple[int, int], Cloud] = doing.memory.facts.get("clouds", {})
    doing.memory.facts["clouds"] = kept | {(round(x / PLACE_M), round(y / PLACE_M)): reply.data}
    return reply.data


def _sweep_for(doing: Doing, region: Vector) -> Generator[Step, Any, ConsoleFix | None]:
    cloud = yield from sweep(doing, region)
    reply = yield from doing.do(Detect("console", "fine", region=region, cloud=cloud))
    return reply.data if isinstance(reply.data, ConsoleFix) else None


def _glimpses(doing: Doing, wanted: int) -> Generator[Step, Any, ConsoleGlimpse | None]:
    """The last of so many coarse detections; None as soon as one fails."""
    glimpse: ConsoleGlimpse | None = None
    for _ in range(wanted):
        reply = yield from doing.do(Detect("console", "coarse", avoid=doing.memory.facts.get("avoid", ())))
        if not isinstance(reply.data, ConsoleGlimpse):
            return None
        glimpse = reply.data
    return glimpse


def _take_doubt(doing: Doing) -> None:
    """A place that did not hold the console when seen from near is not taken again."""
    for why in ("doubted", "offered"):
        # What was offered and is not walked to was rejected.
        doubted: ConsoleGlimpse | None = doing.memory.facts.pop(why, None)
        if doubted is not None:
            doing.memory.facts["avoid"] = (*doing.memory.facts.get("avoid", ()), middle(doubted))


def _region(doing: Doing) -> Vector | None:
    """About the middle of the two wheels, by the best that is known."""
    fix: ConsoleFix | None = doing.memory.facts.get("fix")
    glimpse: ConsoleGlimpse | None = doing.memory.facts.get("glimpse")
    if doing.state != "STATE_DETECT_PANEL_FINE" and fix is not None:
        return (fix.pose[0], fix.pose[1], fix.yaw_handle.centre[2])
    return middle(glimpse) if glimpse is not None else None


def _xy(place: tuple[float, ...]) -> str:
    return f"({place[0]:.2f}, {place[1]:.2f})"
