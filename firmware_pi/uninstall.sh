#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# Takes away what install.sh made. The settings stay unless --purge is given; so do Debian's
# packages, which others may use.
set -eu

usage() {
  cat <<'END'
usage: sudo uninstall.sh [--purge]

  --purge   the settings and the password too
END
}

purge=no
case ${1-} in
  '') ;;
  --purge) purge=yes ;;
  -h | --help)
    usage
    exit 0
    ;;
  *)
    echo "uninstall.sh: there is no option $1; --help lists them." >&2
    exit 2
    ;;
esac

to=${DESTDIR-} # a folder in the place of /, for tests
if [ -z "$to" ] && [ "$(id -u)" != 0 ]; then
  echo "uninstall.sh: only root may uninstall: put sudo before it." >&2
  exit 2
fi

for file in "$to"/etc/gelsight-wedge/*.toml; do
  [ -e "$file" ] || continue
  systemctl disable --now "gelsight-wedge@$(basename "$file" .toml).service" || true
done
rm -f "$to/etc/systemd/system/gelsight-wedge@.service" \
  "$to/usr/local/bin/gelsight-wedge" \
  "$to/etc/modules-load.d/gelsight-wedge.conf" \
  "$to/etc/modprobe.d/gelsight-wedge.conf" \
  "$to/etc/NetworkManager/system-connections/gelsight-wedge.nmconnection"
rm -rf "$to/usr/local/lib/gelsight-wedge"
for config in "$to/boot/firmware/config.txt" "$to/boot/config.txt"; do
  if [ -f "$config" ] && grep -q '^# gelsight-wedge begin$' "$config"; then
    sed '/^# gelsight-wedge begin$/,/^# gelsight-wedge end$/d' "$config" >"$config.new"
    mv "$config.new" "$config"
  fi
done
if [ "$purge" = yes ]; then
  rm -rf "$to/etc/gelsight-wedge"
elif [ -d "$to/etc/gelsight-wedge" ]; then
  echo "uninstall.sh: the settings stay in $to/etc/gelsight-wedge; --purge removes them." >&2
fi
systemctl daemon-reload
