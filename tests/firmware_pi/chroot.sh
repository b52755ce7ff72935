#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# The installer on a fresh Debian, with its real apt, Python and systemctl: minutes, root and network
# are needed, so no test runs it by itself. Raspberry Pi's own archive is not used: an empty package
# stands for python3-picamera2.
#
#   sudo tests/firmware_pi/chroot.sh trixie amd64 FOLDER
#   sudo tests/firmware_pi/chroot.sh bookworm arm64 FOLDER    # under qemu-user-static
set -eu

suite=${1:?suite: bookworm or trixie} architecture=${2:?architecture: amd64 or arm64}
root=${3:?a folder to make the system in}
repository=$(cd "$(dirname "$0")/../.." && pwd)

said() { echo "chroot.sh: $*" >&2; }
fail() {
  said "FAILED: $*"
  exit 1
}
inside() { SYSTEMD_OFFLINE=1 LC_ALL=C chroot "$root" "$@"; }

[ "$(id -u)" = 0 ] || fail "root is needed"
if [ "$architecture" = arm64 ] && [ "$(uname -m)" != aarch64 ]; then
  command -v update-binfmts >/dev/null || fail "install binfmt-support beside qemu-user-static"
  mountpoint -q /proc/sys/fs/binfmt_misc ||
    mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
  update-binfmts --enable qemu-aarch64
fi

[ -x "$root/bin/sh" ] || debootstrap --variant=minbase --arch="$architecture" \
  --include=python3,systemd,kmod,procps "$suite" "$root" http://deb.debian.org/debian >"$root.log" 2>&1 ||
  fail "debootstrap: see $root.log"

# An archive of one empty package for each that only Raspberry Pi has.
mkdir -p "$root/srv/pi" "$root/boot/firmware" "$root/srv/wedge"
for package in python3-picamera2 libcamera-ipa; do
  mkdir -p "$root/srv/pi/$package/DEBIAN"
  printf 'Package: %s\nVersion: 99\nArchitecture: all\nMaintainer: nobody <nobody@example.org>\nDescription: stands for the real one\n' \
    "$package" >"$root/srv/pi/$package/DEBIAN/control"
  dpkg-deb -b "$root/srv/pi/$package" "$root/srv/pi/$package.deb" >/dev/null
  {
    dpkg-deb -f "$root/srv/pi/$package.deb"
    echo "Filename: ./$package.deb"
    echo "Size: $(stat -c %s "$root/srv/pi/$package.deb")"
    echo "SHA256: $(sha256sum "$root/srv/pi/$package.deb" | cut -d ' ' -f 1)"
    echo
  } >"$root/srv/pi/$package.entry"
done
cat "$root"/srv/pi/*.entry >"$root/srv/pi/Packages"
echo 'deb [trusted=yes] file:/srv/pi ./' >"$root/etc/apt/sources.list.d/pi.list"
echo 'dtparam=audio=on' >"$root/boot/firmware/config.txt"
echo 0123456789abcdef0123456789abcdef >"$root/etc/machine-id"
cp -r "$repository/firmware_pi" "$repository/sensor" "$root/srv/wedge"

began=$(date +%s)
inside /srv/wedge/firmware_pi/install.sh --address 10.55.0.1 --usb-gadget >"$root.log" 2>&1 ||
  fail "install.sh: see $root.log"
said "installed in $(($(date +%s) - began)) s on $suite $architecture, $(inside python3 -V)"
inside dpkg -s python3-picamera2 | grep -q '^Status: install ok installed' || fail "no package"
[ -L "$root/etc/systemd/system/multi-user.target.wants/gelsight-wedge@0.service" ] ||
  fail "the unit is not enabled"
inside gelsight-wedge check /etc/gelsight-wedge/0.toml || fail "the settings are wrong"
answer=$(inside gelsight-wedge serve /etc/gelsight-wedge/0.toml 2>&1) && fail "it streams without a camera"
[ "$answer" = "gelsight-wedge: the Pi's camera needs libcamera: run firmware_pi/install.sh on the Pi." ] ||
  fail "it said: $answer"
inside systemd-analyze verify gelsight-wedge@0.service >"$root.log" 2>&1 || fail "$(cat "$root.log")"
if grep gelsight "$root.log"; then fail "systemd-analyze verify says that"; fi
inside systemd-analyze security --offline=true --no-pager --threshold=25 \
  /etc/systemd/system/gelsight-wedge@.service | tail -n 1

moments() { (cd "$root" && find etc usr/local boot -type f -name '*[!~]' -printf '%p %i %T@ %m\n' | grep -v '/apt/' | sort); }
before=$(moments)
inside /srv/wedge/firmware_pi/install.sh --address 10.55.0.1 --usb-gadget >"$root.log" 2>&1 ||
  fail "install.sh, run again: see $root.log"
[ "$(moments)" = "$before" ] || fail "a second run changed files"

inside /usr/local/lib/gelsight-wedge/uninstall.sh --purge >"$root.log" 2>&1 ||
  fail "uninstall.sh: see $root.log"
left=$(find "$root"/etc "$root"/usr "$root"/boot "$root"/var -name '*gelsight*')
[ -z "$left" ] || fail "left behind: $left"
[ "$(cat "$root/boot/firmware/config.txt")" = 'dtparam=audio=on' ] || fail "config.txt is changed"
said "installed, run again, uninstalled: all well"
