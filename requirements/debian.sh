#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# Installs the optional system packages of requirements/debian.txt, on Debian and its kin, as root.
set -eu
list=$(dirname "$0")/debian.txt
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
packages=$(sed 's/#.*//' "$list")
missing=
for package in $packages; do
  dpkg -s "$package" >/dev/null 2>&1 || missing="$missing $package"
done
# One at a time: a package that a release lacks must not keep the others out.
for package in $missing; do
  apt-get install -y -qq --no-install-recommends "$package" >/dev/null ||
    echo "debian.sh: $package could not be installed: what needs it says so" >&2
done
