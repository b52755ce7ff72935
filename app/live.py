# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge live`: sensors in the browser."""

import errno
import socket
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._gel import flat_remarks
from app._progress import progress
from app._sources import refuse_nowhere, unit_of
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from sensor.files import check_outputs

if TYPE_CHECKING:
    from recon.calibration import Calibration

DEMO = "twin-standard"


def main(
    where: Annotated[
        tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="[WHERE...]")
    ] = (),
    unit: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="UNIT...")] = (),
    captures: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("captures"),
    address: str = "127.0.0.1",
    port: int = 8020,
    show: bool = False,
) -> None:
    """Show one or several sensors in the browser.

    The page shows the raw frame, the difference and depth as pictures, depth also as a surface that
    you can turn, the deepest point, the contact area, the touched object's pose with its
    uncertainty, how the gel's dots have moved, frames per second, latency and losses. One button
    takes a new background, another saves a frame: both write PNG files, for making a dataset. If a
    sensor fails, the page says why and retries; the others continue.

    A video, a recording or a dataset plays in a loop at its own pace; a dataset gives its blank
    frames, then its labelled presses or, if it has none, all its pictures, one per second. Without
    WHERE, presses of the rendered twin play, with a lookup table fitted to them.

    Example: wedge live http://10.55.0.1:8080 --unit units/wedge-001

    Args:
        where: http://HOST:PORT, usb:0, a video, a folder, a dataset or an MCAP file; several for
            several sensors.
        unit: The unit folder of each sensor, in the same order; without it, depth is not shown. A
            recording brings its own.
        captures: Folder for backgrounds and saved frames.
        address: The one address to listen on.
        port: Port of the page.
        show: Open a browser window too.
    """
    from recon.calibration import load_calibration

    if unit and not where:
        raise WedgeError(f"--unit {unit[0]} is given without a sensor: name the sensor, too.")
    if unit and len(unit) != len(where):
        more = "more" if len(unit) > len(where) else "fewer"
        raise WedgeError(f"there are {more} units than sensors: name one for each, or none.")
    for place in where:
        refuse_nowhere(place)
    check_outputs(captures / "background.png")
    _refuse_taken(address, port)
    try:
        from app.pages.live import serve
        from app.pages.watching import Watcher
    except ModuleNotFoundError as error:
        raise WedgeError(f"the page needs {error.name}: {how_to_install('live')}.") from error

    units: list[Calibration | None]
    if where:
        units = [load_calibration(folder) for folder in unit] or [_inside(w) for w in where]
    else:
        where, units = (DEMO,), [_demo_unit()]
    for known in filter(None, units):
        for remark in flat_remarks(known):
            print(remark, file=sys.stderr)
    folders = [captures / (f"wedge{i}" if len(where) > 1 else "") for i in range(len(where))]
    watchers = [Watcher(*given) for given in zip(where, units, folders, strict=True)]
    shown = f"[{address}]" if ":" in address else address
    with suppress(KeyboardInterrupt):  # so it ends, as said
        print(f"Open http://{shown}:{port} and end with Ctrl-C.", flush=True)
        serve(watchers, address, port, show=show)


def _inside(where: str) -> "Calibration | None":
    """The unit that a recording brings."""
    from recon.calibration import load_calibration
    from recon.stream import is_recording

    if not is_recording(where) or not Path(where).is_file():
        return None
    with unit_of(where, None) as folder:
        return None if folder is None else load_calibration(folder)


def _demo_unit() -> "Calibration":
    """A unit of the rendered twin, by the estimator that needs no training."""
    from recon.calibration import calibrate
    from recon.presses import read_presses
    from validation.datasets import dataset_folder

    dataset = read_dataset(dataset_folder(DEMO))
    with progress("a unit for the twin") as show:
        return calibrate(
            dataset,
            read_presses(dataset),
            estimator="table",
            serial="rendered twin",
            created="2026-01-01",
            metrics={},
            seed=0,
            progress=show,
        )


def _refuse_taken(address: str, port: int) -> None:
    """Refuse an address or a port that cannot be listened at.

    Raises:
        WedgeError: says which.
    """
    if not 0 < port < 65536:
        raise WedgeError(f"--port {port} must lie between 1 and 65535.")
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    try:
        socket.getaddrinfo(address, port, family)
    except socket.gaierror as error:
        raise WedgeError(
            f"--address {address} is not an address: name one of this computer's, such as "
            "127.0.0.1, or 0.0.0.0 for all."
        ) from error
    try:
        socket.create_server((address, port), family=family).close()
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            raise WedgeError(
                f"--address {address} is not one of this computer's: name one, such as "
                "127.0.0.1, or 0.0.0.0 for all."
            ) from error
        reason = str(error.strerror).partition(" (")[0]  # Python adds the address once more
        raise WedgeError(
            f"cannot listen on {address} port {port} ({reason}): another program may be using it; "
            "choose another with --port."
        ) from error
