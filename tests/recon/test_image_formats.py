# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The same picture in every format that labs write, and nothing less than it."""

import struct

import cv2
import numpy as np
import pytest
from PIL import ExifTags, Image

from recon.images import read_image
from sensor.dataset import IMAGES
from sensor.errors import WedgeError
from tests.synthetic import digitized, gradient_of, shaded
from tests.written import write_anew

PICTURE = digitized(shaded(gradient_of((50.0, 40.0, 15.0)))[24:56:4, 32:80:4])


@pytest.mark.parametrize("ending", [x for x in IMAGES if not x.startswith(".jp")])
def test_a_picture_is_the_same_in_every_file(tmp_path, ending):
    path = tmp_path / f"frame{ending}"
    cv2.imwrite(str(path), PICTURE[..., ::-1])
    np.testing.assert_array_equal(read_image(path), PICTURE)
    np.testing.assert_array_equal(read_image(str(path)), PICTURE)
    Image.fromarray(PICTURE).convert("RGBA").save(path)
    np.testing.assert_array_equal(read_image(path), PICTURE)


@pytest.mark.parametrize("ending", [".png", ".tif"])
@pytest.mark.parametrize("scale", [16, 257], ids=["of 12 bits", "of 16 bits"])
@pytest.mark.parametrize("channels", [3, 4])
def test_colours_of_16_bits_are_refused(tmp_path, ending, scale, channels):
    path = tmp_path / f"frame{ending}"
    deep = np.dstack([PICTURE, PICTURE[..., 0]])[..., :channels].astype(np.uint16) * scale
    cv2.imwrite(str(path), deep)
    with pytest.raises(
        WedgeError, match=rf"frame\{ending} has 16 bits per colour: write it with 8"
    ):
        read_image(path)


def test_a_tiff_of_several_pictures_is_refused(tmp_path):
    path, picture = tmp_path / "frame.tif", Image.fromarray(PICTURE)
    picture.save(path, save_all=True, append_images=[picture])
    with pytest.raises(WedgeError, match=r"frame\.tif holds several pictures"):
        read_image(path)


@pytest.mark.parametrize(
    ("mode", "ending"),
    [
        ("L", ".png"),
        ("LA", ".png"),
        ("L", ".jpg"),
        ("CMYK", ".jpg"),
        ("L", ".bmp"),
        ("L", ".tif"),
        ("CMYK", ".tif"),
        ("LAB", ".tif"),
        ("YCbCr", ".tif"),
    ],
)
def test_other_colours_than_red_green_and_blue_are_refused(tmp_path, mode, ending):
    Image.fromarray(PICTURE).convert(mode).save(tmp_path / f"frame{ending}")
    with pytest.raises(WedgeError, match=rf"mode {mode}\): red, green and blue are needed"):
        read_image(tmp_path / f"frame{ending}")


@pytest.mark.parametrize("ending", [".png", ".bmp", ".tif"])
def test_a_palette_gives_its_colours_and_alpha_takes_none(tmp_path, ending):
    picture, path = Image.fromarray(PICTURE), tmp_path / f"frame{ending}"
    half_seen = picture.copy()
    half_seen.putalpha(100)
    half_seen.save(path)
    np.testing.assert_array_equal(read_image(path), PICTURE)
    few = picture.quantize(16)
    few.save(path)
    np.testing.assert_array_equal(read_image(path), np.asarray(few.convert("RGB")))


@pytest.mark.parametrize("ending", [".bmp", ".tif"])
def test_a_changed_byte_gives_a_frame_or_a_sentence(tmp_path, ending):
    path = tmp_path / f"frame{ending}"
    Image.fromarray(PICTURE).save(path)
    whole = path.read_bytes()
    for place in range(len(whole)):
        changed = bytearray(whole)
        changed[place] ^= 0x55
        write_anew(path, changed)
        try:
            assert read_image(path).dtype == np.uint8
        except WedgeError as error:
            assert path.name in str(error)


@pytest.mark.parametrize("side", [10_000, 60_000])
def test_a_bitmap_that_claims_to_be_vast_is_refused_unread(tmp_path, side):
    path = tmp_path / "vast.bmp"
    Image.fromarray(PICTURE).save(path)
    content = bytearray(path.read_bytes())
    content[18:26] = struct.pack("<ii", side, side)
    path.write_bytes(content)
    with pytest.raises(WedgeError, match=r"vast\.bmp cannot be decoded.*decompression bomb"):
        read_image(path)


@pytest.mark.parametrize("ending", [".jpg", ".png", ".tif"])
@pytest.mark.parametrize("mark", [1, 3, 6, 0])
def test_a_picture_that_is_marked_to_be_shown_turned_is_refused(tmp_path, ending, mark):
    """As OpenCV and browsers turn it and others do not: circles would lie elsewhere."""
    path, exif = tmp_path / f"frame{ending}", Image.Exif()
    exif[ExifTags.Base.Orientation] = mark
    Image.fromarray(PICTURE).save(path, exif=exif)
    if mark in (0, 1):
        assert read_image(path).shape == PICTURE.shape
        return
    with pytest.raises(WedgeError, match=rf"frame\{ending} .*\(EXIF orientation {mark}\)"):
        read_image(path)
