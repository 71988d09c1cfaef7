"""The plant of a run, rebuilt from its log alone, and put where the log says."""

from __future__ import annotations

from functools import partial

import numpy as np

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import RunStarted
from teleop_sim.core.streams import stream
from teleop_sim.log.load import Log
from teleop_sim.replay.track import Posture, Track
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.objects import TASKS, Site, drawn_disturbances
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.world.description import Vector
from teleop_sim.world.plant import HasPlaces, Plant
from teleop_sim.world.puppet import Puppet


class Scene:
    """A run's robot in its world. Mutable: ``at`` moves everything.

    Attributes:
        track: where everything was.
        plant: the run's own, with its disturbances, never stepped.
        thing: middle of what the task is about [m], at the start; None where it has none.
        tall_m: height of the robot's highest joint at the start.

    """

    def __init__(self, plant: Plant, track: Track, site: Site | None = None) -> None:
        self.plant, self.track = plant, track
        self._puppet = Puppet(plant, track.names)
        self.at(float(track.t_s[0]))
        self.thing = None if site is None else thing_of(site, plant)
        self.tall_m = self._puppet.height_m()

    @staticmethod
    def of(log: Log) -> Scene:
        """Rebuild a log's plant from its scenario, seed and replicate, as at the run's start.

        Raises:
            BadInput: this version of teleop-sim refuses the log's scenario.
            LogDamaged: the log does not say what was run, holds no motion, or that of another plant.

        """
        track = Track.of(log)
        plant, site = rebuilt(log)
        if plant.joint_names != track.names:
            raise LogDamaged(str(log.path), f"its joints are not those of today's plant: it is of {_version(log)}")
        return Scene(plant, track, site)

    def at(self, t_s: float) -> Posture:
        """Put everything where it was at a time; see ``Track.at`` for what that is between samples."""
        posture = self.track.at(t_s)
        self._puppet.pose(posture.pelvis, posture.joints)
        return posture

    def bodies(self) -> dict[str, np.ndarray]:
        """Where every body is now: position [m] and quaternion w, x, y, z, (7,), by name."""
        return self._puppet.bodies()


def rebuilt(log: Log) -> tuple[Plant, Site]:
    """The plant of a logged run and where its task was done, before anything moved.

    Everything is drawn again, from the same named streams: the world, and what in it was otherwise than believed.

    Raises:
        BadInput: this version of teleop-sim refuses the log's scenario.
        LogDamaged: the log does not say what was run.

    """
    started = _started(log)
    scenario = read_scenario(started.scenario_toml, str(log.path))
    streams = partial(stream, started.seed, started.replicate)
    site, spec = TASKS[scenario.task].site(scenario, streams), robot_spec(scenario)
    otherwise = drawn_disturbances(scenario, streams, site, spec.model)
    return Plant(spec.model, site.scenery, disturbances=otherwise), site


def thing_of(site: Site, plant: Plant) -> Vector | None:
    """Middle of what a task is about [m]: what templates are laid over, else the middle of the scenery's places."""
    if site.thing is not None:
        return site.thing.place
    if isinstance(site.scenery, HasPlaces):
        x, y, z = np.mean(list(site.scenery.places(plant).values()), axis=0).tolist()
        return x, y, z
    return None


def _started(log: Log) -> RunStarted:
    found = next(log.records("run/started"), None)
    if not isinstance(found, RunStarted):
        raise LogDamaged(str(log.path), "it does not say what was run: its first record is missing")
    return found


def _version(log: Log) -> str:
    return " ".join(_started(log).versions.split()[:2])
