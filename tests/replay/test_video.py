"""Videos: decoded again, they hold what was asked for. Needs EGL (Debian: libegl1, libgl1-mesa-dri)."""

import hashlib
from pathlib import Path

import av
import numpy as np
import pytest

from teleop_sim.replay.frames import LINGER_S, Cut, Shot, clock, shots
from teleop_sim.replay.strip import PAPER, strip, strip_height_px
from teleop_sim.replay.telling import Telling, Told
from teleop_sim.replay.video import write_video

SIZE = 320, 240
CUT = Cut(from_s=12.0, to_s=36.0, speed=8.0, fps=10)
"""Most of a walk."""


def decoded(path: Path) -> list[np.ndarray]:
    with av.open(str(path)) as file:
        return [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]


@pytest.fixture(scope="module")
def video(dish, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("video") / "walk.mp4"
    write_video(dish.log, path, CUT, SIZE)
    return path


def test_a_video_has_the_pictures_size_rate_and_length_asked_for(video):
    with av.open(str(video)) as file:
        stream = file.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.average_rate) == (*SIZE, CUT.fps)
        # 24 s at 8 times the speed: 3 s, and the picture of the end.
        assert stream.frames == 31
        assert file.duration * 1e-6 == pytest.approx(3.1, abs=0.05)


def test_its_pictures_change_as_the_robot_walks_and_none_is_empty(video):
    frames = decoded(video)
    assert len({frame.tobytes() for frame in frames}) == len(frames)
    top = SIZE[1] - strip_height_px(SIZE[1])
    for frame in frames:
        assert len(np.unique(frame[:top].reshape(-1, 3), axis=0)) > 100


def test_the_words_under_the_picture_are_there_and_change(video, dish):
    frames, telling = decoded(video), Telling.of(dish.log)
    top = SIZE[1] - strip_height_px(SIZE[1])
    for k in (0, 15, 30):
        shot = shots(CUT, [])[k]
        meant = strip(telling.at(shot.t_s), clock(shot), *SIZE)
        # H.264 at its usual quality: a letter's edge may be off by some levels, not on average.
        assert np.abs(frames[k][top:].astype(int) - meant).mean() < 6
        assert (np.abs(frames[k][top:].astype(int) - PAPER).max(axis=2) > 80).mean() > 0.02


def test_the_same_log_gives_the_same_pictures(video, dish, tmp_path):
    write_video(dish.log, tmp_path / "again.mp4", CUT, SIZE)
    a, b = (hashlib.sha256(np.array(decoded(path)).tobytes()).digest() for path in (video, tmp_path / "again.mp4"))
    assert a == b


def test_an_interrupted_video_leaves_nothing_and_keeps_what_was_there(dish, tmp_path):
    out = tmp_path / "run.mp4"
    out.write_bytes(b"an older video")

    def interrupt(done: int, count: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(dish.log, out, CUT, SIZE, progress=interrupt)
    assert [path.name for path in tmp_path.iterdir()] == ["run.mp4"]
    assert out.read_bytes() == b"an older video"


def test_progress_counts_the_pictures(dish, tmp_path):
    told = []
    count = write_video(
        dish.log, tmp_path / "a.mp4", Cut(5.0, 5.3, 1.0, 10), SIZE, "station", lambda *now: told.append(now)
    )
    assert count == 4
    assert told == [(0, 4), (1, 4), (2, 4), (3, 4)]


def test_shots_are_as_far_apart_as_speed_and_rate_say():
    taken = shots(Cut(10.0, 20.0, speed=4.0, fps=20), [])
    assert [shot.t_s for shot in taken] == pytest.approx(np.arange(10.0, 20.01, 0.2))


def test_a_cut_of_no_length_is_one_picture():
    assert shots(Cut(10.0, 10.0), []) == [Shot(10.0)]
    assert shots(Cut(10.0, 12.0, skip_waits=True), []) == [Shot(12.0, skipped_s=2.0)]


def test_waits_are_left_out_and_the_jump_is_told():
    stirring = [(2.0, 4.0), (30.0, 31.0), (50.0, 60.0)]
    taken = shots(Cut(0.0, 40.0, speed=1.0, fps=10, skip_waits=True), stirring)
    times_s = [shot.t_s for shot in taken]
    assert all(any(a - 1e-9 <= t_s <= b + 1e-9 for a, b in stirring) for t_s in times_s)
    assert len(taken) == 21 + 11
    assert [shot.skipped_s for shot in taken[:10]] == [2.0] * 10
    assert taken[15].skipped_s == 0.0
    assert clock(taken[21]) == "0:30.0  (26 s later)"


def test_a_run_of_waits_is_short_without_them(door):
    from teleop_sim.replay.track import Track

    stirring = Track.of(door.log).stirring(LINGER_S)
    whole = Cut(0.0, door.log.end_s)
    short = shots(Cut(0.0, door.log.end_s, skip_waits=True), stirring)
    assert len(short) < 0.5 * len(shots(whole, stirring))


def test_the_clock_counts_minutes():
    assert [clock(Shot(t_s)) for t_s in (0.0, 59.96, 61.25, 3725.0)] == ["0:00.0", "1:00.0", "1:01.2", "62:05.0"]


WORDS = Told("A/B", "manual", "walk", "supervisor reads: " + "much " * 60, {"up": "dark", "down": "busy"}, "A: x", "")


@pytest.mark.parametrize("size", [(240, 180), (320, 240), (960, 540), (1920, 1080)])
def test_words_fit_into_every_size_of_a_video(size):
    made = strip(WORDS, "0:12.3", *size)
    assert made.shape == (strip_height_px(size[1]), size[0], 3)
    assert strip_height_px(size[1]) % 2 == 0
    assert strip_height_px(size[1]) < 0.35 * size[1]
    # Nothing touches the edges: no word is cut.
    for edge in (made[0], made[-1], made[:, 0], made[:, -1]):
        assert (edge == PAPER).all()


def test_dark_busy_and_mode_have_colours_of_their_own():
    calm = Told("A/B", "normal", "walk", "", {"up": "idle", "down": "idle"}, "", "")
    one, other = (np.unique(strip(told, "0", 960, 540).reshape(-1, 3), axis=0) for told in (WORDS, calm))
    assert (255, 110, 90) in map(tuple, one.tolist())
    assert (255, 110, 90) not in map(tuple, other.tolist())
