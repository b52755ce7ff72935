# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""LED arrays and resistor board: currents, copper, fabrication files and the netlist's check."""
