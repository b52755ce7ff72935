# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge accept`: is this sensor good?"""

from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._output import OutputFile, keep_inputs, print_table, refuse_unit_folder
from app._progress import progress
from app._seed import Seed
from app._sources import open_where, what_was_damaged, whole_frames
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic, write_json

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.calibration import Calibration
    from recon.geometry.unwarp import Unwarp
    from sensor.dataset import Dataset
    from sensor.unit import UnitCard
    from validation.acceptance.measurements import Acceptance
    from validation.report.certificate import Occasion

TIMED_FRAMES = 300
"""Read from a stream for its rate: twelve seconds of the slowest that passes with grade A."""


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    dataset: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="DATASET")],
    stream: Annotated[str | None, tyro.conf.arg(metavar="WHERE")] = None,
    out: Path | None = None,
    seed: Seed = 0,
    json: OutputFile = None,
    junit: OutputFile = None,
) -> int:
    """Measure a sensor against limits, each with its reason; exit 0 only if it passes.

    Judged are its errors on balls, per axis and with fewer lights; its lights (contrast, place,
    cross-talk, evenness, saturation, balance); noise and drift of the untouched gel; the lit,
    usable, covered and worn area of the pad; whether the camera has moved since the calibration;
    and whether the unwarped picture is straight. The worst grade decides: A, B or fail.

    Press the ball over the whole pad first. Presses from another day than the calibration's also
    show what has changed since.

    Frame rate, jitter, the longest gap, and times that do not increase are measured on frames with
    times: name a recording or a stream. Lost frames are counted by their numbers, too: name the
    sensor's own stream.

    Example: wedge accept units/wedge-001 presses/today --out certificate

    Args:
        unit: A unit folder, written by `wedge calibrate`.
        dataset: A dataset folder, or a name from `wedge data list`.
        stream: Frames of the unit with their times: an MCAP file, usb:0 or an address.
        out: Write the certificate here: index.html and certificate.pdf.
        seed: Seed for drawing pixels and for the intervals.
        json: Write measurements, limits and grade here as JSON.
        junit: Write them here as JUnit XML, one test case per limit.
    """
    from recon.calibration import load_calibration
    from validation.acceptance.limits import verdict
    from validation.datasets import dataset_folder
    from validation.report.certificate import Occasion, document, junit_xml
    from validation.report.certificate_files import certificate_files, write_certificate

    refuse_unit_folder(out)
    files = () if out is None else certificate_files(out)
    check_outputs(*files, json, junit)
    keep_inputs([unit, dataset, stream], [json, junit])
    calibration = load_calibration(unit)
    source = read_dataset(dataset_folder(dataset))
    card, name = calibration.card, source.card.name
    occasion = Occasion(
        dataset=name,
        dataset_sha256=source.sha256,
        judged=datetime.now(UTC).date().isoformat(),
        software=version("gelsight-wedge"),
    )
    found = _measured(calibration, source, stream, seed)
    _say(card, occasion, found)
    write_json(json, document(card, occasion, found))
    if junit:
        write_atomic(junit, junit_xml(card, name, found))
    if out is not None:
        write_certificate(out, card, occasion, found)
        print(f"Certificate: {', '.join(map(str, files))}")
    return 1 if verdict(found.values) == "fail" else 0


def _measured(
    calibration: "Calibration", source: "Dataset", stream: str | None, seed: int
) -> "Acceptance":
    from validation.acceptance.measurements import accept_unit

    times_ns, indices = _times(stream, calibration.unwarp)
    with progress(f"acceptance of {calibration.card.serial}") as show:
        return accept_unit(
            calibration,
            source,
            seed=seed,
            times_ns=times_ns,
            indices=indices,
            progress=lambda share: show(share, "measuring"),
        )


def _say(card: "UnitCard", occasion: "Occasion", found: "Acceptance") -> None:
    """Print every measurement, what is to be known of them, and the verdict."""
    from validation.acceptance.limits import verdict
    from validation.report.certificate import (
        WORDS,
        failures,
        lead,
        lines,
        not_measured,
        origin,
        remarks,
    )

    print_table(("measured", "value", "A", "B", "grade"), [line.cells for line in lines(found)])
    said = [*failures(found), *remarks(found), *not_measured(found), lead(card, occasion, found)]
    for sentence in (*said, origin(card, occasion)):
        print(sentence)
    print(f"{card.serial}: {WORDS[verdict(found.values)]}.")


def _times(where: str | None, unwarp: "Unwarp") -> tuple[list[int], list[int]]:
    """Times in ns of a stream's frames, and their numbers where it bears some."""
    if where is None:
        return [], []
    with open_where(where) as source:
        if not source.timed:
            raise WedgeError(
                f"{where} does not tell when its frames were taken: name an address, a camera such "
                "as usb:0, or what wedge record made of one of these."
            )
        times_ns: list[int] = []
        indices: list[int] = []
        with progress(f"times of {source.name}") as show:
            for frame, image in whole_frames(source, TIMED_FRAMES):
                if not times_ns:
                    _refuse_other_size(source.name, image, unwarp)
                times_ns.append(frame.time_ns)
                indices.append(frame.index)
                show(len(times_ns) / TIMED_FRAMES, "frames")
    if said := what_was_damaged(source):
        print(f"{where}: {said}")
    return times_ns, indices if source.counts.numbered else []


def _refuse_other_size(where: str, image: "Frame", unwarp: "Unwarp") -> None:
    try:
        unwarp.check_colored(image)
    except WedgeError as error:
        raise WedgeError(f"{where}: {error}") from error
