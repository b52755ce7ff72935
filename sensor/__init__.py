# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The sensor described once, in numbers, and the folders on disk that every part shares."""
