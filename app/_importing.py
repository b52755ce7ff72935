# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge data import` and `wedge calibrate` share: someone's folder to a dataset folder."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import dist
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from app._lights import lights_remark, with_designed_lights
from app._output import command_line, print_left_out
from app._pad import proportion_remark, refuse_other_pad
from app._progress import progress
from app._workers import process_pool
from sensor.dataset import CARD_FILE, LABELS_FILE, LENS_FILE, read_dataset, write_card
from sensor.errors import WedgeError
from sensor.files import check_new_folder, new_folder
from sensor.toml import Pair

if TYPE_CHECKING:
    from recon.geometry.caliper import Scale
    from sensor.dataset import BallLabel, DatasetCard
    from sensor.design import Wedge
    from validation.importers.calibrations import Found
    from validation.importers.raw_frames import Prepared


def import_source(
    source: Path,
    out: Path,
    *,
    ball_radius_mm: float | None,
    mm_per_px: float | None,
    pad_size_mm: Pair,
    design: "Wedge | None" = None,
) -> None:
    """Write a dataset folder from frames or from another tool's calibration, and say what is in it.

    Args:
        source: a folder of frames, or what another tool keeps.
        out: the dataset folder; new or empty.
        ball_radius_mm: of the ball, where the source does not say it.
        mm_per_px: of frames that show the gel plane, where it is known.
        pad_size_mm: of a pad that nothing measures.
        design: whose pad a caliper's pictures must show, and whose lights the presses, where one is
            named.

    Raises:
        WedgeError: the source is neither, something is missing in it, or ``out`` is kept.
    """
    for name, value in (("ball-radius-mm", ball_radius_mm), ("mm-per-px", mm_per_px)):
        if value is not None and not 0 < value < 1e3:
            raise WedgeError(f"--{name} {value:g} must be above 0 and below 1000.")
    if not source.exists():
        raise WedgeError(f"{source} does not exist: name a folder of frames or a data pack.")
    if (source / CARD_FILE).is_file():
        raise WedgeError(f"{source} is already a dataset: use it as it is, or copy it.")
    check_new_folder(out)
    found = _usable_calibration(source, mm_per_px)
    if found is not None:
        _import_calibration(found, source, out, mm_per_px, ball_radius_mm)
    else:
        _import_frames(source, out, mm_per_px, ball_radius_mm, pad_size_mm, design)
    card = read_dataset(out).card
    if remark := lights_remark(card.lights_deg, design):
        print(remark)
        write_card(out / CARD_FILE, with_designed_lights(card, design))
    print(f"Dataset: {out}")


def _usable_calibration(source: Path, mm_per_px: float | None) -> "Found | None":
    """Another tool's circles; ``None``, and a line on stdout, where they tell nothing."""
    from validation.importers.calibrations import TEXTS, find_calibration

    found = find_calibration(source)
    if found is not None and not found.labels:
        print(f"No circle in the text files fits: the pictures are searched. {found.left_aside}")
        return None
    if found is not None and found.kind == TEXTS and mm_per_px is None:
        print(
            "The circles in text files are ignored, as it is not known in which pixels they lie: "
            "the pictures are searched. To use them, run `wedge data import` with --mm-per-px."
        )
        return None
    return found


def _import_calibration(
    found: "Found",
    source: Path,
    out: Path,
    mm_per_px: float | None,
    ball_radius_mm: float | None,
) -> None:
    from validation.importers.calibrations import import_calibration

    if mm_per_px is None:
        raise WedgeError(
            f"{source} does not state its scale: give it to `wedge data import` with --mm-per-px"
            " (gs_sdk's own settings call it ppmm)."
        )
    with (
        progress(f"importing {source.name}"),
        new_folder(out) as folder,
        _blamed_on(source, folder),
    ):
        left_out = import_calibration(
            found, source, folder, mm_per_px=mm_per_px, ball_radius_mm=ball_radius_mm
        )
    _say_refitted(found.kind, found.labels, read_dataset(out).labels)
    print_left_out(left_out)
    if found.left_aside:
        print(found.left_aside)


def _import_frames(
    source: Path,
    out: Path,
    mm_per_px: float | None,
    ball_radius_mm: float | None,
    pad_size_mm: Pair,
    design: "Wedge | None",
) -> None:
    from validation.importers.raw_frames import import_raw_frames

    if not source.is_dir():
        raise WedgeError(
            f"{source} is not calibration data of a known kind: `wedge data --help` lists them."
        )
    if ball_radius_mm is None:
        raise WedgeError("the ball's size is missing: give --ball-radius-mm, half its diameter.")
    with (
        progress(f"importing {source.name}") as show,
        process_pool() as pool,
        new_folder(out) as folder,
        _blamed_on(source, folder),
    ):
        prepared = import_raw_frames(
            source,
            folder,
            pool,
            ball_radius_mm=ball_radius_mm,
            pad_size_mm=pad_size_mm,
            mm_per_px=mm_per_px,
            check=lambda card: refuse_other_pad(
                card.pad_size_mm,
                design,
                f"{source}, by the caliper's pictures,",
                "correct the caliper's gap",
            ),
            progress=show,
        )
    print_left_out(prepared.left_out)
    _say(prepared, out, _flat_scale(prepared.card, mm_per_px, pad_size_mm))


