# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The slope that one or two lights leave unseen: inferred, by a network and without."""
