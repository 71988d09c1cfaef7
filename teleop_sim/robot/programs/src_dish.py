"""What every state of the dish machine does: WPI's 18 states as programs.

Order, waits and fallbacks follow val_task1.cpp of WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7. Where this
robot does otherwise, the function says so. Not offered: the jump to checkpoint 3, which a scorer on site would make.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from teleop_sim.robot.programs import console_programs as console
from teleop_sim.robot.programs import finish_programs as finish
from teleop_sim.robot.programs import handle_programs as handles
from teleop_sim.robot.programs.doing import Doing, program_of
from teleop_sim.robot.programs.handle_programs import PITCH, YAW, Body
from teleop_sim.robot.programs.pacing import Pacing
from teleop_sim.robot.programs.steps import Program, ProgramOf
from teleop_sim.robot.templates import crank_stand


def skip_to_cp3(doing: Doing) -> Program:
    """Nobody here can lift the robot to the next checkpoint."""
    yield from doing.say("skipping to checkpoint 3 is not offered here")
    return "/SKIP_CP3_FAILED"


BODIES: Mapping[str, Body] = MappingProxyType(
    {
        "STATE_PRE_INIT": console.pre_init,
        "STATE_INIT": console.init,
        "STATE_DETECT_PANEL_COARSE": console.detect_coarse,
        "STATE_WALK_TO_SEE_PANEL": console.walk_to_see,
        "STATE_DETECT_HANDLE_CENTER": console.detect_handle_centre,
        "STATE_DETECT_PANEL_FINE": console.detect_fine,
        "STATE_WALK_TO_PANEL": console.walk_to_panel,
        "STATE_FIX_HANDLE_DETECTION": console.fix_handles,
        "STATE_GRASP_PITCH_HANDLE": handles.grasp(PITCH),
        "STATE_CORRECT_PITCH": handles.correct(PITCH),
        "STATE_GRASP_YAW_HANDLE": handles.grasp(YAW),
        "STATE_CORRECT_YAW": handles.correct(YAW),
        "STATE_REDETECT_HANDLE": handles.redetect,
        "STATE_DETECT_FINISH": finish.detect_finish,
        "STATE_WALK_TO_FINISH": finish.walk_to_finish,
        "STATE_SKIP_TO_CP3": skip_to_cp3,
    }
)
"""By state; STATE_END and STATE_ERROR do nothing."""


def dish_programs(pacing: Pacing, robot: str = "valkyrie") -> dict[str, ProgramOf]:
    """The programs of the dish task, by state, with the given waits, for a robot by name.

    Raises:
        UnknownName: nobody has found out where that robot stands at a crank.

    """
    stand = crank_stand(robot)
    return {state: program_of(state, body, pacing, stand) for state, body in BODIES.items()}
