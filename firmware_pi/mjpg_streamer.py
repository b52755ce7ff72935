# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's server: mjpg_streamer's command line from the same settings.

It needs the legacy camera stack, which no system of today has; docs/howto/pi.md says where it runs.
Its help does not name -awbgainR, -awbgainB and -timestamp; plugins/input_raspicam/input_raspicam.c
does. With -awb off, a missing gain gives black pictures, and one mistyped is ignored in silence:
so both are always given.
"""

import ipaddress

from firmware_pi.settings import Settings


def mjpg_streamer_command(settings: Settings, credentials: str | None = None) -> list[str]:
    """The words of the command.

    Automatic exposure stays on and ``ev`` corrects it, as in the paper; the other ways to hold the
    exposure came later.

    Args:
        settings: The camera's settings.
        credentials: "user:password", which every user of the Pi can see on its command line.
    """
    camera = " ".join(
        [
            f"input_raspicam.so -x {settings.width_px} -y {settings.height_px}",
            f"-fps {settings.rate_hz:.0f} -quality {settings.jpeg_quality} -timestamp",
            f"-awb off -awbgainR {settings.red_gain:.3f} -awbgainB {settings.blue_gain:.3f}",
            f"-ev {settings.ev}",
        ]
    )
    output = f"output_http.so -l {settings.address} -p {settings.port} -n"
    if credentials is not None:
        output += f" -c {credentials}"
    return ["mjpg_streamer", "-i", camera, "-o", output]


def only_the_pi_reaches(settings: Settings) -> bool:
    """Whether the server would listen where no other computer can ask it."""
    return ipaddress.ip_address(settings.address).is_loopback
