# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays to matplotlib figures, one module a picture; nothing here computes a result."""
