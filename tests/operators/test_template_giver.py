"""A request for a template is answered from the cloud that arrived, and from nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from teleop_sim.channel.messages import Answer, Request, TemplateInsert, TemplateMove, encode_voxels
from teleop_sim.channel.template_ends import FieldTemplates, StationTemplates
from teleop_sim.machines.library import MACHINES
from teleop_sim.machines.mirror import Mirror
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.clouds import Region
from teleop_sim.operators.desk import Giver
from teleop_sim.operators.template_giver import TemplateGiver
from teleop_sim.operators.timing import load_timing
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose, gap
from teleop_sim.templates.shapes import bounds

TRUTH = Pose((1.5, 0.1, 1.1), (0.0, 0.0, 0.2))
ASKED = Request(7, "data", 3)
EYE_M = (0.0, 0.0, 1.7)


def cloud(template, pose, rng):
    low, high = bounds(template.shapes)
    points = rng.uniform(low - 0.03, high + 0.03, (6000, 3))
    distance, normal = template.signed(points)
    return encode_voxels(pose.place(points - distance[:, None] * normal), 0.02)


@pytest.fixture
def belief():
    return Belief(Mirror(MACHINES["vigir-valve-atlas"](), 2))


def test_nothing_is_given_before_a_cloud_has_come(belief):
    giver: Giver = TemplateGiver(StationTemplates(20.0), library().named("DRC_valve"), EYE_M)
    assert giver.give(belief, ASKED, np.random.default_rng(1)) == ()
    assert giver.work_s(belief, ASKED, load_timing()) == load_timing().read_image_s()


def test_a_template_goes_ahead_of_the_answer_that_names_it(belief):
    valve, station, field = library().named("DRC_valve"), StationTemplates(20.0), FieldTemplates()
    giver = TemplateGiver(station, valve, EYE_M)
    belief.take(cloud(valve, TRUTH, np.random.default_rng(0)), 30.0)
    # The paper's 52 s, within the keystroke-level model's 21 %.
    assert giver.work_s(belief, ASKED, load_timing()) == pytest.approx(52.2, rel=0.21)
    inserted, answer = giver.give(belief, ASKED, np.random.default_rng(1))
    assert isinstance(inserted, TemplateInsert)
    field.receive(inserted)
    (there,) = field.server.placed
    assert answer == Answer(7, bytes([there.instance]))
    assert there.template == valve.type_id
    # A voxel.
    assert gap(there.pose, TRUTH)[0] < 0.02
    # Asked again, it is moved, which is soon done.
    assert giver.work_s(belief, ASKED, load_timing()) == pytest.approx(12.0, rel=0.21)
    moved, answer = giver.give(belief, ASKED, np.random.default_rng(2))
    assert isinstance(moved, TemplateMove)
    assert answer.data == bytes([there.instance])


def test_what_looks_like_no_such_thing_is_not_given(belief):
    rng = np.random.default_rng(0)
    belief.take(encode_voxels(rng.uniform((1.0, -0.5, 0.5), (2.0, 0.5, 1.5), (3000, 3)), 0.02), 30.0)
    giver = TemplateGiver(StationTemplates(20.0), library().named("DRC_valve"), EYE_M)
    assert giver.give(belief, ASKED, rng) == ()
    assert giver.laid is not None
    assert giver.station.server.placed == ()


def test_only_the_cloud_counts(belief):
    valve = library().named("DRC_valve")
    shifted = Pose((1.9, -0.4, 0.9), (0.0, 0.0, -0.1))
    found = []
    for truth in (TRUTH, shifted):
        giver = TemplateGiver(StationTemplates(20.0), valve, EYE_M)
        belief.take(cloud(valve, truth, np.random.default_rng(0)), 30.0)
        inserted, _ = giver.give(belief, ASKED, np.random.default_rng(1))
        found.append(Pose(inserted.position_m, inserted.rotation_rad))
    assert gap(found[0], TRUTH)[0] < 0.02
    assert gap(found[1], shifted)[0] < 0.02


def test_who_knows_where_the_thing_is_does_not_lay_its_template_elsewhere():
    door, rng = library().named("door"), np.random.default_rng(0)
    truth = Pose((1.5, 0.1, 1.0), (0.0, 0.0, 0.1))
    seen = cloud(door, truth, rng)
    elsewhere = Region((1.5, 0.9, 1.0))
    for region, fits in ((Region(truth.position_m), True), (elsewhere, False)):
        giver = TemplateGiver(StationTemplates(20.0), door, EYE_M, region=region)
        belief = Belief(Mirror(MACHINES["vigir-door-atlas"](), 2))
        assert giver.wants(belief) == region.ask()
        belief.take(seen, 30.0)
        assert giver.wants(belief) is None
        assert bool(giver.give(belief, ASKED, np.random.default_rng(4))) is fits
        # What did not do is wanted finer.
        assert giver.wants(belief) == (None if fits else region.ask(tries=1))
    assert elsewhere.ask(tries=1).voxel_mm < elsewhere.ask().voxel_mm
