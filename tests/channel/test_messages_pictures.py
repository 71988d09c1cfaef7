"""Pictures in messages: what is shown, sizes, and refusal of damaged ones."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image as Picture

from teleop_sim.channel.messages import BadMessage, Image, WebpImage, encode_image, encode_webp
from teleop_sim.channel.pictures import sample_picture


def ramp(height=60, width=80):
    """A colour gradient (h, w, 3)."""
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([3 * x, 4 * y, x + y], axis=-1).astype(np.uint8)


def rms(seen, shown):
    """Root mean square of the difference of two pictures."""
    return float(np.sqrt(np.mean((seen.astype(float) - shown) ** 2)))


def test_a_colour_jpeg_is_refused():
    sink = io.BytesIO()
    Picture.fromarray(ramp()).save(sink, "JPEG")
    with pytest.raises(BadMessage, match="mode RGB"):
        Image(80, 60, sink.getvalue())


def test_an_image_shows_what_was_seen():
    grey = ramp()[..., 0]
    image = encode_image(grey, 80, 60, 90)
    # Quality 90 on a smooth ramp: libjpeg's steps are at most 24 in one of 64 coefficients, an RMS of a few levels.
    assert image.pixels().shape == (60, 80)
    assert rms(image.pixels(), grey) < 3.0


def test_an_image_is_smaller_at_lower_quality_and_size_and_the_same_twice():
    full, poor, small = (encode_image(ramp(), *of) for of in ((80, 60, 80), (80, 60, 10), (20, 15, 80)))
    assert len(poor.encode()) < len(full.encode())
    assert len(small.encode()) < len(full.encode())
    assert full == encode_image(ramp(), 80, 60, 80)
    assert len(full.encode()) == 1 + len(full.coded)


@pytest.mark.parametrize("encode", [encode_image, encode_webp])
@settings(deadline=None)
@given(data=st.data())
def test_a_damaged_picture_is_a_picture_or_bad(encode, data):
    whole = encode(ramp(), 32, 24, 50)
    payload = bytearray(whole.encode())
    for at in data.draw(st.lists(st.integers(0, len(payload) - 1), max_size=4)):
        payload[at] = data.draw(st.integers(0, 255))
    try:
        image = type(whole).decode(bytes(payload))
        pixels = image.pixels()
    except BadMessage:
        return
    assert pixels.shape == (image.height, image.width)


def test_a_header_that_promises_gigapixels_is_bad():
    jpeg = encode_image(ramp(), 32, 24, 50).coded
    with pytest.raises(BadMessage, match="no sound JPEG"):
        Image(65535, 65535, jpeg.replace(b"\x00\x18\x00\x20", b"\xff\xff\xff\xff"))


def test_a_webp_header_that_promises_gigapixels_is_bad():
    webp = encode_webp(ramp(), 32, 24, 50).coded
    with pytest.raises(BadMessage, match="a WebP of 16383 x 16383 px"):
        WebpImage(16383, 16383, webp.replace(b"\x20\x00\x18\x00", b"\xff\x3f\xff\x3f"))


def test_webp_pictures_of_any_size_lose_less_at_more_bytes():
    scene = sample_picture(512, 272)
    for width, height in ((512, 272), (161, 85), (1, 1)):
        images = [encode_webp(scene, width, height, quality) for quality in (0, 50, 100)]
        assert {image.pixels().shape for image in images} == {(height, width)}
        assert images[1] == encode_webp(scene, width, height, 50)
        if width > 1:
            sizes = [len(image.encode()) for image in images]
            errors = [rms(image.pixels(), images[2].pixels()) for image in images]
            assert sizes == sorted(set(sizes))
            assert errors == sorted(set(errors), reverse=True)


def test_a_webp_shows_what_was_seen():
    grey = ramp()[..., 0]
    # Studio range has 220 levels for 256, so half a level is lost before the transform; then as the JPEG above.
    assert rms(encode_webp(grey, 80, 60, 90).pixels(), grey) < 3.0
