"""The library of templates: ``library.toml`` read into values, with every mistake told at once."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, cast

from teleop_sim.core.errors import BadInput, Problem, UnknownName
from teleop_sim.templates.elements import Affordance, Grasp, Kind, Side, Stand, Template, Usability, box_inertia
from teleop_sim.templates.fields import Fields
from teleop_sim.templates.poses import Pose, Triple, from_quaternion
from teleop_sim.templates.shapes import Box, Disc, Ring, Rod, Shape

UNIT_TOLERANCE = 0.02
"""Published quaternions and axes have two to four digits: 0.7 for the root of a half is 1 % short."""

_LISTS = ("shapes", "affordances", "usabilities", "stands", "grasps")
_NAMES = ("name", "group", "source", "geometry_source")


@dataclass(frozen=True)
class Library:
    """All templates, in the order of the file. Both sites hold the same.

    Attributes:
        templates: each with its own name and number.

    """

    templates: tuple[Template, ...]

    def named(self, name: str) -> Template:
        """By name.

        Raises:
            UnknownName: there is no such template.

        """
        for template in self.templates:
            if template.name == name:
                return template
        raise UnknownName("template", name, tuple(t.name for t in self.templates))

    def of_type(self, type_id: int) -> Template:
        """By the number that messages carry.

        Raises:
            UnknownName: there is no such template.

        """
        for template in self.templates:
            if template.type_id == type_id:
                return template
        raise UnknownName("template type", str(type_id), tuple(str(t.type_id) for t in self.templates))


@cache
def library() -> Library:
    """The one that is shipped."""
    text = resources.files("teleop_sim.templates").joinpath("library.toml").read_text(encoding="utf-8")
    return read_library(text, "library.toml")


def read_library(text: str, name: str) -> Library:
    """A library from the text of its file.

    Args:
        text: TOML.
        name: of the file, for messages.

    Raises:
        BadInput: it is no TOML, or is wrong somewhere; all problems at once.

    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise BadInput((Problem(name, f"no TOML: {error}", "see toml.io"),)) from None
    problems: list[Problem] = []
    top = Fields(tables, name, problems)
    templates = tuple(_template(t) for t in top.tables("template"))
    top.done()
    _no_twins([(t.name,) for t in templates], name, "template names", problems)
    _no_twins([(t.type_id,) for t in templates], name, "type_ids", problems)
    if problems:
        raise BadInput(tuple(problems))
    return Library(templates)


def _template(t: Fields) -> Template:
    name, group, source, geometry_source = (t.text(key) for key in _NAMES)
    type_id, mass_kg = t.whole("type_id", 255), t.number("mass_kg", least=0.0)
    low, high = t.triple("box_min_m"), t.triple("box_max_m")
    inertia = t.triple("inertia_kgm2", box_inertia(mass_kg, low, high))
    shapes, affordances, usabilities, stands, grasps = (t.tables(key) for key in _LISTS)
    if not shapes:
        t.wrong("shapes", "none", "give at least one solid")
    made = Template(
        name,
        type_id,
        group,
        source,
        mass_kg,
        low,
        high,
        inertia,
        geometry_source,
        tuple(_shape(s) for s in shapes),
        tuple(_affordance(a) for a in affordances),
        tuple(_usability(u) for u in usabilities),
        tuple(_stand(s) for s in stands),
        tuple(_grasp(g) for g in grasps),
    )
    t.done()
    where, problems = t.where, t.problems
    _no_twins([(a.id,) for a in made.affordances], where, "affordance ids", problems)
    _no_twins([(a.name,) for a in made.affordances], where, "affordance names", problems)
    _no_twins([(u.id,) for u in made.usabilities], where, "usability ids", problems)
    _no_twins([(s.robot, s.id) for s in made.stands], where, "stand ids", problems)
    _no_twins([(g.hand, g.side, g.id) for g in made.grasps], where, "grasp ids", problems)
    return made


def _shape(s: Fields) -> Shape:
    kind = s.choice("kind", ("box", "rod", "ring", "disc"))
    made: Shape
    if kind == "box":
        made = Box(s.triple("centre"), s.triple("half"), s.triple("turn", (0.0, 0.0, 0.0)))
        if min(made.half) <= 0.0:
            s.wrong("half", f"{made.half}", "give three sizes above zero")
    elif kind == "rod":
        made = Rod(s.triple("start"), s.triple("end"), s.number("radius_m", above=0.0))
    elif kind == "ring":
        made = Ring(
            s.triple("centre"), _unit(s, "axis"), s.number("radius_m", above=0.0), s.number("tube_m", above=0.0)
        )
    else:
        made = Disc(
            s.triple("centre"), _unit(s, "axis"), s.number("radius_m", above=0.0), s.number("half_m", above=0.0)
        )
    s.done()
    return made


def _affordance(a: Fields) -> Affordance:
    kind = cast(Kind, a.choice("kind", ("linear", "circular", "screw")))
    amount = a.number("amount_m") if kind == "linear" else math.radians(a.number("amount_deg"))
    pitch_m = a.number("pitch_m") if kind == "screw" else 0.0
    made = Affordance(
        a.whole("id"),
        a.text("name"),
        kind,
        _unit(a, "axis"),
        a.triple("origin", (0.0, 0.0, 0.0)),
        amount,
        pitch_m,
        a.flag("keep_orientation", False),
    )
    a.done()
    return made


def _usability(u: Fields) -> Usability:
    made = Usability(u.whole("id"), u.text("name", empty=True), _pose(u))
    u.done()
    return made


def _stand(s: Fields) -> Stand:
    made = Stand(s.whole("id"), s.text("robot"), _pose(s))
    s.done()
    return made


def _grasp(g: Fields) -> Grasp:
    side = cast(Side, g.choice("side", ("left", "right")))
    far_m, near_m = g.number("far_m", least=0.0), g.number("near_m", least=0.0)
    if near_m > far_m:
        g.wrong("near_m", f"{near_m} is above far_m", "the least length cannot be above the one wished for")
    made = Grasp(g.whole("id"), g.text("hand"), side, _pose(g), _unit(g, "approach"), far_m, near_m)
    g.done()
    return made


def _pose(f: Fields) -> Pose:
    quat = f.row("quat_xyzw", 4, (0.0, 0.0, 0.0, 1.0))
    length = math.hypot(*quat)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        f.wrong("quat_xyzw", f"{list(quat)} has length {length:.3g}", "give a unit quaternion x, y, z, w")
        quat = (0.0, 0.0, 0.0, 1.0)
    return from_quaternion(f.triple("xyz"), quat)


def _unit(f: Fields, key: str) -> Triple:
    """A direction, made unit exactly."""
    x, y, z = f.triple(key, None, (1.0, 0.0, 0.0))
    length = math.hypot(x, y, z)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        f.wrong(key, f"[{x}, {y}, {z}] has length {length:.3g}", "give a unit vector")
        return (1.0, 0.0, 0.0)
    return (x / length, y / length, z / length)


def _no_twins(keys: list[tuple[Any, ...]], where: str, what: str, problems: list[Problem]) -> None:
    twins = list(dict.fromkeys(k for k in keys if keys.count(k) > 1))
    for twin in twins:
        problems.append(Problem(where, f"{what}: {' '.join(map(str, twin))} comes twice", "number them apart"))
