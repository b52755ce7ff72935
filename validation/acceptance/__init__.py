# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Is this sensor good? Measurements of one unit, and limits as data."""
