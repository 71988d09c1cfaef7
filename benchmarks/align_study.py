"""Trials of laying templates over clouds: how wrong is the pose, by voxel size, crop and noise?

python benchmarks/align_study.py [--trials 20] [--things DRC_valve,door,dish_console] [--voxels 1,2,3,5]
    [--noises 0.3,1,2] [--crops 45,70]

A LIDAR 1.7 m up and 1.5 m away looks at the thing, with a wall 30 cm behind a valve, through rays 0.3 degrees apart,
with a normal error of ``noise`` along the ray. The points within ``crop`` of the middle of what is worked on become a
``VoxelCloud``, which is encoded and decoded. *fit*: least squares from 10 cm and 10 degrees off. *person*: the whole of
``operators/alignment.py``, from the cloud alone. Right is: within 3 cm at the handle and 5 degrees. Errors are medians
and, after the stroke, the 90 % quantile. A wheel's spokes look the same every 90 degrees; that much is not an error.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numpy as np

from teleop_sim.channel.messages import VoxelCloud, encode_voxels
from teleop_sim.core.streams import stream
from teleop_sim.operators.alignment import align, disturbed
from teleop_sim.operators.fitting import fit_template, prepared
from teleop_sim.templates.elements import Template
from teleop_sim.templates.library import library
from teleop_sim.templates.poses import Pose, rotation, rotation_vector
from teleop_sim.templates.shapes import Box, Shape

EYE_M = (0.0, 0.0, 1.7)
AWAY_M = 1.5
SPACING_RAD = math.radians(0.3)
OFF_M, OFF_RAD = 0.10, math.radians(10.0)
RIGHT_M, RIGHT_RAD = 0.03, math.radians(5.0)
HEIGHTS_M = {"DRC_valve": 1.1, "door": 1.016, "dish_console": 0.0, "doorlever": 1.016, "DRC_drill": 1.0}
WALL = Box((0.35, 0.0, 0.0), (0.05, 1.5, 1.5))
SPOKES_RAD = {"DRC_valve": math.tau / 4}


@dataclass(frozen=True)
class Seen:
    """What a LIDAR has seen of a thing: points (n, 3) in the odometry frame."""

    template: Template
    truth: Pose
    points: np.ndarray


def looked_at(template: Template) -> np.ndarray:
    """The point that matters (3,), in the template's frame: a handle's axis, or the middle of the wheels."""
    return np.array((0.0, 0.0, 0.91) if template.name == "dish_console" else (0.0, 0.0, 0.0))


def see(template: Template, rng: np.random.Generator, noise_m: float) -> Seen:
    """Cast rays at a template that stands somewhere about 1.5 m ahead."""
    yaw, side = rng.uniform(-0.4, 0.4), rng.uniform(-0.2, 0.2)
    spin = rng.uniform(0.0, math.tau) if template.name in SPOKES_RAD else 0.0
    matrix = rotation((0.0, 0.0, yaw)) @ rotation((spin, 0.0, 0.0))
    truth = Pose((AWAY_M, side, HEIGHTS_M[template.name]), rotation_vector(matrix))
    flat = Pose(truth.position_m, (0.0, 0.0, yaw))
    eye = np.array(EYE_M)
    aim = truth.place(looked_at(template)) - eye
    across = np.arange(-0.55, 0.55, SPACING_RAD)
    a, b = (g.ravel() for g in np.meshgrid(across, across))
    head = math.atan2(aim[1], aim[0])
    drop = math.atan2(aim[2], math.hypot(aim[0], aim[1]))
    rays = np.stack(
        [np.cos(head + a) * np.cos(drop + b), np.sin(head + a) * np.cos(drop + b), np.sin(drop + b)], axis=1
    )
    wall = (WALL,) if "valve" in template.name else ()
    reach = np.minimum(cast(template.shapes, truth, eye, rays), cast(wall, flat, eye, rays))
    hit = reach < 4.0
    reach = reach[hit] + rng.normal(0.0, noise_m, int(hit.sum()))
    return Seen(template, truth, eye + reach[:, None] * rays[hit])


def cast(shapes: tuple[Shape, ...], pose: Pose, eye: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Distance (n,) along rays (n, 3) to solids, infinite where they miss. Source: sphere tracing (Hart 1996)."""
    reach = np.full(len(rays), np.inf)
    for shape in shapes:
        way, at = rays @ pose.matrix, (eye - np.array(pose.position_m)) @ pose.matrix
        far, left = np.full(len(rays), 0.3), np.arange(len(rays))
        for _ in range(60):
            gap = shape.signed(at + far[left, None] * way[left])[0]
            far[left] += gap
            left = left[(np.abs(gap) > 1e-4) & (far[left] < 4.0)]
            if not len(left):
                break
        far[left] = np.inf
        reach = np.minimum(reach, far)
    return reach


