"""Every registered message: round trip, size, refusal of bad bytes."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.messages import (
    HANDLES,
    JOINT_GROUPS,
    MARK_NAMES,
    MESSAGES,
    MODES,
    OUTCOMES,
    REQUEST_KINDS,
    SIDES,
    STEPS,
    Answer,
    AskCloud,
    AskView,
    Attach,
    BadMessage,
    CartesianTarget,
    Chat,
    Confirm,
    FootstepGoal,
    FootstepPlan,
    Force,
    HandBack,
    HandCloud,
    HandlePose,
    HandPose,
    Image,
    JointState,
    JointTargets,
    LevelIs,
    Lock,
    LockedIs,
    LogLine,
    Marks,
    MirrorUpdate,
    ModeIs,
    Modify,
    Pause,
    PausedIs,
    PixelMark,
    Preempt,
    Reject,
    Request,
    ResetWorld,
    Resume,
    SetLevel,
    StepDone,
    StopAll,
    SyncHash,
    SyncRequest,
    SyncState,
    TakeOver,
    TemplateAttach,
    TemplateDetach,
    TemplateHash,
    TemplateInsert,
    TemplateMove,
    TemplatePose,
    TemplateRemove,
    TemplateState,
    TemplateStep,
    TemplateSync,
    Unlock,
    VoxelCloud,
    WalkCommand,
    WebpImage,
    Withdrawn,
    decode_message,
    decode_payload,
    encode_image,
    encode_message,
    encode_voxels,
    encode_webp,
)
from teleop_sim.channel.quantise import GROUND, JOINT, POSITION, ROTATION
from teleop_sim.channel.template_messages import pack_entries
from teleop_sim.core.errors import UnknownName
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import FRAMES, GONE, Entry


def ramp(height=60, width=80):
    """A colour gradient (h, w, 3)."""
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([3 * x, 4 * y, x + y], axis=-1).astype(np.uint8)


uint8, uint16, levels = st.integers(0, 255), st.integers(0, 65535), st.integers(0, 3)
uint32, short = st.integers(0, 2**32 - 1), st.binary(max_size=300)
# A number may have one byte or two: take as many of either.
wide = st.one_of(uint8, uint16)
printable = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=60)
some_text = st.text(st.characters(exclude_characters="\r\n", exclude_categories=("Cs",)), min_size=1, max_size=60)


def on(grid, count):
    """Numbers on a grid: there a round trip is exact."""
    codes = st.integers(-grid.code_max, grid.code_max)
    return st.lists(codes, min_size=count[0], max_size=count[-1]).map(lambda c: tuple(v * grid.step for v in c))


places, rotations, angles = on(POSITION, (3,)), on(ROTATION, (3,)), on(JOINT, (0, 40))
singles = st.floats(width=32, allow_nan=False, allow_infinity=False)
clouds = st.lists(st.tuples(*[st.integers(-40, 40)] * 3), max_size=30).map(lambda k: np.array(k).reshape(-1, 3))

instances = st.builds(
    Entry, uint8, uint16, uint8, st.sampled_from(FRAMES), st.builds(Pose, places, rotations)
) | st.builds(Entry, uint8, uint16, st.just(GONE))
listed = st.lists(instances, max_size=4).map(lambda entries: pack_entries(entries, "test"))
thousandths = st.integers(-32767, 32767).map(lambda k: k * 0.001)
eighths = st.integers(-32767, 32767).map(lambda k: k / 8)
sizes = st.integers(0, 65535).map(lambda k: k / 8)
pixel_marks = st.builds(PixelMark, st.sampled_from(MARK_NAMES), eighths, eighths, sizes, sizes)

EXAMPLES = {
    "confirm": st.builds(Confirm, uint16),
    "reject": st.builds(Reject, uint16),
    "set_level": st.builds(SetLevel, levels),
    "stop_all": st.just(StopAll()),
    "chat": st.builds(lambda mark, rest: Chat(mark + rest), st.sampled_from("/*&|_$"), printable),
    "ask_view": st.just(AskView(0)),
    "lock": st.builds(Lock, wide),
    "unlock": st.builds(Unlock, wide),
    "pause": st.just(Pause()),
    "resume": st.just(Resume()),
    "preempt": st.just(Preempt()),
    "attach": st.builds(Attach, uint32),
    "sync_request": st.just(SyncRequest()),
    "take_over": st.builds(TakeOver, wide),
    "hand_back": st.builds(HandBack, uint16),
    "answer": st.builds(Answer, uint16, short),
    "modify": st.builds(Modify, short),
    "mirror": st.builds(MirrorUpdate, wide),
    "withdrawn": st.builds(Withdrawn, uint16),
    "paused": st.builds(PausedIs, st.integers(0, 1)),
    "locked": st.builds(LockedIs, wide, st.integers(0, 1)),
    "sync_state": st.builds(SyncState, short),
    "mode": st.builds(ModeIs, st.integers(0, len(MODES) - 1)),
    "level": st.builds(LevelIs, levels),
    "request": st.builds(Request, uint16, st.sampled_from(REQUEST_KINDS), wide, wide.map(lambda e: e - 1)),
    "log": st.builds(lambda ms, text: LogLine(ms / 1000, text), st.integers(0, 10**9), some_text),
    "image": st.sampled_from([encode_image(ramp(), w, h, q) for w, h, q in ((80, 60, 50), (32, 17, 10))]),
    "handle_pose": st.builds(HandlePose, st.sampled_from(HANDLES), places, rotations),
    "force": st.builds(Force, wide, uint16),
    "template_pose": st.builds(TemplatePose, uint8, places, rotations),
    "template_insert": st.builds(TemplateInsert, uint8, uint16, uint8, places, rotations),
    "template_move": st.builds(TemplateMove, uint8, uint16, uint8, places, rotations),
    "template_detach": st.builds(TemplateDetach, uint8, uint16, uint8, places, rotations),
    "template_remove": st.builds(TemplateRemove, uint8, uint16),
    "template_attach": st.builds(TemplateAttach, uint8, uint16, uint8, st.sampled_from(SIDES), places, rotations),
    "template_sync": st.builds(TemplateSync, listed),
    "template_state": st.builds(TemplateState, listed),
    "template_hash": st.builds(TemplateHash, uint32),
    "footstep_goal": st.builds(lambda ground, yaw: FootstepGoal(*ground, *yaw), on(GROUND, (2,)), on(ROTATION, (1,))),
    "cartesian_target": st.builds(CartesianTarget, st.sampled_from(SIDES), places, rotations),
    "joint_targets": st.builds(JointTargets, st.sampled_from(JOINT_GROUPS), angles),
    "walk": st.builds(WalkCommand, singles, singles, singles, st.booleans(), singles),
    "sync_hash": st.builds(SyncHash, uint32, uint32),
    "joint_state": st.builds(JointState, angles),
    "voxel_cloud": st.builds(lambda k, mm: encode_voxels((k + 0.5) * mm / 1000, mm / 1000), clouds, st.integers(1, 90)),
    "template_step": st.builds(
        TemplateStep, st.sampled_from(STEPS), uint8, st.sampled_from(SIDES), uint16, thousandths
    ),
    "step_done": st.builds(StepDone, st.sampled_from(STEPS), st.sampled_from(OUTCOMES), thousandths),
    "ask_cloud": st.builds(AskCloud, uint16, places, uint8.map(lambda k: 0.01 * k)),
    "reset_world": st.just(ResetWorld()),
    "hand_cloud": st.builds(
        lambda side, at, k, mm: HandCloud(side, at, encode_voxels((k + 0.5) * mm / 1000, mm / 1000)),
        st.sampled_from(SIDES),
        places,
        clouds,
        st.integers(1, 90),
    ),
    "hand_pose": st.builds(HandPose, st.sampled_from(SIDES), places, rotations),
    "footstep_plan": st.builds(
        lambda part, more, steps: FootstepPlan(part, part + more, tuple((*g, *y) for g, y in steps)),
        st.integers(0, 200),
        st.integers(1, 55),
        st.lists(st.tuples(on(GROUND, (2,)), on(ROTATION, (1,))), max_size=9),
    ),
    "marks": st.builds(Marks, uint16, uint32, st.lists(pixel_marks, max_size=4).map(tuple)),
    "webp_image": st.sampled_from([encode_webp(ramp(), w, h, q) for w, h, q in ((80, 60, 50), (31, 17, 10))]),
}

BINARY_SIZES = {
    "confirm": {3}, "reject": {3}, "set_level": {2}, "stop_all": {1}, "mirror": {2, 3}, "mode": {2}, "level": {2},
    "request": {6, 8}, "handle_pose": {14}, "force": {4, 5}, "template_pose": {14}, "footstep_goal": {7},
    "cartesian_target": {14}, "walk": {18}, "sync_hash": {9}, "lock": {2, 3}, "unlock": {2, 3}, "pause": {1},
    "resume": {1}, "preempt": {1}, "attach": {5}, "sync_request": {1}, "take_over": {2, 3}, "hand_back": {3},
    "withdrawn": {3}, "paused": {2}, "locked": {3, 4}, "template_insert": {17}, "template_move": {17},
    "template_detach": {17}, "template_remove": {4}, "template_attach": {18}, "template_hash": {5},
    "template_step": {8}, "step_done": {5}, "ask_cloud": {10}, "reset_world": {1}, "hand_pose": {14},
}  # fmt: skip
# Their length tells how wide a number is: without its last byte such a message may be another one.
ONE_OR_TWO = ("mirror", "lock", "unlock", "take_over", "locked", "force")


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
    assert len(payload) in BINARY_SIZES.get(topic, {len(payload)})


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
    sent = data.draw(EXAMPLES[topic])
    payload = sent.encode()
    if topic in ONE_OR_TWO and len(payload) == max(BINARY_SIZES[topic]):
        assert decode_message(topic, payload[:-1]) != sent
    else:
        with pytest.raises(BadMessage):
            decode_message(topic, payload[:-1])
    with pytest.raises(BadMessage):
        decode_payload(b"")


@pytest.mark.parametrize(
    ("message", "payload"),
    [
        (Confirm(258), "01 0102"),
        (Reject(65535), "02 ffff"),
        (SetLevel(3), "03 03"),
        (StopAll(), "04"),
        (Force(7, 258), "05 0102 07"),
        (Force(256, 0), "05 0000 0100"),
        (TemplatePose(3, (1.0, -0.001, 0.0), (math.pi, 0.0, -math.pi)), "06 03 03e8ffff0000 7fff00008001"),
        (TemplateInsert(2, 258, 29, (1.0, 0.0, 0.0), (0.0, 0.0, math.pi)), "a0 02 0102 1d 03e800000000 000000007fff"),
        (TemplateMove(2, 4, 8, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), "a1 02 0004 08 0000000003e8 000000000000"),
        (TemplateDetach(1, 5, 17, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), "a2 01 0005 11 0000000003e8 000000000000"),
        (TemplateRemove(2, 6), "a3 02 0006"),
        (
            TemplateAttach(1, 3, 17, "right", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
            "a4 01 0003 11 01 0000000003e8 000000000000",
        ),
        (TemplateSync(bytes.fromhex("02000603")), "a5 02 0006 03"),
        (TemplateState(b""), "b1"),
        (TemplateHash(0xCBF43926), "b0 cbf43926"),
        (TemplateStep("affordance", 2, "right", 1002, -0.5), "a6 08 02 01 03ea fe0c"),
        (StepDone("grasp", "blocked", 0.0), "b2 02 05 0000"),
        (AskCloud(20, (1.0, 0.0, 0.0), 0.5), "a7 0014 03e800000000 32"),
        (ResetWorld(), "a8"),
        (HandPose("right", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), "b3 01 0000000003e8 000000000000"),
        (
            HandCloud("right", (0.0, 0.0, 1.0), VoxelCloud(20, (1, -1, 0), 0, b"\x03\x00")),
            "b5 01 0000000003e8 0014 0001ffff0000 00 0300",
        ),
        (FootstepPlan(1, 2, ((2.5, -0.005, math.pi),)), "b4 01 02 01f4 ffff 7fff"),
        (FootstepGoal(2.5, -0.005, math.pi), "07 01f4 ffff 7fff"),
        (CartesianTarget("right", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), "08 01 0000000003e8 000000000000"),
        (JointTargets("neck", (math.pi, 0.0, -math.pi)), "09 05 03 7ff 000 801 0"),
        (MirrorUpdate(7), "10 07"),
        (MirrorUpdate(258), "10 0102"),
        (ModeIs(2), "11 02"),
        (LevelIs(1), "12 01"),
        (Request(258, "manual", 4), "13 0102 01 04 00"),
        (Request(258, "act", 255, 254), "13 0102 04 ff ff"),
        (Request(1, "confirm", 4, 255), "13 0001 00 0004 0100"),
        (Request(1, "decide", 256, 4), "13 0001 02 0100 0005"),
        (Request(1, "data", 0), "13 0001 03 00 00"),
        (HandlePose("yaw", (1.0, 0.0, -1.0), (0.0, math.pi, 0.0)), "15 01 03e80000fc18 00007fff0000"),
        (SyncHash(1, 0xCBF43926), "16 00000001 cbf43926"),
        (Lock(3), "80 03"),
        (AskView(0), "8f 00"),
        (Unlock(300), "81 012c"),
        (Pause(), "82"),
        (Resume(), "83"),
        (Preempt(), "84"),
        (Attach(0xCBF43926), "85 cbf43926"),
        (SyncRequest(), "86"),
        (TakeOver(5), "87 05"),
        (HandBack(258), "88 0102"),
        (Answer(258, b"ab"), "89 0102 0002 6162"),
        (Modify(b"abc"), "8a 0003 616263"),
        (Marks(258, 0xCBF43926, ()), "94 0102 cbf43926"),
        (Marks(1, 2, (PixelMark("yaw_handle", 100.0, -0.125, 8.0, 7.5),)), "94 0001 00000002 02 0320 ffff 0040 003c"),
        (Withdrawn(258), "90 0102"),
        (PausedIs(1), "91 01"),
        (LockedIs(300, 0), "92 00 012c"),
        (SyncState(b"abc"), "93 0003 616263"),
        (JointState((-math.pi,)), "17 01 801 0"),
        (Chat("/RESTART"), b"/RESTART\n".hex()),
        (LogLine(1.5, "\N{DEGREE SIGN}"), b"000000001.500 : \xc2\xb0\r\n".hex()),
    ],
)
def test_the_bytes_are_those_written_down(message, payload):
    # By hand from the layouts in docs/messages.md: an old log must stay readable.
    assert message.encode().hex() == payload.replace(" ", "")


def test_first_bytes_tell_all_messages_apart_and_text_from_binary():
    marks = b"".join(m.marks for m in MESSAGES.values())
    assert len(set(marks)) == len(marks)
    for message in MESSAGES.values():
        binary = len(message.marks) == 1
        assert all((mark < 0x20 or mark >= 0x80) == binary for mark in message.marks)


@given(*[st.floats(-32.7, 32.7)] * 3, *[st.floats(-math.pi, math.pi)] * 3)
def test_a_pose_comes_back_within_half_a_step(x, y, z, a, b, c):
    back = HandlePose.decode(HandlePose("yaw", (x, y, z), (a, b, c)).encode())
    # Half a step, and the rounding of one multiplication (relative 2e-16 of 33 m).
    assert back.position_m == pytest.approx((x, y, z), abs=POSITION.step / 2 + 1e-12)
    assert back.rotation_rad == pytest.approx((a, b, c), abs=ROTATION.step / 2 + 1e-12)


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
        lambda: MirrorUpdate(65536),
        lambda: MirrorUpdate(-1),
        lambda: MirrorUpdate(1.0),
        lambda: ModeIs(4),
        lambda: Request(1, "guess", 0, 0),
        lambda: Request(1, "manual", 65536, 0),
        lambda: Request(1, "confirm", 0, 65535),
        lambda: Request(1, "confirm", 0, -2),
        lambda: Request(1, "confirm", 0, 0.5),
        lambda: Request(1, "confirm", 0.5, 0),
        lambda: PausedIs(2),
        lambda: LockedIs(0, 2),
        lambda: Answer(1, bytes(65536)),
        lambda: Modify("text"),
        lambda: MirrorUpdate.decode(b"\x10\x00\x07"),
        lambda: Request.decode(bytes.fromhex("1300010000040005")),
        lambda: SyncState.decode(b"\x93\x00\x03ab"),
        lambda: SyncState.decode(b"\x93\x00\x03abcd"),
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
        lambda: Image(80, 61, encode_image(ramp(), 80, 60, 50).coded),
        lambda: Image(80, 60, b"\xff\xd8 no picture \xff\xd9"),
        lambda: encode_image(ramp().astype(float), 80, 60, 50),
        lambda: encode_image(ramp()[..., :2], 80, 60, 50),
        lambda: encode_image(ramp(), 0, 60, 50),
        lambda: encode_image(ramp(), 80, 60, 0),
        lambda: encode_image(ramp(), 65536, 60, 50),
        lambda: Marks(65536, 0, ()),
        lambda: Marks(1, 0, (PixelMark("nose", 1.0, 1.0, 1.0, 1.0),)),
        lambda: Marks(1, 0, (PixelMark("yaw_wheel", math.nan, 1.0, 1.0, 1.0),)),
        lambda: Marks(1, 0, (PixelMark("yaw_wheel", 4096.0, 1.0, 1.0, 1.0),)),
        lambda: Marks.decode(bytes.fromhex("94000100000002") + b"\x04" + bytes(8)),
        lambda: Marks.decode(bytes.fromhex("9400010000000201")),
        lambda: Force(65536, 0),
        lambda: Force(0, 65536),
        lambda: TemplatePose(256, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        lambda: TemplatePose(0, (0.0, 0.0, 0.0), (0.0, 3.2, 0.0)),
        lambda: FootstepGoal(164.0, 0.0, 0.0),
        lambda: FootstepGoal(0.0, 0.0, 3.142),
        lambda: CartesianTarget("middle", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        lambda: JointTargets("tail", (0.0,)),
        lambda: JointTargets("neck", (0.0, math.nan)),
        lambda: JointState((0.0,) * 256),
        lambda: JointState((3.15,)),
        lambda: WalkCommand(math.inf, 0.0, 0.0, False, 0.0),
        lambda: WalkCommand(1e39, 0.0, 0.0, False, 0.0),
        lambda: WalkCommand(1.0, math.nan, 0.0, False, 0.0),
        lambda: WalkCommand(1.0, 0.0, 0.0, 2, 0.0),
        lambda: SyncHash(1 << 32, 0),
        lambda: SyncHash(0, 1 << 32),
        lambda: WebpImage(80, 61, encode_webp(ramp(), 80, 60, 50).coded),
        lambda: WebpImage(80, 60, encode_image(ramp(), 80, 60, 50).coded),
        lambda: encode_webp(ramp(), 16384, 60, 50),
        lambda: encode_webp(ramp(), 80, 60, 101),
        lambda: encode_voxels(np.zeros((4, 2)), 0.01),
        lambda: encode_voxels(np.array([[0.0, math.nan, 0.0]]), 0.01),
        lambda: encode_voxels(np.array([[1e300, 0.0, 0.0]]), 0.01),
        lambda: encode_voxels(np.zeros((1, 3)), 0.0105),
        lambda: encode_voxels(np.zeros((1, 3)), 0.0),
        lambda: encode_voxels(np.zeros((1, 3)), math.nan),
        lambda: encode_voxels(np.array([[0.0, 0.0, 0.0], [0.0, 656.0, 0.0]]), 0.01),
        lambda: encode_voxels(np.full((1, 3), 400.0), 0.01),
        lambda: VoxelCloud(10, (0, 0, 0), 17, b""),
        lambda: VoxelCloud(10, (0, 0, 0.5), 0, b"\x03\x00"),
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


@pytest.mark.parametrize("topic", sorted(MESSAGES))
@settings(deadline=None)
@given(data=st.data())
def test_a_damaged_message_is_a_message_or_bad(topic, data):
    payload = bytearray(data.draw(EXAMPLES[topic]).encode())
    for at in data.draw(st.lists(st.integers(1, max(len(payload) - 1, 1)), max_size=4)):
        payload[at : at + 1] = data.draw(st.binary(max_size=2))
    try:
        message = decode_payload(bytes(payload))
    except BadMessage:
        return
    assert message.encode() == bytes(payload) or isinstance(message, LogLine)


@given(*[st.floats(-163.8, 163.8)] * 2, st.floats(-math.pi, math.pi))
def test_a_footstep_goal_comes_back_within_half_a_step(x_m, y_m, yaw_rad):
    back = FootstepGoal.decode(FootstepGoal(x_m, y_m, yaw_rad).encode())
    # Half a step, and the rounding of one multiplication (relative 2e-16 of 164 m).
    assert (back.x_m, back.y_m) == pytest.approx((x_m, y_m), abs=0.0025 + 1e-12)
    assert back.yaw_rad == pytest.approx(yaw_rad, abs=math.pi / 32767 / 2 + 1e-12)


@given(st.lists(st.floats(-math.pi, math.pi), max_size=255))
def test_joints_come_back_within_half_a_step(angles_rad):
    state = JointState(tuple(angles_rad))
    targets = JointTargets("neck", tuple(angles_rad))
    assert len(state.encode()) == 2 + math.ceil(1.5 * len(angles_rad)) == len(targets.encode()) - 1
    for back in (JointState.decode(state.encode()), JointTargets.decode(targets.encode())):
        assert back.angles_rad == pytest.approx(angles_rad, abs=math.pi / 2047 / 2 + 1e-12)


@given(*[st.floats(-1e30, 1e30)] * 4)
def test_a_walk_comes_back_in_single_precision(distance_m, turn_rad, offset_m, snap_rad):
    back = WalkCommand.decode(WalkCommand(distance_m, turn_rad, offset_m, True, snap_rad).encode())
    # IEEE 754: half a unit in the last of 24 bits; below 2**-126 half of 2**-149.
    came = (back.distance_m, back.turn_rad, back.offset_m, back.snap_rad)
    assert came == pytest.approx((distance_m, turn_rad, offset_m, snap_rad), rel=2**-24, abs=2**-150)


def test_the_walk_command_is_zarjs():
    walk = WalkCommand(1.5, -0.25, 0.5, True, 2.0).encode()
    # struct.pack("!Bfff?f", ...) of ZarjWalkCommand, but for the type byte; numbers of IEEE 754 by hand.
    assert walk[1:].hex() == "3fc00000be8000003f0000000140000000"


def test_a_walk_command_takes_12_25_s_over_64_bit_s_and_10_s():
    env, arrived = simpy.Environment(), []
    link = Direction(
        env, "up", DirectionSettings(64.0, 10.0), lambda payload: arrived.append((env.now, payload)), lambda _: None
    )
    walk = WalkCommand.example()
    link.send(*encode_message(walk))
    env.run()
    ((arrived_s, payload),) = arrived
    # 18 * 8 / 64 = 2.25 s on the wire; every term is exact in binary.
    assert (arrived_s, len(payload), decode_payload(payload)) == (12.25, 18, walk)
