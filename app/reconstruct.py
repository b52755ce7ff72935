# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge reconstruct`: images to depth in millimetres."""

import io
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app._frames import read_checked
from app._output import (
    OutputFile,
    keep_inputs,
    output_names,
    print_table,
    refuse_unit_folder,
)
from app._progress import progress
from app._remarks import background_remarks, doubt_remarks
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic, write_json

if TYPE_CHECKING:
    import numpy as np

    from recon.pipeline import Reconstruction

HEADINGS = ("image", "deepest [mm]", "contact [mm²]", "border", "markers", "depth map")
BORDERS = {"dirichlet": "held", "neumann": "free"}


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    image: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="IMAGE...")],
    out: Path,
    background: str | None = None,
    json: OutputFile = None,
) -> None:
    """Reconstruct depth from images of a calibrated unit.

    For every image, OUT receives NAME.npy (float32, mm, rows and columns of the unwarped frame)
    and NAME.png (a picture with a scale bar and a colour bar). If the unit's lights show only one
    slope, NAME-doubt.png shows the expected error of the other, inferred one. All images are
    checked before the first file is written.

    The table that is printed gives the deepest point, with its standard deviation if the estimator
    knows its own errors (`default` does). The border is "held" if depth is fixed to zero at the
    frame's border, or "free" if a contact reaches it; untouched gel is then at zero.

    Example: wedge reconstruct units/wedge-001 press.png --out depth

    Args:
        unit: A unit folder, written by `wedge calibrate`.
        image: Frames of that unit: image files, or frames.npz#17 for one of many.
        out: The folder for the depth maps; created if missing.
        background: A blank frame taken today; by default the unit's own.
        json: Write the deepest points, their standard deviations, contact areas and borders here as
            JSON, with remarks on depth that cannot be trusted.
    """
    from recon.calibration import load_calibration
    from recon.pipeline import Reconstructor
    from recon.plausible import cut_word, doubt_word

    if not image:
        raise WedgeError("no image was named: wedge reconstruct UNIT IMAGE... --out DIR.")
    calibration = load_calibration(unit)
    unwarp = calibration.unwarp
    blank = None if background is None else read_checked(background, unwarp)
    reconstruct = Reconstructor(calibration, blank)
    infers = calibration.card.missing_axis == "network"
    ends = (".npy", ".png", "-doubt.png") if infers else (".npy", ".png")
    names = output_names(image, ends)
    written = [out / f"{name}{end}" for name in names for end in ends]
    refuse_unit_folder(out)
    check_outputs(*written, json)
    keep_inputs([unit, *image, background], [*written, json])
    with progress("reconstruction") as show:
        for done, name in enumerate(image, start=1):
            read_checked(name, unwarp)
            show(0.3 * done / len(image), "checking images")
        rows: list[dict[str, Any]] = []
        for done, (name, stem) in enumerate(zip(image, names, strict=True), start=1):
            result = reconstruct(read_checked(name, unwarp))
            _write(out, stem, result)
            remark = doubt_word(result, calibration) or cut_word(result, calibration)
            rows.append(_row(name, result, remark, out / f"{stem}.npy"))
            show(0.3 + 0.7 * done / len(image), "reconstructing")
    print_table(HEADINGS, map(_cells, rows))
    said = background_remarks(calibration, blank, str(background))
    said += doubt_remarks([(row["image"], row["remark"] or "") for row in rows])
    for sentence in said:
        print(sentence, file=sys.stderr)
    write_json(json, {"unit": str(unit), "images": rows, "remarks": said})


def _write(out: Path, stem: str, result: "Reconstruction") -> None:
    """The depth map as numbers and as a picture, and the picture of its doubt where it has one."""
    import numpy as np

    from validation.figures.depth_map import depth_figure, doubt_figure
    from validation.figures.png import png_bytes

    stream = io.BytesIO()
    np.save(stream, result.depth_mm)
    write_atomic(out / f"{stem}.npy", stream.getvalue())
    figure = depth_figure(result.depth_mm, result.mm_per_px, title=stem)
    write_atomic(out / f"{stem}.png", png_bytes(figure))
    if result.doubt is not None:
        figure = doubt_figure(result.doubt, result.mm_per_px, title=f"{stem}: doubt")
        write_atomic(out / f"{stem}-doubt.png", png_bytes(figure))


def _row(name: str, result: "Reconstruction", remark: str, depth: Path) -> dict[str, Any]:
    """What is said of an image in JSON."""
    return {
        "image": name,
        "deepest_mm": result.deepest_mm,
        "deepest_sigma_mm": None if remark else _sigma_of_deepest_mm(result),
        "contact_mm2": result.contact_mm2,
        "boundary": result.boundary,
        "markers": result.markers,
        "depth": str(depth),
        "doubt": None if result.doubt is None else _within(result.doubt, result.contact),
        "remark": remark or None,
    }


def _cells(row: dict[str, Any]) -> list[str]:
    """A row of the table."""
    return [
        str(row["image"]),
        _deepest_cell(row["deepest_mm"], row["deepest_sigma_mm"]),
        f"{row['contact_mm2']:.2f}",
        BORDERS[row["boundary"]],
        str(row["markers"]),
        str(row["depth"]),
    ]


def _deepest_cell(deepest_mm: float, sigma_mm: float | None) -> str:
    """The deepest point, with its standard deviation where that is known."""
    return f"{deepest_mm:.3f}" + ("" if sigma_mm is None else f" ± {sigma_mm:.3f}")


def _sigma_of_deepest_mm(result: "Reconstruction") -> float | None:
    import numpy as np

    from recon.cloud import expected_error_mm

    if result.slope_error is None or not result.contact.any():
        return None
    deepest = np.where(result.contact, result.depth_mm, -np.inf).argmax()
    return float(expected_error_mm(result).flat[deepest])


def _within(doubt: "np.ndarray", contact: "np.ndarray") -> float:
    """Mean doubt inside the contact, mm/mm; 0 where nothing touches."""
    return float(doubt[contact].mean()) if contact.any() else 0.0
