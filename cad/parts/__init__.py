# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts: one printed part a file, the bought ones as envelopes in ``bought.py``."""
