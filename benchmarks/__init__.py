# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge bench` runs, experiments beside it, and makers of what networks learn from."""
