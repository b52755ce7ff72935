#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# Installs the camera server on a Raspberry Pi. Run again after an update or with other options:
# what is there already stays, settings above all. uninstall.sh takes everything away again.
set -eu
umask 022 # the server runs as nobody in particular, and must read what is installed

usage() {
  cat <<'END'
usage: sudo firmware_pi/install.sh --address IP [--camera N] [--port PORT] [--usb-gadget]

  --address IP   the one address of this Pi at which the stream is served
  --camera N     number of the camera, from 0 (default 0); run once per camera of a Pi 5
  --port PORT    TCP port (default 8080); each camera of a Pi needs its own
  --usb-gadget   let the Pi's USB socket act as a network card with that address
END
}

say() { echo "install.sh: $*" >&2; }
fail() {
  say "$*"
  exit 2
}

address='' camera=0 port=8080 gadget=no
while [ $# -gt 0 ]; do
  case $1 in
    --address | --camera | --port)
      [ $# -gt 1 ] || fail "$1 needs a value."
      case $1 in
        --address) address=$2 ;;
        --camera) camera=$2 ;;
        --port) port=$2 ;;
      esac
      shift 2
      ;;
    --usb-gadget)
      gadget=yes
      shift
      ;;
    -h | --help)
      usage
      exit 0
      ;;
    *) fail "there is no option $1; --help lists them." ;;
  esac
done

to=${DESTDIR-} # a folder in the place of /, for tests
here=$(cd "$(dirname "$0")" && pwd)
lib=$to/usr/local/lib/gelsight-wedge
settings=$to/etc/gelsight-wedge/$camera.toml
cable=$to/etc/NetworkManager/system-connections/gelsight-wedge.nmconnection
changed=$lib/.restart # there until what runs is what is installed

[ -n "$to" ] || [ "$(id -u)" = 0 ] || fail "only root may install: run this with sudo."
[ -f "$here/../sensor/wire.py" ] || fail "the folder sensor is missing next to firmware_pi: copy both."
[ -n "$address" ] || fail "give the address to serve at with --address; this Pi has $(hostname -I)"
python3 -S -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
  fail "Python 3.11 is needed, as in Raspberry Pi OS 12 and later; docs/howto/pi.md says what an older system can do."

# python WORDS: Python that finds the server beside this script and leaves nothing there. Of the
# packages that are installed it needs none, and to look for them (no -S) takes as long as the rest.
python() { PYTHONPATH=$here/.. PYTHONSAFEPATH=1 PYTHONDONTWRITEBYTECODE=1 python3 -S "$@"; }

# Everything that can be wrong with the options and the settings, before anything is changed.
check() {
  case $camera in
    [0-3]) ;;
    *) fail "--camera '$camera' must be 0, 1, 2 or 3." ;;
  esac
  case $port in
    '' | *[!0-9]*) fail "--port '$port' is not a number." ;;
  esac
  there=$settings
  [ -e "$there" ] || there=/dev/null # no settings, and nothing to be written
  serves=$(python -m firmware_pi default "$there" --address "$address" --camera "$camera" --port "$port")
  [ -e "$settings" ] || serves="$address $port"
  for other in $(others); do
    [ "$(served "$other")" != "$serves" ] ||
      fail "$other already uses address and port $serves: give another --port, or set it in $settings."
  done
  [ "$gadget" = no ] || check_cable
  if grep -Eqs '(^| )(boot=overlay|overlayroot=tmpfs)' "$to/proc/cmdline"; then
    fail "the Pi loses what is written when it restarts: first switch off the overlay file system in raspi-config."
  fi
}

# The settings of this Pi's other cameras.
others() {
  for file in "$to"/etc/gelsight-wedge/[0-3].toml; do
    [ ! -e "$file" ] || [ "$file" = "$settings" ] || echo "$file"
  done
}

# served FILE: the address and the port in its settings; nothing of a file that is wrong.
served() {
  python -c '
import pathlib, sys
from firmware_pi.settings import read_settings
settings = read_settings(pathlib.Path(sys.argv[1]))
print(settings.address, settings.port)' "$1" 2>/dev/null || true
}

check_cable() {
  case $address in
    *:*) fail "--usb-gadget needs an IPv4 address, such as 10.55.0.1, not $address." ;;
  esac
  model=$(tr -d '\0' <"$to/proc/device-tree/model" 2>/dev/null || true)
  case $model in
    *'Pi Model B'* | *'Pi 2 Model B'* | *'Pi 3 Model B'*) # its Ethernet would be gone as well
      fail "the USB sockets of a $model belong to a hub and cannot act as a network card: leave out --usb-gadget."
      ;;
  esac
  config=$to/boot/firmware/config.txt
  [ -f "$config" ] || config=$to/boot/config.txt
  [ -f "$config" ] || fail "there is no config.txt below $to/boot: is this a Raspberry Pi?"
  [ -w "$config" ] || fail "$config cannot be written: make its file system writable in raspi-config."
  [ "${serves% *}" = "$address" ] ||
    fail "the stream stays at ${serves% *}, as $settings says: set address there to $address, or leave out --usb-gadget."
  [ -f "$cable" ] || return 0
  laid=$(sed -n 's|^address1=\([^/]*\)/.*|\1|p' "$cable")
  [ "$laid" != "$address" ] || return 0
  for other in $(others); do
    [ "$(served "$other" | cut -d ' ' -f 1)" != "$laid" ] ||
      fail "the cable's address is $laid, where $other serves: give --address $laid and another --port, or leave out --usb-gadget."
  done
}

