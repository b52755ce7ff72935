# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge tune`: frames of the blank gel to the camera's gains and exposure."""

import http.client
import json as json_text
from base64 import b64encode
from collections.abc import Iterator
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import unquote, urlsplit

import tyro

from app._output import OutputFile, keep_inputs, print_table
from app._progress import Report, progress
from app._sources import is_dataset, open_where, what_was_damaged, whole_frames
from sensor.dataset import read_dataset
from sensor.errors import WedgeError, printable
from sensor.files import check_outputs, write_json
from sensor.unit import read_unit_card
from sensor.wire import SETTINGS_PATH

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from firmware_pi.settings import Settings
    from firmware_pi.tuning import Blank, Mask, Tuned
    from recon.stream import FrameSource

_ANSWER_WITHIN_S = 3.0
_LARGEST_ANSWER = 65_536
_SEEN_PX = 160
"""Of a frame's width, where it is looked at for a touch."""


def main(
    source: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")],
    settings: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None,
    unit: Annotated[Path | None, tyro.conf.arg(metavar="UNIT")] = None,
    frames: int = 120,
    json: OutputFile = None,
) -> None:
    """Find white-balance gains and exposure from frames of the blank gel.

    Nothing may touch the gel; frames in which something begins or stops touching it are refused.
    From a dataset, only the blank frames are read.

    The gains make the gel's mean colour grey. The exposure puts its brightest thousandth at 45 % of
    full scale in linear light, because a press makes it up to twice as bright. Flicker, moving
    bands, drift and saturation are measured, too.

    The new settings are written to FILE, completely or not at all. `gelsight-wedge apply` on the Pi
    takes them, except those that select the camera and its address, which stay the Pi's. Run the
    command again with the new settings until it says that they are settled: two or three runs.

    Example: wedge tune http://10.55.0.1:8080 --settings wedge.toml

    Args:
        source: The Pi's stream (http://HOST:PORT), or frames from it: a folder, a dataset, a video
            or an MCAP file.
        settings: The Pi's settings file, to read and to write; without it, nothing is written. A
            stream of the Pi's server reports its settings itself, frames do not.
        unit: Look only at the pad, where this unit folder says it is.
        frames: Number of frames to look at.
        json: Write measurements and settings here as JSON.
    """
    from firmware_pi.settings import Settings, read_settings, write_settings
    from firmware_pi.tuning import measure_blank, tune

    if frames < 1:
        raise WedgeError(f"--frames {frames} must be at least 1.")
    keep_inputs([source, settings, unit], [json])
    check_outputs(settings, json)
    pad = _pad(unit)
    kept = read_settings(settings) if settings is not None and settings.exists() else None
    with _open_blank(source) as opened, progress("frames of the blank gel") as show:
        blank = measure_blank(_images(opened, frames, pad, show), pad)
    if damaged := what_was_damaged(opened):
        print(f"{opened.name}: {damaged}")
    # What the stream says it has made the frames; the file may have been edited since.
    known, said = _settings_of_stream(source)
    if known is None and kept is not None:
        said.append(
            f"Assumed: the frames were taken with the settings in {settings}. If the Pi used "
            "others, the new ones are wrong: start from its own file."
        )
    elif known is None:
        said.append(
            "The settings that the frames were taken with are not known: the defaults are assumed. "
            "If they were others, give the Pi's file with --settings."
        )
    for sentence in said:
        print(sentence)
    before = known or kept or Settings()
    tuned = tune(before, blank)
    _print(blank, before, tuned)
    if settings is not None:
        write_settings(settings, tuned.settings)
        print(f"Settings: {settings}")
    document = {
        "blank": asdict(blank),
        "before": asdict(before),
        "settings": asdict(tuned.settings),
    }
    write_json(json, document | {"remarks": [*said, *tuned.remarks], "settled": tuned.settled})


def _pad(unit: Path | None) -> "Mask | None":
    """Where the pad is in the unit's raw frames; None for everywhere."""
    from firmware_pi.tuning import pad_mask

    if unit is None:
        return None
    card = read_unit_card(unit)
    width, height = card.frame_size_px
    return None if card.corners_px is None else pad_mask(card.corners_px, height, width)


def _open_blank(where: str) -> "FrameSource":
    """A source that may show the blank gel alone: of a dataset its blank frames."""
    if not is_dataset(where):
        return open_where(where)
    from recon.stream import FolderSource
    from validation.datasets import dataset_folder

    dataset = read_dataset(dataset_folder(where))
    return FolderSource(dataset.folder, dataset.card.background)


