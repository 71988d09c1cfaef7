"""Named random streams: a new consumer never shifts the others.

``stream(seed, replicate, "link.up.loss")`` is keyed with CRC-32 of the name, because ``hash()`` of a
string changes between processes.
"""

from __future__ import annotations

from zlib import crc32

import numpy as np


def stream(seed: int, replicate: int, name: str) -> np.random.Generator:
    """An independent generator for one named purpose of one replicate.

    Args:
        seed: of the experiment, zero or more.
        replicate: number of the repetition, zero or more, below 2**32; all cells of a sweep share it.
        name: dotted purpose, such as ``"operator.timing"``.

    Source: ``numpy.random.SeedSequence`` guarantees independence of streams with different keys.

    """
    return np.random.default_rng(np.random.SeedSequence([seed, replicate, crc32(name.encode())]))