def arrived(seen: Seen, crop_m: float, voxel_m: float) -> VoxelCloud:
    """The message that the points within a crop become, as it is decoded."""
    middle = seen.truth.place(looked_at(seen.template))
    near = seen.points[np.linalg.norm(seen.points - middle, axis=1) < crop_m]
    return VoxelCloud.decode(encode_voxels(near, voxel_m).encode())


def error(seen: Seen, pose: Pose) -> tuple[float, float]:
    """Error at the point that matters [m] and of the turn [rad]."""
    at = looked_at(seen.template)
    off = rotation_vector(seen.truth.matrix.T @ pose.matrix)
    same = SPOKES_RAD.get(seen.template.name)
    if same is not None:
        off = (math.remainder(off[0], same), off[1], off[2])
        spun = rotation((round(rotation_vector(seen.truth.matrix.T @ pose.matrix)[0] / same) * same, 0.0, 0.0))
        off = rotation_vector(spun.T @ seen.truth.matrix.T @ pose.matrix)
    return float(np.linalg.norm(pose.place(at) - seen.truth.place(at))), math.hypot(*off)


def from_guess(seen: Seen, cloud: VoxelCloud, rng: np.random.Generator) -> Pose:
    """Least squares from a pose 10 cm and 10 degrees off."""
    shift, turn = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    start = disturbed(seen.template, seen.truth, OFF_M * shift, OFF_RAD * turn)
    return fit_template(
        seen.template, prepared(seen.template, cloud.centres_m(), cloud.voxel_m, rng, EYE_M), start
    ).pose


def by_person(seen: Seen, cloud: VoxelCloud, rng: np.random.Generator) -> Pose:
    """The whole alignment, from the cloud alone."""
    aligned = align(seen.template, cloud, EYE_M, rng)
    return Pose() if aligned is None else aligned.pose


def row(name: str, noise_m: float, crop_m: float, voxel_m: float, trials: int) -> str:
    """One line of the table."""
    template, sizes, spent_s = library().named(name), [], 0.0
    errors: dict[str, list[tuple[float, float]]] = {"fit": [], "person": []}
    for trial in range(trials):
        seen = see(template, stream(7, trial, f"align.{name}"), noise_m)
        cloud = arrived(seen, crop_m, voxel_m)
        sizes.append(len(cloud.encode()))
        rng = stream(7, trial, "align.start")
        errors["fit"].append(error(seen, from_guess(seen, cloud, rng)))
        begun = time.process_time()
        errors["person"].append(error(seen, by_person(seen, cloud, rng)))
        spent_s += time.process_time() - begun
    cells = [name, f"{100 * noise_m:g}", f"{100 * crop_m:g}", f"{100 * voxel_m:g}", f"{np.median(sizes):,.0f}"]
    for found in errors.values():
        place, turn = np.array(found).T
        right = np.mean((place < RIGHT_M) & (turn < RIGHT_RAD))
        cells.append(f"{100 * right:.0f} %")
        cells.append(f"{100 * np.median(place):.1f} / {100 * np.quantile(place, 0.9):.1f}")
        cells.append(f"{np.degrees(np.median(turn)):.1f} / {np.degrees(np.quantile(turn, 0.9)):.1f}")
    cells.append(f"{1000 * spent_s / trials:.0f}")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--things", default="DRC_valve,door,dish_console")
    parser.add_argument("--voxels", default="1,2,3,5", help="edges [cm]")
    parser.add_argument("--noises", default="0.3,1,2", help="standard deviations [cm]")
    parser.add_argument("--crops", default="45,70", help="radii [cm]")
    asked = parser.parse_args()
    heads = ["thing", "noise cm", "crop cm", "voxel cm", "bytes", "fit right", "cm", "deg", "person right", "cm", "deg"]
    print(f"| {' | '.join([*heads, 'ms'])} |\n|{'---|' * (len(heads) + 1)}")
    for name in asked.things.split(","):
        for noise in asked.noises.split(","):
            for crop in asked.crops.split(","):
                for voxel in asked.voxels.split(","):
                    lengths_m = (float(v) / 100 for v in (noise, crop, voxel))
                    print(row(name, *lengths_m, asked.trials), flush=True)


if __name__ == "__main__":
    main()
