"""A memo answers as a fresh computation would, for the same question only, within its memory."""

import math
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from teleop_sim.core.errors import BadInput
from teleop_sim.core.streams import stream
from teleop_sim.robot.atlas import atlas
from teleop_sim.robot.body import Body, RobotState
from teleop_sim.robot.commands import Cloud, Command, Detect, Look, Posture, Scan, Step, Stop, Walk
from teleop_sim.robot.drc_plans import DRC_STANDS
from teleop_sim.robot.episode import Episode, NoiseKey, perform
from teleop_sim.robot.memo import BODIES, Memo, Sight, size_bytes
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.robot.skills.sensing import picture
from teleop_sim.robot.valkyrie import valkyrie
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.objects import TASKS
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.digest import plant_digest
from teleop_sim.world.disturbances import Disturbances, Push
from teleop_sim.world.plant import Plant

KEY = NoiseKey(1, 0, 1)
SHORT = Look(0.3, 0.0, 0.4)
WALK = Walk(((0.3, 0.0, 0.0),))


@pytest.fixture(scope="module")
def body() -> Body:
    return Memo().body(valkyrie(), BareFloor())


def same(a: object, b: object) -> bool:
    """Whether two values are equal bit for bit, arrays included."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if is_dataclass(a) and type(a) is type(b):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return type(a) is type(b) and a == b


def looked(memo: Memo, body: Body, state: RobotState | None = None, command: Command = SHORT, **how: object) -> Episode:
    return memo.perform(body, command, state or body.standing(), how.pop("key", KEY), **how)


@pytest.mark.parametrize("command", [SHORT, WALK, Scan((1.0, 0.0, 0.8)), Stop(), Posture("walk", 0.5)], ids=repr)
@pytest.mark.parametrize("until_s", [math.inf, 0.7])
def test_what_is_remembered_equals_what_is_computed(body, command, until_s):
    memo = Memo()
    fresh = perform(body, command, body.standing(), KEY, until_s=until_s)
    first = looked(memo, body, command=command, until_s=until_s)
    perform(body, Step(turn_rad=0.2), body.standing(), KEY, until_s=1.0)
    again = looked(memo, body, command=command, until_s=until_s, start_s=1234.56)
    assert same(fresh, first)
    assert same(fresh, again)
    assert (memo.tally().episodes_found, memo.tally().episodes_made) == (1, 1)
    assert memo.tally().spared_s == again.physics_s


@pytest.mark.parametrize("start_s", [1e-9, 0.1, 777.777, 1e6])
def test_the_time_of_the_start_has_no_effect(body, start_s):
    assert same(perform(body, WALK, body.standing(), KEY, start_s=start_s), perform(body, WALK, body.standing(), KEY))


def test_each_part_of_the_question_counts(body):
    memo = Memo()
    stand = body.standing()
    values = np.frombuffer(stand.plant.physics).copy()
    values[-1] = np.nextafter(values[-1], 1.0)
    nudged = replace(stand, plant=replace(stand.plant, physics=values.tobytes()))
    questions = [
        {},
        {"command": Look(0.3, 0.0, math.nextafter(0.4, 1.0))},
        {"command": Look(0.3, -0.0, 0.4)},
        {"key": NoiseKey(2, 0, 1)},
        {"key": NoiseKey(1, 1, 1)},
        {"key": NoiseKey(1, 0, 2)},
        {"until_s": 0.1},
        {"until_s": 0.12},
        {"state": nudged},
        {"state": replace(stand, jaws=(0.0, 0.1))},
        {"state": replace(stand, plant=replace(stand.plant, ticks=1))},
    ]
    for question in questions:
        looked(memo, body, **question)
    assert (memo.tally().episodes_found, memo.tally().entries) == (0, len(questions))
    for question in questions:
        looked(memo, body, **question)
    assert memo.tally().episodes_found == len(questions)


def test_a_cut_episode_is_no_whole_one_and_a_whole_one_no_cut_one(body):
    memo = Memo()
    whole, cut = looked(memo, body, command=WALK), looked(memo, body, command=WALK, until_s=1.0)
    assert (whole.outcome, cut.outcome) == ("reached", "cut")
    assert same(looked(memo, body, command=WALK, until_s=1.0), cut)
    assert same(looked(memo, body, command=WALK), whole)


WORLDS = {
    "friction": lambda: Plant(valkyrie().model, BareFloor(0.81)),
    "step": lambda: Plant(valkyrie().model, BareFloor(), timestep_s=0.002),
    "robot": lambda: Plant(atlas().model, BareFloor()),
    "mass": lambda: Plant(valkyrie().model, BareFloor(), disturbances=Disturbances(mass_factor=1.001)),
    # These are not in the compiled model.
    "push": lambda: Plant(
        valkyrie().model, BareFloor(), disturbances=Disturbances(pushes=(Push(1.0, 0.2, (1.0, 0.0, 0.0)),))
    ),
    "delay": lambda: Plant(valkyrie().model, BareFloor(), disturbances=Disturbances(delay_s=0.02)),
}


def test_another_world_is_another_question(body):
    digests = {plant_digest(make()) for make in WORLDS.values()} | {plant_digest(body.plant)}
    assert len(digests) == len(WORLDS) + 1
    assert plant_digest(Plant(valkyrie().model, BareFloor())) == plant_digest(body.plant)


def test_another_controller_is_another_question(body):
    memo, spec = Memo(), valkyrie()
    looked(memo, body)
    other = Body(replace(spec, gait=replace(spec.gait, stride_m=0.29)), Plant(spec.model, BareFloor()))
    assert plant_digest(other.plant) == plant_digest(body.plant)
    looked(memo, other)
    assert memo.tally().episodes_found == 0


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("task", TASKS)
def test_every_robot_in_every_task_has_a_digest(robot, task):
    direction = "rate_bps = 380.0\ndelay_s = 0.0"
    text = f"schema = 1\n[link.up]\n{direction}\n[link.down]\n{direction}\n"
    hand = {"hand": "claw", "operator.policy": "collaborate"} if task.startswith("drc-") else {}
    chosen = {"task": task, "robot": robot, **hand}
    if hand and robot not in DRC_STANDS:
        with pytest.raises(BadInput, match="no place to stand"):
            read_scenario(text, "a.toml", "a", chosen)
        return
    scenario = read_scenario(text, "a.toml", "a", chosen)

    def digest(seed: int) -> bytes:
        site = TASKS[task].site(scenario, lambda name: stream(seed, 0, name))
        return plant_digest(Plant(robot_spec(scenario).model, site.scenery))

    assert digest(1) == digest(1) != digest(2)


def test_bodies_are_shared_within_bounds_and_start_with_a_stopped_watch():
    memo, spec = Memo(), valkyrie()
    first = memo.body(spec, BareFloor(0.5))
    first.plant.stopwatch = lambda: 1.0
    first.plant.stepping_s = 3.0
    assert memo.body(valkyrie(), BareFloor(0.5)) is first
    assert (first.plant.stopwatch, first.plant.stepping_s) == (None, 0.0)
    for k in range(BODIES):
        assert memo.body(spec, BareFloor(0.6 + k / 10)) is not first
    assert memo.body(spec, BareFloor(0.5)) is not first
    assert (memo.tally().bodies_found, memo.tally().bodies_made) == (1, BODIES + 2)


def test_the_least_recently_used_goes_first_and_the_limit_holds(body):
    keys = [NoiseKey(1, 0, k) for k in range(4)]
    one = looked(Memo(), body)
    limit = 3 * size_bytes(replace(one, command=Stop())) + 100
    memo = Memo(limit)
    for k in (0, 1, 2, 0, 3):
        looked(memo, body, key=keys[k])
        assert memo.tally().used_bytes <= limit
    assert (memo.tally().entries, memo.tally().evicted, memo.tally().episodes_found) == (3, 1, 1)
    for k in (0, 2, 3):
        looked(memo, body, key=keys[k])
    assert memo.tally().episodes_found == 4
    looked(memo, body, key=keys[1])
    assert (memo.tally().episodes_found, memo.tally().evicted, memo.tally().entries) == (4, 2, 3)


def test_nothing_is_kept_without_memory_nor_what_is_larger_than_it(body):
    for limit in (0, 1000):
        memo = Memo(limit)
        first, again = looked(memo, body), looked(memo, body)
        assert same(first, again)
        assert (memo.tally().entries, memo.tally().used_bytes, memo.tally().evicted) == (0, 0, 0)
        assert memo.tally().episodes_made == 2


def test_what_is_remembered_cannot_be_changed(body):
    memo = Memo()
    episode = looked(memo, body)
    scan = looked(memo, body, command=Scan())
    for array in (episode.samples.pelvis, episode.samples.joints, episode.samples.t_s, scan.data.points):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0.0


def test_the_size_is_that_of_the_arrays_with_what_they_keep_alive(body):
    scan = perform(body, Scan(), body.standing(), KEY)
    assert size_bytes(scan) > scan.data.points.nbytes + len(scan.end.plant.physics)
    assert size_bytes(np.zeros(1000)[:3]) >= 8000
    # Everything but the arrays is small.
    assert size_bytes(scan) < scan.data.points.nbytes + 40_000


def test_a_cloud_is_asked_about_by_its_points_not_by_its_identity(body):
    memo = Memo()
    points = np.random.default_rng(1).normal(size=(50, 3))
    detect = Detect("console", "fine", (1.0, 0.0, 0.8), Cloud(points, (0.0, 0.0, 1.6)))
    equal = replace(detect, cloud=Cloud(points.copy(), (0.0, 0.0, 1.6)))
    moved = replace(detect, cloud=Cloud(points + 1e-12, (0.0, 0.0, 1.6)))
    elsewhere = replace(detect, cloud=Cloud(points, (0.0, 0.0, 1.7)))
    for command in (detect, equal, moved, elsewhere, replace(detect, cloud=None), equal):
        assert looked(memo, body, command=command).command is command
    assert (memo.tally().episodes_found, memo.tally().episodes_made) == (2, 4)


def seen(body: Body, rng: np.random.Generator) -> np.ndarray:
    return picture(body, rng)


def test_a_look_is_remembered_by_state_stream_and_options(body):
    memo, stand = Memo(), body.standing()
    ahead = Sight("camera.1", seen, (320,))
    first = memo.look(body, stand, ahead, 1, 0, 0.0)
    moved = looked(memo, body, command=Look(0.5, 0.0, 0.4)).end
    questions = [
        (moved, ahead, 1, 0),
        (stand, replace(ahead, name="camera.2"), 1, 0),
        (stand, replace(ahead, options=(1,)), 1, 0),
        (stand, ahead, 2, 0),
        (stand, ahead, 1, 1),
    ]
    for state, sight, seed, replicate in questions:
        memo.look(body, state, sight, seed, replicate, 5.0)
    assert (memo.tally().looks_found, memo.tally().looks_made) == (0, 6)
    again = memo.look(body, stand, ahead, 1, 0, 9.0)
    assert same(first, again)
    assert memo.tally().looks_found == 1
    with pytest.raises(TypeError, match="fingerprint"):
        memo.look(body, stand, Sight("x", lambda *_: 0), 1, 0, 0.0)


def test_the_tally_reads_as_a_line(body):
    memo = Memo(2**20)
    looked(memo, body)
    looked(memo, body)
    assert str(memo.tally()) == "1 of 2 episodes remembered (50%), 0 of 1 MB, 0 evicted"
    assert str(Memo().tally()).startswith("0 of 0 episodes remembered (0%)")
