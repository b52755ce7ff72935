# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge replay`: a recording or a clip as if its sensor were here."""

import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._output import OutputFile, keep_inputs
from app._sources import open_where, refuse_few
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from sensor.interrupt import UntilInterrupted
from sensor.wire import STREAM_PATH

if TYPE_CHECKING:
    from recon.stream import FrameSource

CLIP_QUALITY = 90


def main(
    where: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")],
    sensor: str | None = None,
    speed: float = 1.0,
    repeat: bool = False,
    address: str = "127.0.0.1",
    port: int = 8081,
    json: OutputFile = None,
) -> None:
    """Send a recording, a video or a dataset over HTTP, at its own pace, as a sensor's Pi would.

    Every program that reads the sensor can then read the file: `wedge live`, the ROS 2 node, a
    robot's program. Frames carry the time at which they are sent. Frames that are not whole are
    counted and not sent; a JPEG is not decoded, so one that is damaged inside is sent. A dataset
    gives its blank frames, then its labelled presses or, if it has none, all its pictures, one per
    second.

    It ends with the file, or at Ctrl-C, SIGTERM or SIGHUP, which do not count as failures.

    Example: wedge replay touch.mcap --repeat

    Args:
        where: An MCAP file, a video, a folder of images or a dataset.
        sensor: Which sensor to replay, if the recording holds several, such as wedge1.
        speed: 2 plays twice as fast.
        repeat: Start again at the end.
        address: The one address to listen on.
        port: Port to listen on; 0 takes a free one.
        json: Write the numbers of frames here as JSON.
    """
    from recon.stream import McapSource, Paced

    check_outputs(json)
    keep_inputs([where], [json])
    refuse_few("speed", speed)
    if not hasattr(time, "CLOCK_BOOTTIME"):
        raise WedgeError(
            "wedge replay needs Linux, as it sends with the Pi's own server: run it there."
        )
    if not 0 <= port < 65536:
        raise WedgeError(f"--port {port} must lie between 0 and 65535.")
    source = McapSource(Path(where), sensor) if sensor else open_where(where)
    with source:
        if source.live:
            raise WedgeError(f"{where} is a camera, not a file: `wedge live` shows it.")
        paced = Paced(source, speed=speed, repeat=repeat)
        sent = _serve(paced, address, port)
    counts = source.counts
    if counts.remark:
        print(counts.remark, file=sys.stderr)
    if not sent and counts.corrupt:
        raise WedgeError(f"{where} holds no whole frame: {counts.corrupt} damaged.")
    if not sent:
        raise WedgeError(f"{where} holds no frame.")
    print(f"{sent} frames sent, corrupt {counts.corrupt}")
    write_json(json, {"sent": sent, "corrupt": counts.corrupt, "remark": counts.remark})


def _serve(source: "FrameSource", address: str, port: int) -> int:
    """Send the whole frames to whoever asks, and count the others; how many were sent."""
    from firmware_pi.newest import Newest
    from firmware_pi.server import StreamServer
    from recon.stream.jpeg import encode_jpeg, is_whole

    newest, sent = Newest(), 0
    flaws: set[str] = set()
    counts = source.counts
    try:
        server = StreamServer(address, port, newest, lambda: {"replay": source.name})
    except (ValueError, OverflowError) as error:
        raise WedgeError(f"--address {address} is not an address: {error}.") from error
    threading.Thread(target=server.serve_forever, daemon=True).start()
    shown = f"[{address}]" if ":" in address else address
    print(f"http://{shown}:{server.server_address[1]}{STREAM_PATH} (Ctrl-C ends)", flush=True)
    until = UntilInterrupted(source)
    try:
        for frame in until:
            if frame.index == 0 and flaws and not sent:
                break  # a whole round gave nothing
            flaw = frame.flaw
            if frame.jpeg is not None and not is_whole(frame.jpeg):
                flaw = f"{source.name} has frames that are not whole JPEGs."
            if flaw:
                counts.add_corrupt()
                if flaw not in flaws:
                    print(flaw, file=sys.stderr)
                flaws.add(flaw)
                continue
            jpeg = frame.jpeg or encode_jpeg(frame.image(), CLIP_QUALITY)
            newest.put(jpeg, time.clock_gettime_ns(time.CLOCK_BOOTTIME))
            sent += 1
    finally:
        source.close()
        server.stop()
    if until.interrupted:
        if not sent:
            until.give_up()
        print(file=sys.stderr)
    return sent
