# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the U-Nets that ship were taught: what they saw, and the commands that made their weights."""
