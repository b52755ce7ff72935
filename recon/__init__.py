# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""From a camera frame to gradients, depth and contact, and the calibration of one unit."""
