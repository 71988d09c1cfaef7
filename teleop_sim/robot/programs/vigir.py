"""What every state of ViGIR's door and valve machines does, by FlexBE class.

The machines are ``machines/drc.py``'s. A class is a program; what a state is asked comes with its visit: the keys that
it reads, its parameters, its path. See ``vigir_arms``, ``vigir_walks`` and ``vigir_sums``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from teleop_sim.robot.drc_plans import drc_stand
from teleop_sim.robot.programs import vigir_arms as arms
from teleop_sim.robot.programs import vigir_sums as sums
from teleop_sim.robot.programs import vigir_walks as walks
from teleop_sim.robot.programs.pacing import Pacing
from teleop_sim.robot.programs.steps import ProgramOf
from teleop_sim.robot.programs.vigir_visit import Body, program_of

BODIES: Mapping[str, Body] = MappingProxyType(
    {
        "CalculationState": sums.calculate,
        "ChangeControlModeActionState": walks.change_mode,
        "CheckCurrentControlModeState": walks.check_mode,
        "CreateStepGoalState": walks.step_goal,
        "DecisionState": sums.decide,
        "ExecuteStepPlanActionState": walks.walk,
        "ExecuteTrajectoryMsgState": arms.execute,
        "FingerConfigurationState": arms.move_fingers,
        "FlexibleCalculationState": sums.calculate_of_many,
        "FootstepPlanRelativeState": walks.plan_relative,
        "GetPoseInFrameState": walks.pose_in_frame,
        "GetTemplateAffordanceState": arms.get_affordance,
        "GetTemplateGraspState": arms.get_pose("grasp", "grasp"),
        "GetTemplatePregraspState": arms.get_pose("pregrasp", "pre_grasp"),
        "GetTemplateStandPoseState": walks.get_stand,
        "InputState": walks.ask,
        "LogState": walks.log,
        "LookAtTargetState": walks.look_at,
        "MoveitPredefinedPoseState": arms.posture,
        "PlanAffordanceState": arms.plan_affordance,
        "PlanEndeffectorCartesianWaypointsState": arms.plan_line,
        "PlanEndeffectorPoseState": arms.plan_pose,
        "PlanFootstepsState": walks.plan_steps,
        "TiltHeadState": walks.tilt,
    }
)
"""By FlexBE class, as the machines name their programs."""


def vigir_programs(_pacing: Pacing, robot: str) -> dict[str, ProgramOf]:
    """The programs of a door or valve machine, for a robot by name; these wait for nothing but plans and modes.

    Raises:
        UnknownName: nobody has found out where that robot stands there.

    """
    drc_stand(robot)
    return {name: program_of(body, robot) for name, body in BODIES.items()}
