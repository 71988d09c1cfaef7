"""Every registered message: round trip, size, refusal of bad bytes."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.codec import POSITION_STEP_M, ROTATION_STEP_RAD
from teleop_sim.channel.messages import (
    HANDLES,
    MESSAGES,
    MODES,
    REQUEST_KINDS,
    BadMessage,
    Chat,
    Confirm,
    HandlePose,
    Image,
    LevelIs,
    LogLine,
    MirrorUpdate,
    ModeIs,
    Reject,
    Request,
    SetLevel,
    StopAll,
    decode_message,
    decode_payload,
    encode_image,
    encode_message,
)
from teleop_sim.core.errors import UnknownName


def ramp(height=60, width=80):
    """A colour gradient (h, w, 3)."""
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([3 * x, 4 * y, x + y], axis=-1).astype(np.uint8)


uint8, uint16, levels = st.integers(0, 255), st.integers(0, 65535), st.integers(0, 3)
printable = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=60)
some_text = st.text(st.characters(exclude_characters="\r\n", exclude_categories=("Cs",)), min_size=1, max_size=60)
# Codes of a pose: on the grid, a round trip is exact.
codes = st.tuples(*[st.integers(-32767, 32767)] * 3)

EXAMPLES = {
    "confirm": st.builds(Confirm, uint16),
    "reject": st.builds(Reject, uint16),
    "set_level": st.builds(SetLevel, levels),
    "stop_all": st.just(StopAll()),
    "chat": st.builds(lambda mark, rest: Chat(mark + rest), st.sampled_from("/*&|_$"), printable),
    "mirror": st.builds(MirrorUpdate, uint8),
    "mode": st.builds(ModeIs, st.integers(0, len(MODES) - 1)),
    "level": st.builds(LevelIs, levels),
    "request": st.builds(Request, uint16, st.sampled_from(REQUEST_KINDS), uint8, uint8),
    "log": st.builds(lambda ms, text: LogLine(ms / 1000, text), st.integers(0, 10**9), some_text),
    "image": st.sampled_from([encode_image(ramp(), w, h, q) for w, h, q in ((80, 60, 50), (32, 17, 10))]),
    "handle_pose": st.builds(
        lambda which, p, r: HandlePose(
            which, tuple(c * POSITION_STEP_M for c in p), tuple(c * ROTATION_STEP_RAD for c in r)
        ),
        st.sampled_from(HANDLES),
        codes,
        codes,
    ),
}

BINARY_SIZES = {
    "confirm": 3, "reject": 3, "set_level": 2, "stop_all": 1, "mirror": 2, "mode": 2, "level": 2, "request": 6,
    "handle_pose": 14,
}  # fmt: skip


def test_every_message_has_examples():
    assert sorted(EXAMPLES) == sorted(MESSAGES)


@pytest.mark.parametrize("topic", sorted(MESSAGES))
@given(data=st.data())
def test_every_message_comes_back_and_needs_no_topic(topic, data):
    sent = data.draw(EXAMPLES[topic])
    label, payload = encode_message(sent)
    assert label == topic
    assert decode_message(topic, payload) == sent
    assert decode_payload(payload) == sent
    assert decode_message(topic, payload).encode() == payload
    assert len(payload) == BINARY_SIZES.get(topic, len(payload))


@pytest.mark.parametrize("topic", sorted(MESSAGES))
@given(noise=st.binary(max_size=40))
def test_every_message_takes_any_bytes_as_a_message_or_as_bad(topic, noise):
    for decode in (lambda b: decode_message(topic, b), decode_payload):
        try:
            message = decode(noise)
        except BadMessage as error:
            where, what, _ = error.args
            assert where
            assert what
        else:
            assert message.encode() == noise or isinstance(message, LogLine)


@pytest.mark.parametrize("topic", sorted(MESSAGES))
@given(data=st.data())
def test_a_cut_message_is_bad(topic, data):
    payload = data.draw(EXAMPLES[topic]).encode()
    with pytest.raises(BadMessage):
        decode_message(topic, payload[:-1])
    with pytest.raises(BadMessage):
        decode_payload(b"")


def test_first_bytes_tell_all_messages_apart_and_text_from_binary():
    marks = b"".join(m.marks for m in MESSAGES.values())
    assert len(set(marks)) == len(marks)
    for message in MESSAGES.values():
        binary = len(message.marks) == 1
        assert all((mark < 0x20) == binary for mark in message.marks)


@given(*[st.floats(-32.7, 32.7)] * 3, *[st.floats(-math.pi, math.pi)] * 3)
def test_a_pose_comes_back_within_half_a_step(x, y, z, a, b, c):
    back = HandlePose.decode(HandlePose("yaw", (x, y, z), (a, b, c)).encode())
    # Half a step, and the rounding of one multiplication (relative 2e-16 of 33 m).
    assert back.position_m == pytest.approx((x, y, z), abs=POSITION_STEP_M / 2 + 1e-12)
    assert back.rotation_rad == pytest.approx((a, b, c), abs=ROTATION_STEP_RAD / 2 + 1e-12)


@given(st.floats(0.0, 99999.0))
def test_a_log_time_comes_back_within_half_a_millisecond(time_s):
    # A double at 1e5 s resolves 1.5e-11 s.
    assert LogLine.decode(LogLine(time_s, "x").encode()).time_s == pytest.approx(time_s, rel=0, abs=0.0005 + 1e-10)


@pytest.mark.parametrize(("characters", "size"), [(57, 75), (137, 155)])
def test_log_lines_have_the_sizes_of_wpi(characters, size):
    # 13-character time, 3 separators, text, 2 end characters: WPI's formats; their typical and long line.
    assert len(LogLine(285.4, "x" * characters).encode()) == size


def test_a_log_line_reads_as_in_the_chat():
    assert LogLine(12.25, "grasped").encode() == b"000000012.250 : grasped\r\n"


@pytest.mark.parametrize(
    "make",
    [
        lambda: Confirm(-1),
        lambda: Confirm(65536),
        lambda: Reject(1.5),
        lambda: SetLevel(4),
        lambda: LevelIs(-1),
        lambda: MirrorUpdate(256),
        lambda: ModeIs(4),
        lambda: Request(1, "guess", 0, 0),
        lambda: Request(1, "manual", 256, 0),
        lambda: Chat("RESTART"),
        lambda: Chat(""),
        lambda: Chat("/RESTART\n"),
        lambda: Chat("/RÉSTART"),
        lambda: LogLine(1.0, "two\nlines"),
        lambda: LogLine(1.0, "\ud800"),
        lambda: LogLine(-1.0, "x"),
        lambda: LogLine(math.nan, "x"),
        lambda: LogLine(1e9, "x"),
        lambda: HandlePose("roll", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        lambda: HandlePose("yaw", (33.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        lambda: HandlePose("yaw", (0.0, math.inf, 0.0), (0.0, 0.0, 0.0)),
        lambda: HandlePose("yaw", (0.0, 0.0, 0.0), (0.0, math.nan, 0.0)),
        lambda: HandlePose("yaw", (0.0, 0.0), (0.0, 0.0, 0.0)),
        lambda: Image(80, 61, encode_image(ramp(), 80, 60, 50).jpeg),
        lambda: Image(80, 60, b"\xff\xd8 no picture \xff\xd9"),
        lambda: encode_image(ramp().astype(float), 80, 60, 50),
        lambda: encode_image(ramp()[..., :2], 80, 60, 50),
        lambda: encode_image(ramp(), 0, 60, 50),
        lambda: encode_image(ramp(), 80, 60, 0),
    ],
)
def test_what_cannot_be_sent_is_refused_when_made(make):
    with pytest.raises(BadMessage) as refused:
        make()
    again = pickle.loads(pickle.dumps(refused.value))
    assert (again.args, str(again)) == (refused.value.args, str(refused.value))
    where, what, hint = refused.value.args
    assert where
    assert what
    assert hint


def test_an_unknown_topic_is_named():
    with pytest.raises(UnknownName, match="Did you mean 'confirm'"):
        decode_message("confrm", b"\x01\x00\x00")


def test_a_colour_jpeg_is_refused():
    import io

    from PIL import Image as Picture

    sink = io.BytesIO()
    Picture.fromarray(ramp()).save(sink, "JPEG")
    with pytest.raises(BadMessage, match="mode RGB"):
        Image(80, 60, sink.getvalue())


def test_an_image_shows_what_was_seen():
    grey = ramp()[..., 0]
    image = encode_image(grey, 80, 60, 90)
    # Quality 90 on a smooth ramp: libjpeg's steps are at most 24 in one of 64 coefficients, an RMS of a few levels.
    error = image.pixels().astype(float) - grey
    assert image.pixels().shape == (60, 80)
    assert float(np.sqrt(np.mean(error**2))) < 3.0


def test_an_image_is_smaller_at_lower_quality_and_size_and_the_same_twice():
    full, poor, small = (encode_image(ramp(), *of) for of in ((80, 60, 80), (80, 60, 10), (20, 15, 80)))
    assert len(poor.encode()) < len(full.encode())
    assert len(small.encode()) < len(full.encode())
    assert full == encode_image(ramp(), 80, 60, 80)
    assert len(full.encode()) == 1 + len(full.jpeg)


@settings(deadline=None)
@given(st.data())
def test_a_damaged_image_is_a_picture_or_bad(data):
    payload = bytearray(encode_image(ramp(), 32, 24, 50).encode())
    for at in data.draw(st.lists(st.integers(0, len(payload) - 1), max_size=4)):
        payload[at] = data.draw(uint8)
    try:
        image = Image.decode(bytes(payload))
        pixels = image.pixels()
    except BadMessage:
        return
    assert pixels.shape == (image.height, image.width)


def test_a_header_that_promises_gigapixels_is_bad():
    jpeg = encode_image(ramp(), 32, 24, 50).jpeg
    with pytest.raises(BadMessage, match="no sound JPEG"):
        Image(65535, 65535, jpeg.replace(b"\x00\x18\x00\x20", b"\xff\xff\xff\xff"))
