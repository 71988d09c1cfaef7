"""The catalogue of messages as a page: ``python -m teleop_sim.channel.catalogue``; a test compares it with the docs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from teleop_sim.channel.messages import MESSAGES, Message, encode_image, encode_voxels, encode_webp
from teleop_sim.channel.pictures import sample_picture
from teleop_sim.channel.voxels import sample_points

PICTURE_SIZES = ((1024, 544), (512, 272), (320, 170), (160, 85))
QUALITIES = (20, 50, 80)
VOXELS_M = (0.01, 0.02, 0.05, 0.1)
RATES_BPS = (380, 3_800, 50_000)
"""Rates of the tables: the paper's 380 bit/s, SRC's slow downlinks."""


def catalogue_markdown() -> str:
    """All messages, then sizes of pictures and clouds. Sizes that hang on a compressor's build are marked with a ~."""
    return "\n".join([*_messages(), "", *_pictures(), "", *_clouds(), ""])


def _messages() -> Iterator[str]:
    head = ("Topic", "Direction", "Fields", "Payload", "Resolution", "Bytes of an example", "Source")
    rows = (
        (
            f"`{topic}`",
            kind.direction,
            ", ".join(f"`{name}`" for name in kind.__match_args__) or "none",
            kind.layout,
            kind.resolution,
            _size(kind.example()),
            kind.source,
        )
        for topic, kind in sorted(MESSAGES.items(), key=_place)
    )
    return _table(head, rows)


def _place(entry: tuple[str, type[Message]]) -> tuple[bool, bytes]:
    """Up first, then by first byte, text last."""
    return entry[1].direction != "up", entry[1].marks


def _pictures() -> Iterator[str]:
    yield "Pictures: bytes of a drawn scene (`pictures.sample_picture`), grey, by quality.\n"
    head = ("Size [px]", *(f"{name} {quality}" for name in ("JPEG", "WebP") for quality in QUALITIES))
    scene = sample_picture(*PICTURE_SIZES[0])
    rows = (
        (
            f"{width} x {height}",
            *(_size(encode(scene, width, height, q)) for encode in (encode_image, encode_webp) for q in QUALITIES),
        )
        for width, height in PICTURE_SIZES
    )
    yield from _table(head, rows)


def _clouds() -> Iterator[str]:
    yield "Clouds: a drawn console (`voxels.sample_points`), by voxel size; seconds on the wire without headers.\n"
    head = ("Voxel [cm]", "Voxels", "Bytes", *(f"s at {rate:,} bit/s" for rate in RATES_BPS))
    rows = []
    for voxel_m in VOXELS_M:
        cloud = encode_voxels(sample_points(), voxel_m)
        bits = 8 * len(cloud.encode())
        times = (f"~{bits / rate:.2f}" for rate in RATES_BPS)
        rows.append((f"{100 * voxel_m:g}", f"{len(cloud.centres_m()):,}", _size(cloud), *times))
    yield from _table(head, rows)


def _size(message: Message) -> str:
    return f"{'~' if message.packed else ''}{len(message.encode()):,}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield f"| {' | '.join(row)} |"


if __name__ == "__main__":
    print(catalogue_markdown())
