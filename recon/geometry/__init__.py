# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The raw frame to the gel plane: lens, corners of the pad, and the scale in millimetres."""
