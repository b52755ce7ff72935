# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Slopes to depth: Poisson's equation, slopes that are weighed, skin that is only pressed in."""
