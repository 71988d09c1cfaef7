"""A field site at door and valve: what arrives as bytes is done by physics, and what came of it is told in bytes."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import simpy

from teleop_sim.channel import messages as msg
from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.core.records import EpisodeEnded, Released
from teleop_sim.core.streams import stream
from teleop_sim.field import FieldSite
from teleop_sim.field_things import Onboard, Work
from teleop_sim.machines.declare import Machine
from teleop_sim.machines.elements import Edge, State
from teleop_sim.onsite import RobotOnSite
from teleop_sim.robot.memo import Fresh
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.objects import TASKS
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose, pose_of, rotation
from teleop_sim.world.disturbances import CALM, Disturbances
from teleop_sim.world.sense_errors import Misalignment, SenseErrors

TEXT = """
schema = 1
robot = "atlas"
hand = "claw"
task = "TASK"
[operator]
policy = "collaborate"
[link.up]
rate_bps = 9600.0
delay_s = 0.0
[link.down]
rate_bps = 9600.0
delay_s = 0.0
"""


def waiting() -> Machine:
    """A machine that only waits for a person."""
    edges = (Edge("Operate", "done", "finished", 3, "done", "operator"),)
    state = State("Operate", "", decides=True, outcomes=("done",))
    return Machine("waiting", "Operate", (state,), edges, outcomes=("finished",), goals=frozenset({"finished"}))


class Desk:
    """Somebody at the other end of a perfect link, who knows where everything is."""

    def __init__(
        self,
        task: str,
        ghosts: tuple[tuple[float, float, float], ...] = (),
        seed: int = 1,
        disturbances: Disturbances = CALM,
    ) -> None:
        scenario = read_scenario(TEXT.replace("TASK", task), "a.toml", "a")
        self.task, self.env, self.records = TASKS[task], simpy.Environment(), []
        self.site = self.task.site(scenario, partial(stream, seed, 0))
        physics = Fresh()
        body = physics.body(robot_spec(scenario), self.site.scenery, disturbances)
        score = self.site.score(body.plant.joint_names)
        self.robot = RobotOnSite(self.env, body, score, seed, 0, self.records.append, physics)
        self.heard: list[msg.Message] = []
        work = Work("atlas", ghosts, Onboard(0.0, np.random.default_rng(0)))
        beat = "hash", 10.0
        self.field = FieldSite(
            self.env, self.robot, waiting(), 0, {}, 0.0, beat, self._hear, self.records.append, work=work
        )
        self.templates = StationTemplates(0.0)
        self.env.process(self.field.run())

    def _hear(self, topic: str, payload: bytes, _text: str) -> None:
        self.heard.append(msg.decode_message(topic, payload))

    def send(self, message: msg.Message) -> None:
        self.field.receive(msg.encode_message(message)[1])

    def wait(self, kind: type[msg.Message], limit_s: float = 120.0) -> msg.Message:
        """Let time pass until something of a kind has come."""
        before, until_s = self.of(kind), float(self.env.now) + limit_s
        while len(self.of(kind)) == len(before) and self.env.now < until_s:
            self.env.run(until=self.env.now + 0.1)
        return self.of(kind)[-1]

    def of(self, kind: type[msg.Message]) -> list[msg.Message]:
        return [m for m in self.heard if isinstance(m, kind)]

    def lay(self, pose: Pose) -> int:
        told = self.templates.insert(library().named(self.task.template).type_id, pose, float(self.env.now))
        self.send(told)
        return told.instance

    def step(self, instance: int, name: msg.StepName, which: int = 0) -> msg.StepDone:
        self.send(msg.TemplateStep(name, instance, "left", which))
        done = self.wait(msg.StepDone)
        assert isinstance(done, msg.StepDone)
        return done

    def affordance(self, name: str) -> int:
        return library().named(self.task.template).affordance(name).id


def true_pose(desk: Desk) -> Pose:
    thing = desk.site.scenery
    spokes = rotation((-getattr(thing, "start_rad", 0.0), 0.0, 0.0))
    return pose_of(np.array(thing.place), rotation((0.0, 0.0, thing.yaw_rad)) @ spokes)


def test_a_person_s_steps_open_the_door_and_each_is_answered_with_where_the_hand_is():
    desk = Desk("drc-door")
    at = desk.lay(true_pose(desk))
    outcomes = [desk.step(at, name).outcome for name in ("pregrasp", "grasp", "close")]
    turned = desk.step(at, "affordance", desk.affordance("turnCW"))
    pushed = desk.step(at, "affordance", desk.affordance("push"))
    assert outcomes == ["reached", "reached", "closed"]
    assert turned.amount > 0.7
    assert pushed.amount > 0.2
    assert desk.robot.checkpoint == desk.task.last_checkpoint
    assert not desk.robot.fallen
    assert len(desk.of(msg.HandPose)) == len(desk.of(msg.StepDone)) == 5
    # Where the hand was told to be when it held the lever: the lever's middle, 1 cm deeper (drc_plans), within a cm.
    lever = true_pose(desk).place(np.array([-0.05, -0.085, 0.0]))
    assert np.linalg.norm(np.array(desk.of(msg.HandPose)[2].position_m) - lever) < 0.01


def test_a_person_s_steps_turn_the_valve():
    desk = Desk("drc-valve")
    at = desk.lay(true_pose(desk))
    steps = [desk.step(at, "pregrasp"), desk.step(at, "grasp"), desk.step(at, "affordance", desk.affordance("open"))]
    assert [done.outcome for done in steps] == ["reached"] * 3
    assert steps[-1].amount > 6.0
    assert desk.robot.checkpoint == desk.task.last_checkpoint


def test_a_spurious_obstacle_stops_the_way_to_the_thing_until_the_world_model_is_reset():
    desk = Desk("drc-door")
    handle = true_pose(desk).place(np.array([-0.22, -0.085, 0.0]))
    desk = Desk("drc-door", ghosts=(tuple(float(v) for v in handle),))
    at = desk.lay(true_pose(desk))
    assert desk.step(at, "pregrasp").outcome == "no_plan"
    desk.send(msg.ResetWorld())
    assert desk.step(at, "pregrasp").outcome == "reached"


def test_steps_that_cannot_be_are_refused_and_leave_the_robot_alone():
    desk = Desk("drc-door")
    desk.send(msg.TemplateStep("pregrasp", 7, "left", 0))
    assert desk.of(msg.StepDone)[-1] == msg.StepDone("pregrasp", "refused", 0.0)
    at = desk.lay(true_pose(desk))
    desk.send(msg.TemplateStep("pregrasp", at, "left", 0))
    desk.env.run(until=desk.env.now + 0.5)
    desk.send(msg.TemplateStep("grasp", at, "left", 0))
    assert desk.of(msg.StepDone)[-1] == msg.StepDone("grasp", "refused", 0.0)
    desk.wait(msg.StepDone)
    assert [r.skill for r in desk.records if isinstance(r, EpisodeEnded)] == ["pregrasp"]
    assert [r.note for r in desk.records if isinstance(r, Released)][:1] == ["no such template lies here"]


def test_a_cloud_shows_the_region_that_was_asked_for_and_waits_for_a_movement_to_end():
    desk = Desk("drc-door")
    at, thing = desk.lay(true_pose(desk)), desk.site.scenery
    desk.send(msg.TemplateStep("pregrasp", at, "left", 0))
    desk.env.run(until=desk.env.now + 1.0)
    desk.send(msg.AskCloud(20, thing.place, 0.4))
    cloud = desk.wait(msg.VoxelCloud)
    episodes = [r for r in desk.records if isinstance(r, EpisodeEnded)]
    assert [r.skill for r in episodes] == ["pregrasp", "scan"]
    assert episodes[1].start_s >= episodes[0].t_s
    assert isinstance(cloud, msg.VoxelCloud)
    away = np.linalg.norm(cloud.centres_m() - np.array(thing.place), axis=1)
    # A voxel's middle is at most half its diagonal, 1.7 cm, from a point in it.
    assert len(away) > 100
    assert away.max() < 0.42


@pytest.mark.parametrize("shift_m", [(0.0, 0.0, 0.0), (0.0, 0.03, 0.04)])
def test_a_cloud_of_the_place_brings_one_of_the_hand_as_far_off_as_the_sensor_is(shift_m):
    desk = Desk("drc-door", disturbances=Disturbances(senses=SenseErrors(lidar=Misalignment(shift_m=shift_m))))
    at, thing = desk.lay(true_pose(desk)), desk.site.scenery
    desk.send(msg.AskCloud(20, (5.0, 0.0, 1.0), 0.4))
    desk.wait(msg.VoxelCloud)
    assert not desk.of(msg.HandCloud)
    desk.step(at, "pregrasp")
    desk.send(msg.AskCloud(20, thing.place, 0.6))
    desk.wait(msg.VoxelCloud)
    kinds = [type(m) for m in desk.heard]
    # Together, and before the cloud that somebody waits for.
    assert kinds[kinds.index(msg.HandCloud) + 1] is msg.VoxelCloud
    (hand,) = desk.of(msg.HandCloud)
    assert (hand.side, hand.voxels.voxel_mm) == ("left", 20)
    assert len(hand.voxels.centres_m()) > 40
    # Atlas' head is level. Four times the 2.3 mm that were measured in each direction.
    assert hand.offset_m() == pytest.approx(tuple(-v for v in shift_m), abs=4 * 0.0023)
    tool = np.array(desk.of(msg.HandPose)[-1].position_m)
    # A hand's middle is within a hand of its tool.
    assert np.linalg.norm(np.array(hand.expected_m) - tool) < 0.13


def test_a_stop_during_an_order_ends_it_and_another_can_follow():
    desk = Desk("drc-door")
    at = desk.lay(true_pose(desk))
    desk.send(msg.TemplateStep("pregrasp", at, "left", 0))
    desk.env.run(until=desk.env.now + 1.0)
    desk.send(msg.StopAll())
    assert desk.wait(msg.StepDone).outcome == "stopped"
    assert desk.step(at, "pregrasp").outcome == "reached"


def test_the_hand_goes_where_a_person_leads_it():
    desk = Desk("drc-door")
    at = desk.lay(true_pose(desk))
    desk.step(at, "pregrasp")
    now = desk.of(msg.HandPose)[-1]
    x, y, z = now.position_m
    desk.send(msg.CartesianTarget("left", (x - 0.05, y + 0.03, z), now.rotation_rad))
    led = desk.wait(msg.HandPose)
    # 1 cm: what a standing robot's arm under its servos' load leaves (docs/physics.md).
    assert led.position_m == pytest.approx((x - 0.05, y + 0.03, z), abs=0.01)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_requests_to_the_robot_s_computers_are_lost_at_their_rate(share):
    onboard = Onboard(share, np.random.default_rng(5))
    answered = sum(onboard.answers() for _ in range(2000))
    # Four standard deviations of a binomial.
    assert abs(answered - 2000 * (1 - share)) <= 4 * (2000 * share * (1 - share)) ** 0.5
