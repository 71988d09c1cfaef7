"""The lean writer against the stock one of the ``mcap`` package: the same bytes."""

from __future__ import annotations

import io

from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from teleop_sim.log.mcap_file import McapFile

MESSAGES = st.lists(
    st.tuples(st.integers(0, 2), st.integers(0, 2**63), st.binary(max_size=40), st.integers(0, 9)), max_size=30
)


def stock(messages: list[tuple[int, int, bytes, int]]) -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=1 << 62, compression=CompressionType.ZSTD)
    writer.start(profile="some", library="some")
    channels: dict[int, int] = {}
    for sequence, (which, time_ns, data, flush) in enumerate(messages):
        if which not in channels:
            schema = writer.register_schema(f"name {which}", "protobuf", bytes([which]))
            channels[which] = writer.register_channel(f"topic {which}", "protobuf", schema)
        writer.add_message(channels[which], time_ns, data, time_ns, sequence)
        if flush == 0:
            writer.flush()
    writer.finish()
    return stream.getvalue()


def lean(messages: list[tuple[int, int, bytes, int]]) -> bytes:
    stream = io.BytesIO()
    file = McapFile(stream, "some")
    channels: dict[int, int] = {}
    for sequence, (which, time_ns, data, flush) in enumerate(messages):
        if which not in channels:
            channels[which] = file.register(f"topic {which}", f"name {which}", bytes([which]))
        file.add(channels[which], time_ns, data, sequence)
        if flush == 0:
            file.flush()
    file.finish()
    return stream.getvalue()


@settings(deadline=None)
@given(MESSAGES)
def test_the_file_has_the_bytes_of_the_stock_writer_s(messages: list[tuple[int, int, bytes, int]]) -> None:
    assert lean(messages) == stock(messages)
