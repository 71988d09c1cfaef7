"""Robots as data against what was published about them."""

from importlib.resources import as_file, files

import pytest

from teleop_sim.robot.robots import ROBOTS
from teleop_sim.world.description import Description, load_description

# Table I of the WPI paper: whole mass, and the share of its parts in per cent. Its Atlas has no grippers.
TABLE_I = {
    "atlas": (175.4, {"torso": 55.26, "legs": 20.64, "arms": 21.79, "head": 2.29}),
    "valkyrie": (135.2, {"torso": 35.69, "legs": 36.59, "arms": 21.92, "head": 5.73}),
}
# The public Atlas has 2.09 kg in its head, the table 4.02 kg.
EXPLAINED = {("atlas", "head"): 1.2}
TOTAL_KG = {"atlas": 173.75, "valkyrie": 135.9, "thormang3": 43.72}
BARE_WRISTS = {"atlas": ("l_hand", "r_hand")}


def raw(name: str) -> Description:
    with as_file(files("teleop_sim.robot").joinpath(f"{name}.json")) as path:
        return load_description(path)


def masses(name: str) -> tuple[dict[str, float], float]:
    """Masses of the parts [kg] and of all, without what hangs on Atlas' wrists."""
    spec, description = ROBOTS[name](), raw(name)
    mass = {link.name: link.mass_kg for link in description.links}
    for wrist in BARE_WRISTS.get(name, ()):
        for link in description.beyond(wrist):
            mass[link] = 0.0

    def of(joint: str) -> float:
        return sum(mass[link] for link in description.beyond(description.joint(joint).child))

    total = sum(mass.values())
    parts = {
        "legs": sum(of(leg[0]) for leg in spec.legs),
        "arms": sum(of(arm[0]) for arm in spec.arms.values()),
        "head": of(spec.neck[0]),
    }
    parts["torso"] = total - sum(parts.values())
    return parts, total


@pytest.mark.parametrize("name", sorted(TABLE_I))
def test_mass_fractions_are_those_of_table_i(name):
    (whole_kg, published), (found_kg, _) = TABLE_I[name], masses(name)
    for part, percent in published.items():
        assert 100 * found_kg[part] / whole_kg == pytest.approx(percent, abs=EXPLAINED.get((name, part), 0.5)), part


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_every_robot_weighs_what_its_source_says(name):
    # Rounded to 10 g in the sources' totals.
    assert masses(name)[1] == pytest.approx(TOTAL_KG[name], abs=0.02)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_folding_fingers_loses_no_mass(name):
    folded = ROBOTS[name]().model.description
    assert sum(x.mass_kg for x in folded.links) == pytest.approx(sum(x.mass_kg for x in raw(name).links), abs=1e-9)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_soles_mirror_each_other(name):
    sole = ROBOTS[name]().model.description.sole
    left, right = sole.centre_of(sole.left), sole.centre_of(sole.right)
    assert (left[0], left[1], left[2]) == (right[0], -right[1], right[2])