def _images(
    source: "FrameSource", count: int, pad: "Mask | None", show: Report
) -> "Iterator[NDArray[np.uint8]]":
    """The whole ones of a source's first frames.

    Raises:
        WedgeError: something touches the gel in one, and not in the first; or none is whole.
    """
    first: NDArray[np.uint8] | None = None
    for number, (frame, image) in enumerate(whole_frames(source, count), start=1):
        yield image  # whose size is looked at first
        first = image if first is None else first
        if _is_touched(first, image, pad):
            raise WedgeError(
                f"something touches the gel, as frame {frame.index + 1} of {source.name} differs "
                "from the first in one place: let go of it, and take only frames of the blank gel."
            )
        show(number / count, _counted(number))


def _is_touched(first: "NDArray[np.uint8]", image: "NDArray[np.uint8]", pad: "Mask | None") -> bool:
    """Whether a frame differs from the first in one place, as bands along its rows do not."""
    import numpy as np

    from recon.contact.disturbed import disturbed_mask

    step = max(1, image.shape[1] // _SEEN_PX)
    few = np.s_[::step, ::step]
    change = (image[few].astype(np.float32) - first[few]) / 255
    inside = np.ones(change.shape[:2], bool) if pad is None else pad[few]
    for row, lit in zip(change, inside, strict=True):
        if lit.any():
            row -= np.median(row[lit], axis=0)
    change[~inside] = 0
    return bool(disturbed_mask(change).any())


def _counted(frames: int) -> str:
    return "1 frame" if frames == 1 else f"{frames} frames"


def _settings_of_stream(source: str) -> "tuple[Settings | None, list[str]]":
    """The settings that a stream of this project's server was made with, and what to know of them.

    None of any other stream, nor of a server of another version, whose settings are not this
    version's.
    """
    from firmware_pi.settings import settings_of

    address = urlsplit(source)
    if address.scheme != "http" or address.hostname is None:
        return None, []
    asks = f"http://{address.netloc.rpartition('@')[2]}{SETTINGS_PATH}"
    try:
        answer = _get_json(address.hostname, address.port or 80, address.username, address.password)
    except (OSError, http.client.HTTPException) as error:
        return None, [f"{asks} gives no answer ({str(error) or type(error).__name__})."]
    except (ValueError, RecursionError):
        answer = None
    asked = answer.get("asked") if isinstance(answer, dict) else None
    if not isinstance(asked, dict):
        return None, [f"{asks} names no settings."]
    try:
        known = settings_of(asked)
    except WedgeError as error:
        return None, [
            f"The settings of the stream are of another version, and are not used: {error}"
        ]
    refused = answer.get("refused")
    said = "The Pi refused newer settings and keeps the old ones: " + printable(str(refused), 400)
    return known, [said] if refused else []


def _get_json(host: str, port: int, user: str | None, password: str | None) -> Any:

    headers = {}
    if user is not None:
        login = f"{unquote(user)}:{unquote(password or '')}"
        headers["Authorization"] = "Basic " + b64encode(login.encode()).decode()
    connection = http.client.HTTPConnection(host, port, timeout=_ANSWER_WITHIN_S)
    try:
        connection.request("GET", SETTINGS_PATH, headers=headers)
        answer = connection.getresponse()
        if answer.status != http.client.OK:
            return None
        return json_text.loads(answer.read(_LARGEST_ANSWER))
    finally:
        connection.close()


def _print(blank: "Blank", before: "Settings", tuned: "Tuned") -> None:
    rows = zip(("red", "green", "blue"), blank.mean, blank.brightest, blank.saturated, strict=True)
    print_table(
        ["colour", "mean light", "brightest 0.1 %", "saturated"],
        [[name, *(f"{share:.1%}" for share in shares)] for name, *shares in rows],
    )
    if blank.flicker is not None and blank.banding is not None and blank.drift is not None:
        print(
            f"Flicker {blank.flicker:.2%}, moving bands {blank.banding:.2%}, drift "
            f"{blank.drift:.2%} of the light, over {blank.frames} frames."
        )
    else:
        print(f"Flicker needs at least 3 frames; {_counted(blank.frames)} came.")
    changed = [
        [key.name, f"{getattr(before, key.name)}", f"{getattr(tuned.settings, key.name)}"]
        for key in fields(before)
        if getattr(before, key.name) != getattr(tuned.settings, key.name)
    ]
    if changed:
        print_table(["setting", "before", "now"], changed)
    for remark in tuned.remarks:
        print(f"- {remark}")
    first = "apply these settings" if changed else "correct what is reported above"
    print("Settled." if tuned.settled else f"Not settled: {first} and run again.")
