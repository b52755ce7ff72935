# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The GelSight Wedge as a LeRobot camera: importing this registers the type ``gelsight_wedge``."""

from lerobot_camera_gelsight_wedge.config_gelsight_wedge_camera import GelSightWedgeCameraConfig
from lerobot_camera_gelsight_wedge.gelsight_wedge_camera import GelSightWedgeCamera

__all__ = ["GelSightWedgeCamera", "GelSightWedgeCameraConfig"]
