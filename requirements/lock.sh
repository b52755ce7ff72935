#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# Rewrites requirements/lock.txt for Linux and macOS, Python 3.11 and later, after ./wedge has run.
# More arguments go to uv: `--upgrade`, or `--upgrade-package NAME`.
set -eu
cd "$(dirname "$0")/.."
exec .venv/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
  --only-binary :all: --no-annotate --custom-compile-command requirements/lock.sh \
  --extra cad --extra simulation --extra cluster --extra live --extra track --extra test \
  --extra docs pyproject.toml requirements/torch-needs.in requirements/installer.in \
  --output-file requirements/lock.txt "$@"
