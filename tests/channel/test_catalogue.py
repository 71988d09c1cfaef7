"""The catalogue of messages cannot rot."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from teleop_sim.channel.catalogue import catalogue_markdown
from teleop_sim.channel.messages import MESSAGES, decode_payload

PAGE = Path(__file__).parents[2] / "docs" / "messages.md"
ABOUT = re.compile(r"~([\d,.]+)")


@pytest.fixture(scope="module")
def said():
    return catalogue_markdown().strip()


def test_the_page_is_what_the_messages_say(said):
    written = PAGE.read_text(encoding="utf-8").split("<!-- messages -->")[1].strip()
    assert ABOUT.sub("~", written) == ABOUT.sub("~", said), "run python -m teleop_sim.channel.catalogue and paste it"
    numbers = [[float(number.replace(",", "")) for number in ABOUT.findall(text)] for text in (written, said)]
    # Other builds of the compressors: a tenth, and the last digit of a time.
    assert numbers[0] == pytest.approx(numbers[1], rel=0.1, abs=0.011)


@pytest.mark.parametrize("topic", sorted(MESSAGES))
def test_every_message_describes_itself(topic, said):
    kind = MESSAGES[topic]
    example = kind.example()
    back = decode_payload(example.encode())
    assert type(example) is type(back) is kind
    assert back.encode() == example.encode()
    assert kind.layout
    assert f"| `{topic}` | {kind.direction} |" in said
