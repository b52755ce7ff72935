# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots on the gel: found, followed through a press, and filled in where they hide the slope."""
