# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The way from JPEG bytes to depth that keeps pace with the camera."""

from recon.fast.reconstructor import FastReconstructor, Touch

__all__ = ["FastReconstructor", "Touch"]
