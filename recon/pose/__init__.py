# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the touched object is: from touches to poses ``T_sensor_object``."""
