# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The one exception that a user may see."""


class WedgeError(Exception):
    """A fault that the user can correct, in one sentence: what, where, what to do.

    The command line prints it without a traceback and exits with status 2.
    """
