"""Skills by command. A new skill is one file and one line here."""

from __future__ import annotations

from teleop_sim.robot.commands import (
    Act,
    Carry,
    Cartesian,
    Detect,
    Fingers,
    Follow,
    Grasp,
    Grip,
    Insert,
    Joints,
    LetGo,
    Look,
    Nudge,
    Pick,
    Place,
    Posture,
    PreGrasp,
    Reach,
    Release,
    Retreat,
    Scan,
    Step,
    Stop,
    Take,
    Walk,
)
from teleop_sim.robot.skill import Skill
from teleop_sim.robot.skills.act import act
from teleop_sim.robot.skills.carry import carry
from teleop_sim.robot.skills.cartesian import cartesian
from teleop_sim.robot.skills.fingers import fingers
from teleop_sim.robot.skills.follow import follow
from teleop_sim.robot.skills.grasp_in import grasp, retreat
from teleop_sim.robot.skills.grip import grip
from teleop_sim.robot.skills.insert import insert
from teleop_sim.robot.skills.joints import joints
from teleop_sim.robot.skills.let_go import let_go
from teleop_sim.robot.skills.nudge import nudge
from teleop_sim.robot.skills.pick import pick
from teleop_sim.robot.skills.place import place
from teleop_sim.robot.skills.posing import look, posture
from teleop_sim.robot.skills.pre_grasp import pre_grasp
from teleop_sim.robot.skills.reach import reach
from teleop_sim.robot.skills.release import release
from teleop_sim.robot.skills.sensing import detect, scan
from teleop_sim.robot.skills.take import take
from teleop_sim.robot.skills.walking import step, stop, walk

SKILLS: dict[type, Skill] = {
    Act: act,
    Carry: carry,
    Cartesian: cartesian,
    Detect: detect,
    Fingers: fingers,
    Follow: follow,
    Grasp: grasp,
    Grip: grip,
    Insert: insert,
    Joints: joints,
    LetGo: let_go,
    Look: look,
    Nudge: nudge,
    Pick: pick,
    Place: place,
    Posture: posture,
    PreGrasp: pre_grasp,
    Reach: reach,
    Release: release,
    Retreat: retreat,
    Scan: scan,
    Step: step,
    Stop: stop,
    Take: take,
    Walk: walk,
}
