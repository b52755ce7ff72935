# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The `wedge` command: one module a subcommand, and no mathematics."""
