# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gel is touched: the mask, its patches, cast shadows, and the mask's network."""
