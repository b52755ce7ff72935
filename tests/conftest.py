# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What every test shares: the same examples at every run, none judged by the clock, one cache."""

import os
from pathlib import Path

import hypothesis

# Kept from run to run, as imports and compiling take a while; the user's own stays as it is.
os.environ["WEDGE_CACHE"] = str(Path(__file__).resolve().parents[1] / "build" / "test-cache")

hypothesis.settings.register_profile("same-every-run", derandomize=True, deadline=None)
hypothesis.settings.load_profile("same-every-run")
