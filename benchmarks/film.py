"""Look at a run: rebuild its scene from the log alone and draw the robot as it moved, as contact sheets.

python benchmarks/film.py runs/src-dish_seed1.mcap --every 2 --out film

Every row is a time: seen from behind the robot, and from its right side. Needs EGL (Debian: libegl1, libgl1-mesa-dri).
The dish and the wheels are drawn too, because they are joints of the same model.
"""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from pathlib import Path

import numpy as np

# Read by mujoco when it is imported: there is no display where simulations run.
os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
from PIL import Image, ImageDraw

from teleop_sim.core.streams import stream
from teleop_sim.log.load import Log, load
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.objects import dish_settings
from teleop_sim.world.dish_draw import draw_dish_world
from teleop_sim.world.dish_scenery import DishScenery
from teleop_sim.world.plant import Plant

NO_EGL = "cannot draw: no EGL. On Debian: apt install libegl1 libgl1-mesa-dri; or set MUJOCO_GL=osmesa with libosmesa6."
PELVIS = 7


def rebuild(log: Log) -> Plant:
    """The plant of a logged run, from its scenario, seed and replicate."""
    scenario = read_scenario(log.scenario_toml, str(log.path))
    started = log.runs.iloc[0]
    streams = partial(stream, int(started["seed"]), int(started["replicate"]))
    world = draw_dish_world(streams, dish_settings(scenario.world))
    return Plant(ROBOTS[scenario.robot]().model, DishScenery(world))


def soften(plant: Plant) -> None:
    """Sensor tests draw dusk and glare; whoever looks at postures wants even light."""
    plant.model.vis.headlight.ambient[:] = 0.25
    plant.model.vis.headlight.diffuse[:] = 0.35
    plant.model.vis.headlight.active = 1
    plant.model.light_castshadow[:] = 0


def place(plant: Plant, sample: np.ndarray, columns: list[str]) -> None:
    """Put everything where a logged sample says."""
    plant.data.qpos[:PELVIS] = sample[1 : 1 + PELVIS]
    for name, value in zip(columns[1 + PELVIS :], sample[1 + PELVIS :], strict=True):
        plant.set_angle(name, float(value))
    mujoco.mj_forward(plant.model, plant.data)


def heading(quat: np.ndarray) -> float:
    """Yaw [rad] of a quaternion w, x, y, z."""
    w, x, y, z = quat
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def cameras(sample: np.ndarray, close: bool) -> tuple[mujoco.MjvCamera, ...]:
    """From behind and above the left shoulder, and from the right side."""
    yaw = float(np.degrees(heading(sample[4:8])))
    views = ((yaw + 20.0, -20.0, 2.6), (yaw + 90.0, -8.0, 2.4))
    if close:
        views = ((yaw + 15.0, -50.0, 1.5), (yaw + 90.0, -15.0, 1.3))
    made = []
    for azimuth, elevation, distance in views:
        camera = mujoco.MjvCamera()
        camera.lookat[:] = sample[1:4]
        camera.lookat[2] += 0.05 if close else -0.1
        if close:
            camera.lookat[:2] += 0.35 * np.array([np.cos(np.radians(yaw)), np.sin(np.radians(yaw))])
        camera.azimuth, camera.elevation, camera.distance = azimuth, elevation, distance
        made.append(camera)
    return tuple(made)


def caption(log: Log, t_s: float) -> str:
    """Time, state, skill."""
    past = log.transitions[log.transitions["t_s"] <= t_s]
    state = past["next_state"].iloc[-1] if len(past) else log.transitions["state"].iloc[0]
    now = log.episodes[(log.episodes["start_s"] <= t_s + 1e-6) & (log.episodes["t_s"] >= t_s - 1e-6)]
    skill = f" {now['skill'].iloc[-1]} -> {now['outcome'].iloc[-1]}" if len(now) else ""
    return f"{t_s:.1f} s {state}{skill}"


def shoot(
    renderer: mujoco.Renderer, plant: Plant, sample: np.ndarray, columns: list[str], text: str, close: bool
) -> Image.Image:
    """One time as a strip of views with a caption."""
    place(plant, sample, columns)
    option = mujoco.MjvOption()
    option.sitegroup[:] = 0  # the touch sensors' boxes would hide the hands
    views = []
    for camera in cameras(sample, close):
        renderer.update_scene(plant.data, camera, option)
        views.append(renderer.render())
    strip = Image.fromarray(np.hstack(views))
    ImageDraw.Draw(strip).text((4, 2), text, fill=(255, 255, 0), stroke_width=1, stroke_fill=(0, 0, 0))
    return strip


def sheet(strips: list[Image.Image], across: int) -> Image.Image:
    """Strips in reading order."""
    width, height = strips[0].size
    down = -(-len(strips) // across)
    page = Image.new("RGB", (width * min(across, len(strips)), height * down))
    for k, strip in enumerate(strips):
        page.paste(strip, (width * (k % across), height * (k // across)))
    return page


def film(path: Path, out: Path, every_s: float, start_s: float, stop_s: float, close: bool, size: int) -> list[Path]:
    """Draw a log; return the sheets' paths."""
    log = load(path)
    plant = rebuild(log)
    soften(plant)
    try:
        renderer = mujoco.Renderer(plant.model, size, size)
    except Exception as error:  # mujoco raises whatever the GL binding does
        sys.exit(f"{NO_EGL} ({error})")
    table = log.plant
    columns, samples = list(table.columns), table.to_numpy()
    shown: list[Image.Image] = []
    due_s = start_s
    for sample in samples:
        if sample[0] >= due_s - 1e-6 and sample[0] <= stop_s:
            shown.append(shoot(renderer, plant, sample, columns, caption(log, sample[0]), close))
            due_s = sample[0] + every_s
    renderer.close()
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for k in range(0, len(shown), 24):
        target = out / f"{path.stem}_{k // 24:02d}.png"
        sheet(shown[k : k + 24], 4).save(target)
        written.append(target)
    return written


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--every", type=float, default=2.0, help="seconds between frames")
    parser.add_argument("--start", type=float, default=0.0)
    parser.add_argument("--stop", type=float, default=np.inf)
    parser.add_argument("--close", action="store_true", help="near the hands")
    parser.add_argument("--size", type=int, default=240, help="pixels a view")
    parser.add_argument("--out", type=Path, default=Path("film"))
    args = parser.parse_args()
    for target in film(args.log, args.out, args.every, args.start, args.stop, args.close, args.size):
        print(target)


if __name__ == "__main__":
    main()
