# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What LeRobot's command line takes for a camera of type ``gelsight_wedge``."""

from dataclasses import dataclass

from lerobot.cameras.configs import CameraConfig, ColorMode


@CameraConfig.register_subclass("gelsight_wedge")
@dataclass(kw_only=True)
class GelSightWedgeCameraConfig(CameraConfig):
    """Where the frames come from, in addition to LeRobot's ``fps``, ``width`` and ``height``.

    Attributes:
        source: A stream's address, `usb:0`, or what plays at its own pace: a folder of images, a
            dataset folder, a video or a recording.
        color_mode: Order of the channels.
    """

    source: str = "http://10.55.0.1:8080"
    color_mode: ColorMode = ColorMode.RGB