# Something changes now: said in a file, so that a run after one that was cut off knows it too.
changes() {
  [ -e "$changed" ] || mkdir -p "$lib"
  : >"$changed"
}

# put SOURCE TARGET MODE: copy a file unless it is there already. Until it is whole its name is
# hidden: NetworkManager takes every other file of its folder for settings.
put() {
  new=${2%/*}/.${2##*/}.new
  for left in "$new" "$2.new"; do # by a run that was cut off, the second by that of an older installer
    [ ! -e "$left" ] || rm "$left"
  done
  if [ -f "$2" ] && cmp -s "$1" "$2"; then return; fi
  changes
  install -D -m "$3" "$1" "$new"
  mv "$new" "$2"
}

# write TARGET MODE: the same with what comes on standard input.
write() {
  written=$(mktemp)
  cat >"$written"
  put "$written" "$1" "$2"
  rm "$written"
}

# Whether the stream can be reached: at an address that this Pi has, or has once its cable is laid.
is_reachable() {
  [ "$gadget" = no ] || return 0
  ! grep -qs "^address1=$1/" "$cable" || return 0
  python -c '
import sys
from firmware_pi.interfaces import is_up
sys.exit(not is_up(sys.argv[1]))' "$1"
}

install_packages() {
  missing=''
  for package in python3-picamera2 libcamera-ipa; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' ||
      missing="$missing $package"
  done
  [ -n "$missing" ] || return 0
  say "installing$missing"
  apt-get update -q
  # shellcheck disable=SC2086 # several words
  DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing
}

install_server() {
  for package in firmware_pi sensor; do
    for file in "$here/../$package"/*.py; do
      put "$file" "$lib/$package/${file##*/}" 644
    done
    for file in "$lib/$package"/*.py; do # what an older version left
      [ -f "$here/../$package/${file##*/}" ] || {
        changes
        rm "$file"
      }
    done
  done
  put "$here/README.md" "$lib/firmware_pi/README.md" 644
  put "$here/uninstall.sh" "$lib/uninstall.sh" 755
  write "$to/usr/local/bin/gelsight-wedge" 755 <<'END'
#!/bin/sh
PYTHONPATH=/usr/local/lib/gelsight-wedge PYTHONSAFEPATH=1 PYTHONDONTWRITEBYTECODE=1 \
  exec python3 -m firmware_pi "$@"
END
  put "$here/gelsight-wedge@.service" "$to/etc/systemd/system/gelsight-wedge@.service" 644
}

install_settings() {
  if [ -e "$settings" ]; then
    say "$settings stays as it is; --address and --port apply only if it does not exist"
  else
    python -m firmware_pi default "$settings" --address "$address" --camera "$camera" --port "$port" >/dev/null
  fi
  chmod a+rX "$lib" "$lib"/* "$to/etc/gelsight-wedge" "$settings" # also what a stricter umask had made
  login=$to/etc/gelsight-wedge/login
  if [ ! -e "$login" ]; then # empty: no password is asked for
    : >"$login"
    chmod 600 "$login"
  fi
}

install_gadget() {
  server_changed=$changed changed=$lib/.restart-pi
  before=$(cksum <"$config")
  python -m firmware_pi cable lay "$config"
  [ "$(cksum <"$config")" = "$before" ] || changes
  write "$to/etc/modules-load.d/gelsight-wedge.conf" 644 <<END
dwc2
g_ether
END
  # Fixed hardware addresses: else the computer sees a new cable at every start. By the Pi's serial
  # number, as a copied card has the same machine-id.
  serial=$to/proc/device-tree/serial-number
  [ -f "$serial" ] || serial=$to/etc/machine-id
  unique=$(sha256sum "$serial" | cut -c 1-10 | sed 's/../:&/g')
  write "$to/etc/modprobe.d/gelsight-wedge.conf" 644 <<END
options g_ether dev_addr=02$unique host_addr=06$unique
END
  # NetworkManager leaves alone what is a USB gadget, by its 85-nm-unmanaged.rules.
  write "$to/etc/udev/rules.d/86-gelsight-wedge.rules" 644 <<'END'
SUBSYSTEM=="net", ACTION=="add|change|move", ENV{DEVTYPE}=="gadget", ENV{NM_UNMANAGED}="0"
END
  write "$cable" 600 <<END
[connection]
id=gelsight-wedge
type=ethernet
interface-name=usb0

[ipv4]
method=manual
address1=$address/24
never-default=true

[ipv6]
method=link-local
END
  [ ! -e "$changed" ] ||
    say "restart the Pi once, so that its USB socket acts as a network card with the address $address"
  rm -f "$changed"
  changed=$server_changed
}

check
install_packages
install_server
install_settings
[ "$gadget" = no ] || install_gadget

unit=gelsight-wedge@$camera.service
systemctl daemon-reload
systemctl enable "$unit"
failed=''
if [ -e "$changed" ]; then
  systemctl restart "$unit" || failed=" -u $unit"
  for other in $(others); do # they run what was replaced
    other=gelsight-wedge@$(basename "$other" .toml).service
    systemctl try-restart "$other" || failed="$failed -u $other"
  done
else
  systemctl start "$unit" || failed=" -u $unit"
fi
[ -z "$failed" ] || fail "a camera did not start: journalctl$failed says why; correct that and run this again."
rm -f "$changed"
say "settings: $settings; log: journalctl -u $unit"
is_reachable "${serves% *}" ||
  say "no interface of this Pi has the address ${serves% *} (it has $(hostname -I)): nobody reaches the stream until one has, so correct address in $settings and restart $unit."
