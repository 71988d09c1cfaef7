"""A run in MuJoCo's viewer, in time with the clock on the wall."""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue

from teleop_sim.log.load import Log
from teleop_sim.replay.cameras import CAMERAS
from teleop_sim.replay.frames import Shot, clock
from teleop_sim.replay.player import KEYS, Player
from teleop_sim.replay.scene import Scene
from teleop_sim.replay.telling import Telling, Told
from teleop_sim.world.window import Window

FRAME_S = 1 / 30


def play(
    log: Log,
    from_s: float,
    to_s: float,
    speed: float,
    camera: str,
    wall_s: Callable[[], float],
    sleep: Callable[[float], None],
) -> None:
    """Show a run in a window until that is closed. ``player.KEYS`` are its keys; the mouse moves the camera.

    Args:
        log: of the run. from_s, to_s: what is played. speed: simulated seconds a second. camera: a name in ``CAMERAS``.
        wall_s: a clock [s]. sleep: waits for so many seconds.

    Raises:
        BadInput, LogDamaged: the plant cannot be rebuilt, see ``Scene.of``.
        CannotDraw: there is no display here.

    """
    scene, telling = Scene.of(log), Telling.of(log)
    keys: SimpleQueue[int] = SimpleQueue()
    scene.at(from_s)
    follow = "" if camera == "station" else scene.plant.model.body(1).name
    window = Window(scene.plant, CAMERAS[camera](scene, from_s), follow, keys.put)
    player, before_s = Player(from_s, to_s, from_s, speed), wall_s()
    try:
        while window.open:
            now_s = wall_s()
            while not keys.empty():
                player = player.pressed(keys.get())
            player, before_s = player.after(now_s - before_s), now_s
            with window.lock():
                scene.at(player.t_s)
            window.show(*words(player, telling.at(player.t_s)))
            sleep(FRAME_S)
    finally:
        window.close()


def words(player: Player, told: Told) -> tuple[str, str]:
    """Two columns of the viewer's text: what, and how it is."""
    speed = "paused" if player.paused else f"{player.speed:g}x"
    link = ", ".join(f"{way} {state}" for way, state in told.link.items())
    rows = [
        ("time", f"{clock(Shot(player.t_s))} ({speed})"),
        ("state", f"{told.state} ({told.mode})"),
        ("robot", told.ended or told.doing),
        ("crew", told.crew[:100]),
        ("link", link),
        ("log", told.line[:100]),
        ("keys", KEYS),
    ]
    return "\n".join(name for name, _ in rows), "\n".join(text or "-" for _, text in rows)
