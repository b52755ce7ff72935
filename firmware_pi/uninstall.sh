#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# Takes away what install.sh made. The settings stay unless --purge is given; so do Debian's
# packages, which others may use.
set -eu

usage() {
  cat <<'END'
usage: sudo uninstall.sh [--purge]

  --purge   remove the settings, the password and what systemctl edit made too
END
}

purge=no
for option; do
  case $option in
    --purge) purge=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "uninstall.sh: there is no option $option; --help lists them." >&2
      exit 2
      ;;
  esac
done

to=${DESTDIR-} # a folder in the place of /, for tests
if [ -z "$to" ] && [ "$(id -u)" != 0 ]; then
  echo "uninstall.sh: only root may uninstall: run this with sudo." >&2
  exit 2
fi

# First what may fail. The server lies beside this script where both are installed, else one up.
here=$(cd "$(dirname "$0")" && pwd)
for config in "$to/boot/firmware/config.txt" "$to/boot/config.txt"; do
  [ -f "$config" ] || continue
  left=$(find "${config%/*}" -maxdepth 1 -name '.config.txt.*') # perhaps of a write that was cut off
  [ -n "$left" ] || grep -q '# gelsight-wedge begin' "$config" || continue
  before=$(cksum <"$config")
  PYTHONPATH=$here:$here/.. PYTHONSAFEPATH=1 PYTHONDONTWRITEBYTECODE=1 \
    python3 -S -m firmware_pi cable remove "$config"
  [ "$(cksum <"$config")" = "$before" ] ||
    echo "uninstall.sh: restart the Pi once, so that its USB socket no longer acts as a network card" >&2
done
# Also a camera whose settings were deleted by hand runs, and would run again.
for file in "$to"/etc/gelsight-wedge/*.toml \
  "$to"/etc/systemd/system/multi-user.target.wants/gelsight-wedge@*.service; do
  [ -e "$file" ] || [ -L "$file" ] || continue
  camera=$(basename "$file" .toml)
  camera=${camera#gelsight-wedge@}
  systemctl disable --now "gelsight-wedge@${camera%.service}.service" || true
done
for file in "$to/etc/systemd/system/gelsight-wedge@.service" \
  "$to/usr/local/bin/gelsight-wedge" \
  "$to/etc/modules-load.d/gelsight-wedge.conf" \
  "$to/etc/modprobe.d/gelsight-wedge.conf" \
  "$to/etc/udev/rules.d/86-gelsight-wedge.rules" \
  "$to/etc/NetworkManager/system-connections/gelsight-wedge.nmconnection"; do
  rm -f "$file" "$file.new" "${file%/*}/.${file##*/}.new" # .new: of a run that was cut off
done
rm -rf "$to/usr/local/lib/gelsight-wedge"
for own in "$to/etc/gelsight-wedge" "$to"/etc/systemd/system/gelsight-wedge@*.service.d; do
  [ -d "$own" ] || continue
  if [ "$purge" = yes ]; then
    rm -rf "$own"
  else
    echo "uninstall.sh: your settings in $own stay; --purge removes them." >&2
  fi
done
systemctl daemon-reload
