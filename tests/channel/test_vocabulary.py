"""WPI's chat vocabulary: sizes as cited, every line parses, errors say what would do."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.messages import BadMessage, Chat
from teleop_sim.channel.vocabulary import (
    FRAMES,
    SIDES,
    AbortWalk,
    Event,
    MoveHead,
    NudgeHand,
    StopEverything,
    format_chat,
    parse_chat,
    task1_vocabulary,
)

# SpaceRoboticsChallenge @ea36ad7, src_task_common/utils/commands.txt: bytes with the line end.
CITED = {
    "/RESTART": 9,
    "/SKIP_CHECKPOINT": 17,
    "/END_THE_STATE_MACHINE": 23,
    "/GOTO_STATE_DETECT_FINISH": 26,
    "/REDETECT_HANDLES_FROM_ERROR": 29,
    "/REGRASP_YAW_HANDLE_FROM_ERROR": 31,
    "/REGRASP_PITCH_HANDLE_FROM_ERROR": 33,
    "*0 1 0.05 0.0 0.0": 18,
    "&0 30 0": 8,
    "|": 2,
    "_": 2,
}


def test_the_table_is_the_cited_one():
    assert {word.example: word.size_bytes for word in task1_vocabulary()} == CITED


@pytest.mark.parametrize("text", sorted(CITED))
def test_payloads_have_the_cited_sizes_and_lines_come_back(text):
    assert len(Chat(text).encode()) == CITED[text]
    assert format_chat(parse_chat(text)) == text


def test_examples_say_what_they_mean():
    assert parse_chat("/RESTART") == Event("/RESTART")
    assert parse_chat("*0 1 0.05 0.0 0.0") == NudgeHand("left", "pelvis", 0.05, 0.0, 0.0)
    assert parse_chat("&0 30 0") == MoveHead(0.0, 30.0, 0.0)
    assert parse_chat("|") == AbortWalk()
    assert parse_chat("_") == StopEverything()


def test_an_event_of_the_machine_itself_may_be_forced():
    assert parse_chat("/DETECTED_PANEL") == Event("/DETECTED_PANEL")


numbers = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.one_of(
        st.from_regex(r"\A/[A-Z][A-Z0-9_]*\Z").map(Event),
        st.builds(NudgeHand, st.sampled_from(SIDES), st.sampled_from(FRAMES), numbers, numbers, numbers),
        st.builds(MoveHead, numbers, numbers, numbers),
        st.just(AbortWalk()),
        st.just(StopEverything()),
    )
)
def test_every_command_comes_back_through_its_payload(command):
    assert parse_chat(Chat.decode(Chat(format_chat(command)).encode()).text) == command


@pytest.mark.parametrize(
    "text",
    ["", "RESTART", "/", "/restart", "/RE START", "*", "*0 1 0.05", "*2 1 0 0 0", "*0 pelvis 0 0 0", "*0 1 0 0 0 0",
     "*0 1 a 0 0", "*0 1 nan 0 0", "*0 1 1e999 0 0", "&0 30", "&0 30 0 0", "&0 inf 0", "&1_0 0 0", "||", "_ ", "$0.04"],
)  # fmt: skip
def test_nonsense_is_refused_with_what_would_do(text):
    with pytest.raises(BadMessage) as refused:
        parse_chat(text)
    where, what, hint = refused.value.args
    assert repr(text) in where
    assert what
    assert hint
