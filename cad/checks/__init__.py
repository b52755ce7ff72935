# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured on a design before it is cut: one check a module, each with its figure."""

from cad.checks.result import Result

__all__ = ["Result"]
