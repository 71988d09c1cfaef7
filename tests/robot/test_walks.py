"""Every robot walks, stops and turns; the arithmetic of disturbances; and what it cannot do, it is seen not to do."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from teleop_sim.robot import law
from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Command, Step, Stop, Walk
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.gait import body_between, wrap
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skill import Tick
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.disturbances import CALM, PATCH_HEIGHT_M, Disturbances, Payload, Plate, Push, believed, burdened
from teleop_sim.world.plant import Plant

KEY = NoiseKey(1, 0, 1)
NAMES = sorted(ROBOTS)
# Little enough for every hand: THORMANG3's motors hold no more.
LOAD_KG = {"atlas": 3.0, "valkyrie": 3.0, "thormang3": 1.0}
BACK_M = {"atlas": 0.25, "valkyrie": 0.25, "thormang3": 0.25}


class Watched(Body):
    """A body that notes where its weight is, and how hard its joints work."""

    def __init__(self, robot: str, what: Disturbances = CALM, friction: float = 0.8) -> None:
        spec = ROBOTS[robot]()
        super().__init__(spec, Plant(spec.model, BareFloor(friction), disturbances=what))
        model = self.plant.model
        self._floors = {g for g in range(model.ngeom) if model.geom_bodyid[g] == 0}
        self.share = 0.0
        self.outside_m = -math.inf
        self.beyond_rad = -math.inf
        self.own: set[tuple[str, str]] = set()
        self._range = np.array([model.joint(n).range for n in self.joint_names])

    def tick(self, reference: Tick) -> bool:
        upright = super().tick(reference)
        model, data = self.plant.model, self.plant.data
        nu = self.plant.nv_robot - 6
        self.share = max(
            self.share, float((np.abs(data.actuator_force[:nu]) / model.actuator_forcerange[:nu, 1]).max())
        )
        q = self.q()
        self.beyond_rad = max(self.beyond_rad, float(np.maximum(self._range[:, 0] - q, q - self._range[:, 1]).max()))
        if upright:
            self.outside_m = max(self.outside_m, self._zmp_outside())
            self.own |= {pair for pair in self.plant.contacts() if not {"floor", "plate0"} & set(pair)}
        return upright

    def _zmp_outside(self) -> float:
        """How far the measured centre of pressure is outside the convex hull of the soles; negative inside."""
        model, data = self.plant.model, self.plant.data
        force, total, moment = np.zeros(6), 0.0, np.zeros(2)
        for i in range(data.ncon):
            contact = data.contact[i]
            if not self._floors & {int(contact.geom[0]), int(contact.geom[1])}:
                continue
            mujoco.mj_contactForce(model, data, i, force)
            total += force[0]
            moment += force[0] * contact.pos[:2]
        if total < 1.0:
            return -math.inf
        half = np.array(self.spec.model.description.sole.size_m)[:2] / 2
        corners = []
        for sole in self.soles():
            for sx in (-1, 1):
                for sy in (-1, 1):
                    corners.append((sole.position + sole.rotation @ [sx * half[0], sy * half[1], 0.0])[:2])
        return hull_distance(moment / total, np.array(corners))


def hull_distance(point: np.ndarray, corners: np.ndarray) -> float:
    """Largest signed distance of a point outside a convex hull, over directions a degree apart (error below 0.1 mm)."""
    a = np.arange(0.0, 2 * np.pi, np.pi / 180)
    along = np.stack([np.cos(a), np.sin(a)])
    return float((point @ along - (corners @ along).max(0)).max())


def did(robot: str, command: Command, what: Disturbances = CALM, friction: float = 0.8) -> tuple[Watched, Episode]:
    body = Watched(robot, what, friction)
    return body, perform(body, command, body.standing(), KEY)


@pytest.mark.parametrize("name", NAMES)
def test_a_walk_arrives_with_its_weight_over_its_soles_and_its_joints_within_limits(name):
    goal = (0.9, 0.2, 0.4)
    body, episode = did(name, Walk((goal,)))
    assert episode.outcome == "reached"
    x, y, yaw = body_between(body.feet())
    assert math.hypot(x - goal[0], y - goal[1]) < 0.05
    assert abs(wrap(yaw - goal[2])) < math.radians(3)
    # Contacts are soft: soles sink in by half a millimetre, so does the edge of what carries.
    assert body.outside_m < 1e-3
    assert body.share <= 1.0 + 1e-9
    # MuJoCo's joint limits are as soft as its contacts.
    assert body.beyond_rad < 0.01
    assert body.own == set()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("move", [{"left_m": 0.2}, {"forward_m": -0.25}, {"turn_rad": math.pi / 2}], ids=str)
def test_small_moves(name, move):
    body, episode = did(name, Step(**move))
    assert episode.outcome == "reached"
    x, y, yaw = body_between(body.feet())
    assert x == pytest.approx(move.get("forward_m", 0.0), abs=0.02)
    assert y == pytest.approx(move.get("left_m", 0.0), abs=0.02)
    # Soles slip in turns: a step by itself is not put right.
    assert yaw == pytest.approx(move.get("turn_rad", 0.0), abs=0.05)
    assert body.own == set()


@pytest.mark.parametrize("name", NAMES)
def test_a_stop_in_mid_walk_stands_at_once(name):
    body = Watched(name)
    cut = perform(body, Walk(((1.5, 0.0, 0.0),)), body.standing(), KEY, until_s=3.3)
    stopped = perform(body, Stop(), cut.end, KEY)
    assert stopped.outcome == "stopped"
    # The swing under way (0.7 s), then 3 s to rest at most.
    assert stopped.duration_s < 4.5
    assert math.hypot(*np.subtract(body_between(body.feet())[:2], cut.samples.pelvis[-1][:2])) < 0.35


@pytest.mark.parametrize("name", NAMES)
def test_a_load_on_the_trunk_that_it_does_not_know_is_carried(name):
    load = Payload(ROBOTS[name]().model.trunk, LOAD_KG[name], (0.2, 0.0, 0.2))
    _, episode = did(name, Walk(((0.5, 0.0, 0.0),)), Disturbances(payload=load))
    assert episode.outcome == "reached"


def test_a_fall_is_told_as_a_fall_with_its_cause():
    slip = Plate(0.8, 0.0, 0.0, 0.6, 0.6, PATCH_HEIGHT_M, 0.02)
    body, episode = did("valkyrie", Walk(((2.0, 0.0, 0.0),)), Disturbances(plates=(slip,)))
    assert (episode.outcome, body.has_fallen()) == ("fell", True)
    assert "slid" in episode.cause
    push = Push(2.0, 0.2, (0.0, 900.0, 0.0))
    body, episode = did("atlas", Walk(((1.0, 0.0, 0.0),)), Disturbances(pushes=(push,)))
    assert (episode.outcome, body.has_fallen()) == ("fell", True)
    assert episode.end.fallen


# Disturbances ------------------------------------------------------------------------------------------------------


def test_a_belief_that_is_right_changes_nothing_but_rounding():
    calm = did("valkyrie", Walk(((0.4, 0.0, 0.0),)))[1]
    # A hair's breadth of mass: the law reads its own model instead of the plant's.
    other = did("valkyrie", Walk(((0.4, 0.0, 0.0),)), Disturbances(mass_factor=1.0 + 1e-12))[1]
    assert other.samples.joints == pytest.approx(calm.samples.joints, abs=1e-4)


def test_what_is_believed_differs_from_what_is():
    model = ROBOTS["atlas"]().model
    load = Payload("l_hand", 3.0, (0.0, -0.2, 0.0))
    what = Disturbances(payload=load, mass_factor=1.1, com_error_m=(0.01, 0.0, 0.0), strength={"l_leg_kny": 0.5})
    true, thought = burdened(model, what), believed(model, what)
    built = model.description
    for link in built.links:
        extra = 3.0 if link.name == "l_hand" else 0.0
        assert true.description.link(link.name).mass_kg == pytest.approx(1.1 * link.mass_kg + extra)
        assert thought.description.link(link.name) == link
    assert true.description.link("utorso").com_m[0] == pytest.approx(built.link("utorso").com_m[0] + 0.01)
    assert true.description.joint("l_leg_kny").effort_nm == pytest.approx(0.5 * built.joint("l_leg_kny").effort_nm)
    known = believed(model, replace(what, payload=replace(load, known=True)))
    assert known.description.link("l_hand").mass_kg == pytest.approx(built.link("l_hand").mass_kg + 3.0)


def test_a_push_gives_the_momentum_of_its_force_and_time():
    # In the air nothing else acts sideways: p = F t.
    spec = ROBOTS["thormang3"]()
    plant = Plant(spec.model, BareFloor(), disturbances=Disturbances(pushes=(Push(0.1, 0.2, (20.0, 0.0, 0.0)),)))
    plant.data.qpos[2] += 5.0
    for _ in range(30):
        plant.begin_tick()
        plant.end_tick()
    mujoco.mj_subtreeVel(plant.model, plant.data)
    # Ten ticks of 20 ms, each of five steps.
    assert plant.data.subtree_linvel[1][0] * plant.model.body_subtreemass[1] == pytest.approx(4.0, rel=1e-3)


def test_a_late_feel_is_part_of_the_state():
    body = Watched("valkyrie", Disturbances(delay_s=0.04))
    whole = perform(body, Walk(((0.3, 0.0, 0.0),)), body.standing(), KEY)
    assert whole.outcome == "reached"
    cut = perform(body, Walk(((0.3, 0.0, 0.0),)), body.standing(), KEY, until_s=2.0)
    first, again = (perform(body, Stop(), cut.end, KEY) for _ in (0, 1))
    assert first.end == again.end
    assert cut.end.felt


def test_pushes_count_motion_not_the_clock():
    what = Disturbances(pushes=(Push(1.0, 0.2, (0.0, 50.0, 0.0)),))
    body = Watched("valkyrie", what)
    early = perform(body, Step(forward_m=0.2), body.standing(), KEY)
    late = perform(body, Step(forward_m=0.2), body.standing(), KEY, start_s=500.0)
    assert early.end == late.end
    again = perform(body, Step(forward_m=0.2), early.end, KEY)
    assert again.end.plant.ticks == early.end.plant.ticks


@pytest.mark.parametrize("name", NAMES)
def test_the_law_never_asks_for_a_centre_of_pressure_off_the_soles(name):
    body = Watched(name)
    body.load(body.standing())
    body.tick(Tick(body.posture))
    x, y = body._memory[law.COP], body._memory[law.COP + 1]
    soles = np.array([s.position[:2] for s in body.soles()])
    reach = np.hypot(*np.array(body.spec.model.description.sole.size_m)[:2]) / 2
    assert np.hypot(*(soles - [x, y]).T).min() < reach + np.hypot(*(soles[0] - soles[1])) / 2
