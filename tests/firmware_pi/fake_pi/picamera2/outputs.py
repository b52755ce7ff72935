# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The class that takes frames."""


class Output:
    def __init__(self, pts: object = None) -> None:
        self.recording = False
