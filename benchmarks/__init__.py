# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge bench` runs: every figure of the performance page, measured."""