@contextmanager
def _blamed_on(source: Path, folder: Path) -> Iterator[None]:
    """Name the source in errors, not the passing folder into which it is copied, or its labels."""
    try:
        yield
    except WedgeError as error:
        said = str(error).replace(str(folder / LABELS_FILE), str(source))
        raise WedgeError(said.replace(str(folder), str(source))) from error


def _flat_scale(card: "DatasetCard", given_mm_per_px: float | None, pad_size_mm: Pair) -> str:
    """Where the scale of frames that show neither a pad nor a caliper is from."""
    if given_mm_per_px is not None:
        return f"Scale as given: {given_mm_per_px:g} mm/px."
    return (
        "No picture of a caliper: the frame is taken to be as long as the pad, "
        f"{pad_size_mm[0]:g} mm, so the scale is {card.mm_per_px[0]:.5f} mm/px; set another with "
        "`wedge data import --mm-per-px`."
    )


def _scale_words(card: "DatasetCard", scale: "Scale", pictures: int) -> str:
    """What a caliper's pictures tell, the doubt beside each axis that they measure."""
    pitches = zip("xy", scale.mm_per_px, scale.sigma_mm_per_px, strict=True)
    doubts = [0.0 if axis == scale.unseen else sigma / mm for axis, mm, sigma in pitches]

    def told(sides: Pair, digits: int) -> tuple[str, ...]:
        return tuple(
            f"{side:.{digits}f}{f' ± {doubt * side:.{digits}f}' if doubt else ''}"
            for side, doubt in zip(sides, doubts, strict=True)
        )

    words = f"Scale from {scale.gaps} of {pictures} pictures of the caliper:"
    if card.pad_size_mm is None:
        x, y = told(scale.mm_per_px, 5)
        return f"{words} {x} mm/px along x and {y} mm/px along y."
    length, width = told(card.pad_size_mm, 2)
    return f"{words} the pad is {length} mm long and {width} mm wide."


def _say(prepared: "Prepared", out: Path, flat_scale: str) -> None:
    """What was found out, in sentences that say what to doubt."""
    from recon.labels.press_doubts import is_doubtful

    card, scale = prepared.card, prepared.scale
    seen = card.corners_px or prepared.left_aside
    places = ", ".join(f"({x:.1f}, {y:.1f})" for x, y in seen or ())
    if seen is None:
        print("No corners of a pad in the blank frame: the frames are taken to show the gel plane.")
    elif card.corners_px is None:
        print(
            f"The blank frame seems to show a pad with corners at {places} px: they are ignored, "
            "as --mm-per-px is the scale of frames that show the gel plane."
        )
    else:
        print(f"Corners of the pad, found in the blank frame: {places} px.")
    if prepared.lens:
        print(f"The lens is read from the {LENS_FILE} in the folder of the frames.")
    if scale is not None:
        print(_scale_words(card, scale, prepared.caliper))
        if remark := proportion_remark(scale.unseen):
            print(remark)
    elif card.pad_size_mm is not None:
        length, width = card.pad_size_mm
        print(
            f"No picture of a caliper: the pad is taken to be {length:g} x {width:g} mm. Press a "
            "caliper's jaws 5 mm apart, along and across, and name the pictures 5mm-1.jpg, ..."
        )
    else:
        print(flat_scale)
    found = {x.file for x in prepared.labels}
    without = [name for name in prepared.presses if name not in found]
    doubtful = [x for x in prepared.labels if is_doubtful(x)]
    print(
        f"Balls found in {len(found)} of {len(prepared.presses)} pictures, "
        f"{len(doubtful)} of them doubtful."
    )
    if without:
        print(f"None in {', '.join(without[:5])}{' ...' if len(without) > 5 else ''}.")
    if card.corners_px is not None and len(without) > len(found):
        print(
            "With these corners, most pictures show no ball: check that they are the pad's with "
            f"`{command_line('label', out, '--corners')}`; if the frames show the gel plane "
            "itself, use `wedge data import` with --mm-per-px."
        )


def _say_refitted(
    kind: str, theirs: "Sequence[BallLabel]", refitted: "Sequence[BallLabel]"
) -> None:
    """How far refitting to the shading took the circles from where somebody drew them."""
    from recon.labels.press_doubts import is_doubtful

    drawn = {label.file: label for label in theirs}
    pairs = [(drawn[label.file], label) for label in refitted]
    moved_px = median(dist(a.center_px, b.center_px) for a, b in pairs)
    times = median(b.contact_radius_px / a.contact_radius_px for a, b in pairs)
    doubtful = sum(map(is_doubtful, refitted))
    print(
        f"{kind}: {len(theirs)} labelled presses. Their circles were refitted to the ball's "
        f"shading: in the median, {moved_px:.1f} px away and {times:.2f} times as wide; "
        f"{doubtful} are doubtful."
    )
