# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge lens`: pictures of a chessboard to the lens of the camera that took them."""

from pathlib import Path
from typing import Annotated

import tyro

from app._output import OutputFile, print_table, refuse_unit_folder
from app._progress import progress
from sensor.dataset import CARD_FILE, LABELS_FILE, LENS_FILE, read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic

FAR_ENOUGH = 0.7
"""Below this share of the way to the frame's corners, it is said where the lens is a guess."""


def main(
    chessboards: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="CHESSBOARDS")],
    out: Path,
    picture: OutputFile = None,
) -> None:
    """Measure a camera's lens from pictures of a chessboard.

    A wide lens bends straight lines. Take about ten pictures of a chessboard with the sensor's
    camera, at the same resolution and focus as the presses, tilted differently and spread as far as
    the frame's corners. The whole board must be visible; its size is found, and the length of its
    squares does not matter.

    The lens is written as camera.toml to the folder of the ball presses. `wedge calibrate` finds it
    there, takes it out of every frame and keeps it in the unit. Measure the lens before circles are
    found: they lie in pixels of the frame without it.

    Example: wedge lens chessboards --out balls

    Args:
        chessboards: A folder of pictures of one chessboard.
        out: The folder that receives camera.toml: a dataset, or raw frames of presses; new or not.
        picture: Write a picture here (PNG): corners, how far they are off the lens, and what the
            lens does to straight lines.
    """
    from recon.geometry.lens import (
        board_misses_px,
        calibrate_lens,
        find_boards,
        seen_share,
        write_lens,
    )
    from recon.images import read_image

    written = out / LENS_FILE
    check_outputs(written, picture)
    if picture is not None and picture.resolve().parent in (out.resolve(), chessboards.resolve()):
        raise WedgeError(
            f"{picture} would be taken for one of the pictures beside it: write it elsewhere."
        )
    images = {path.name: read_image(path) for path in _pictures(chessboards)}
    height, width = next(iter(images.values())).shape[:2]
    _refuse_misfit(out, (width, height))
    with progress("corners of the chessboards") as show:
        boards = find_boards(images, progress=show)
    lens = calibrate_lens(boards)
    misses = board_misses_px(boards, lens)
    print_table(
        ["picture", "corners", "off the lens"],
        [
            [name, str(len(miss)), f"{(miss**2).sum(1).mean() ** 0.5:.2f} px"]
            for name, miss in misses.items()
        ],
    )
    if boards.left_out:
        print(f"No whole board of that size was found in {', '.join(boards.left_out)}.")
    if picture is not None:
        from validation.figures.lens import lens_figure
        from validation.figures.png import png_bytes

        write_atomic(picture, png_bytes(lens_figure(boards, lens)))
        print(f"Picture: {picture}")
    write_lens(written, lens)
    share = seen_share(boards, lens)
    print(
        f"The corners are {lens.rms_px:.2f} px off the lens (rms) and reach {share:.0%} of the way "
        "from its centre to the frame's farthest corner."
    )
    if share < FAR_ENOUGH:
        print("Beyond, the lens is a guess: take boards nearer to the frame's corners.")
    print(f"Lens: {written}")


def _pictures(folder: Path) -> list[Path]:
    from recon.picture_names import picture_names

    if not folder.is_dir():
        raise WedgeError(f"{folder} is not a folder: name one with pictures of a chessboard.")
    pictures = [folder / name for name in picture_names(folder)]
    if not pictures:
        raise WedgeError(f"{folder} holds no pictures: name a folder with some of a chessboard.")
    return pictures


def _refuse_misfit(out: Path, frame_size_px: tuple[int, int]) -> None:
    """Refuse a unit, whose estimator has learnt from frames through its own lens, and misfits.

    Raises:
        WedgeError: says what lies there and what to do: a unit; a dataset that has circles, or
            frames of another size.
    """
    from recon.presses import read_background

    refuse_unit_folder(out)
    if not (out / CARD_FILE).is_file():
        return
    dataset = read_dataset(out, labelled=False, within_balls=False)
    if dataset.labels:
        raise WedgeError(
            f"{out / LABELS_FILE} has circles, which lie in other pixels once the lens is known: "
            "remove that file, then find them again with `wedge label`."
        )
    height, width = read_background(dataset).shape[:2]
    if (width, height) != frame_size_px:
        raise WedgeError(
            f"the chessboards are pictures of {frame_size_px[0]}x{frame_size_px[1]} pixels, the "
            f"frames in {out} of {width}x{height}: take both at the same resolution."
        )
