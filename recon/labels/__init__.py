# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ball presses to labels: which frames are good, where the ball touched, mended circles kept."""
