#!/usr/bin/env bats
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# The installer on an empty folder in the place of /, with apt and systemd replaced by recorders.

setup() {
  firmware=$BATS_TEST_DIRNAME/../../firmware_pi
  stubs=$BATS_TEST_TMPDIR/bin
  export DESTDIR=$BATS_TEST_TMPDIR/root CALLS=$BATS_TEST_TMPDIR/calls
  export PATH=$stubs:$PATH
  : >"$CALLS"
  mkdir -p "$stubs" "$DESTDIR/boot/firmware" "$DESTDIR/usr/local/lib" "$DESTDIR/usr/local/bin"
  mkdir -p "$DESTDIR"/etc/{systemd/system,modules-load.d,modprobe.d,udev/rules.d}
  mkdir -p "$DESTDIR/etc/NetworkManager/system-connections"
  printf 'dtparam=audio=on\n[cm5]\ndtoverlay=dwc2,dr_mode=host\n' >"$DESTDIR/boot/firmware/config.txt"
  echo 0123456789abcdef0123456789abcdef >"$DESTDIR/etc/machine-id"
  cat >"$stubs/systemctl" <<'END'
#!/bin/sh
echo "systemctl $*" >>"$CALLS"
END
  cat >"$stubs/apt-get" <<'END'
#!/bin/sh
echo "apt-get $*" >>"$CALLS"
END
  cat >"$stubs/dpkg-query" <<'END'
#!/bin/sh
for package; do :; done
if grep -q "^apt-get install.* $package" "$CALLS"; then echo "install ok installed"; else exit 1; fi
END
  chmod +x "$stubs"/*
}

tree() { (cd "$DESTDIR" && find . -printf '%p %m %y\n' | sort && find . -type f -exec sha256sum {} + | sort); }
moments() { (cd "$DESTDIR" && find . -type f -printf '%p %i %T@\n' | sort); }

@test "a first run installs, enables and starts" {
  "$firmware/install.sh" --address 10.55.0.1
  grep -q '^apt-get install .*python3-picamera2' "$CALLS"
  grep -qx 'systemctl enable gelsight-wedge@0.service' "$CALLS"
  grep -qx 'systemctl restart gelsight-wedge@0.service' "$CALLS"
  grep -q '^address = "10.55.0.1"' "$DESTDIR/etc/gelsight-wedge/0.toml"
  [ "$(stat -c %a "$DESTDIR/etc/gelsight-wedge/login")" = 600 ]
}

@test "an address that no interface has is said, unless it is the cable's" {
  run "$firmware/install.sh" --address 198.51.100.7
  [ "$status" = 0 ]
  [[ $output == *"no interface of this Pi has the address 198.51.100.7"*0.toml* ]]
  sed -i 's/198.51.100.7/127.0.0.1/' "$DESTDIR/etc/gelsight-wedge/0.toml"
  run "$firmware/install.sh" --address 198.51.100.7
  [[ $output != *"no interface"* ]] # by what is served, not by the option
  sed -i 's/127.0.0.1/198.51.100.7/' "$DESTDIR/etc/gelsight-wedge/0.toml"
  for option in --usb-gadget ''; do # the second time the cable is laid
    # shellcheck disable=SC2086 # no word
    run "$firmware/install.sh" --address 198.51.100.7 $option
    [ "$status" = 0 ]
    [[ $output != *"no interface"* ]]
  done
}

@test "what is installed runs without the rest of the repository" {
  "$firmware/install.sh" --address 10.55.0.1
  cd "$BATS_TEST_TMPDIR"
  run env -i PATH=/usr/bin:/bin PYTHONSAFEPATH=1 PYTHONPATH="$DESTDIR/usr/local/lib/gelsight-wedge" \
    python3 -m firmware_pi serve "$DESTDIR/etc/gelsight-wedge/0.toml"
  [ "$status" = 2 ]
  [[ $output == *"cannot listen on"* || $output == *"libcamera"* || $output == *"picamera2"* ]]
  [[ $output != *Traceback* ]]
}

@test "what a strict umask would hide or has hidden is readable for the server" {
  (umask 077; "$firmware/install.sh" --address 10.55.0.1)
  hidden() { find "$DESTDIR/usr/local/lib/gelsight-wedge" "$DESTDIR/etc/gelsight-wedge" \
    ! -name login \( -type d ! -perm -005 -o -type f ! -perm -004 \); }
  [ -z "$(hidden)" ]
  chmod 700 "$DESTDIR/usr/local/lib/gelsight-wedge/sensor" "$DESTDIR/etc/gelsight-wedge"
  chmod 600 "$DESTDIR/etc/gelsight-wedge/0.toml"
  "$firmware/install.sh" --address 10.55.0.1
  [ -z "$(hidden)" ]
  [ "$(stat -c %a "$DESTDIR/etc/gelsight-wedge/login")" = 600 ]
}

@test "a second run changes nothing and interrupts nothing" {
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  before=$(tree; moments)
  cp "$CALLS" "$CALLS.first"
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ "$(tree; moments)" = "$before" ]
  second=$(tail -n "+$(($(wc -l <"$CALLS.first") + 1))" "$CALLS")
  [[ $second != *apt-get* ]]
  [[ $second != *restart* ]]
  [[ $second == *"systemctl start gelsight-wedge@0.service"* ]]
}

@test "an update replaces what changed, removes what is gone and restarts" {
  "$firmware/install.sh" --address 10.55.0.1
  echo '# older' >>"$DESTDIR/usr/local/lib/gelsight-wedge/firmware_pi/server.py"
  echo '# gone' >"$DESTDIR/usr/local/lib/gelsight-wedge/firmware_pi/gone.py"
  "$firmware/install.sh" --address 10.55.0.1
  [ ! -e "$DESTDIR/usr/local/lib/gelsight-wedge/firmware_pi/gone.py" ]
  cmp "$firmware/server.py" "$DESTDIR/usr/local/lib/gelsight-wedge/firmware_pi/server.py"
  [ "$(grep -c 'systemctl restart' "$CALLS")" = 2 ]
}

@test "an update reaches every camera of the Pi" {
  "$firmware/install.sh" --address 10.0.0.2
  "$firmware/install.sh" --address 10.0.0.2 --camera 1 --port 8081
  echo '# older' >>"$DESTDIR/usr/local/lib/gelsight-wedge/firmware_pi/server.py"
  : >"$CALLS"
  "$firmware/install.sh" --address 10.0.0.2
  grep -qx 'systemctl restart gelsight-wedge@0.service' "$CALLS"
  grep -qx 'systemctl try-restart gelsight-wedge@1.service' "$CALLS"
}

@test "a camera that does not start again is named, the others are started, the next run tries again" {
  "$firmware/install.sh" --address 10.0.0.2
  "$firmware/install.sh" --address 10.0.0.2 --camera 1 --port 8081
  whole=$(tree)
  echo '# older' >>"$DESTDIR/usr/local/lib/gelsight-wedge/firmware_pi/server.py"
  cp "$stubs/systemctl" "$stubs/healthy"
  for fails in daemon-reload 'restart gelsight-wedge@0.service'; do
    : >"$CALLS"
    printf '[ "$*" != "%s" ] || exit 1\n' "$fails" | cat "$stubs/healthy" - >"$stubs/systemctl"
    run "$firmware/install.sh" --address 10.0.0.2
    [ "$status" != 0 ]
  done
  [[ $output == *"journalctl -u gelsight-wedge@0.service says why"* ]]
  grep -qx 'systemctl try-restart gelsight-wedge@1.service' "$CALLS"
  : >"$CALLS"
  cp "$stubs/healthy" "$stubs/systemctl"
  "$firmware/install.sh" --address 10.0.0.2
  grep -qx 'systemctl restart gelsight-wedge@0.service' "$CALLS"
  grep -qx 'systemctl try-restart gelsight-wedge@1.service' "$CALLS"
  [ "$(tree)" = "$whole" ]
  : >"$CALLS"
  "$firmware/install.sh" --address 10.0.0.2
  run grep restart "$CALLS"
  [ "$status" = 1 ]
}

@test "settings are kept, and a misspelt one is refused by name" {
  "$firmware/install.sh" --address 10.55.0.1
  echo 'red_gain = 1.1' >"$DESTDIR/etc/gelsight-wedge/0.toml"
  "$firmware/install.sh" --address 10.55.0.9
  [ "$(cat "$DESTDIR/etc/gelsight-wedge/0.toml")" = 'red_gain = 1.1' ]
  echo 'red_gian = 1.1' >"$DESTDIR/etc/gelsight-wedge/0.toml"
  run "$firmware/install.sh" --address 10.55.0.9
  [ "$status" = 2 ]
  [[ $output == *red_gian*red_gain* ]]
}

@test "two cameras of one Pi have an instance and a port each" {
  "$firmware/install.sh" --address 10.0.0.2
  before=$(tree)
  run "$firmware/install.sh" --address 10.0.0.2 --camera 1
  [ "$status" = 2 ]
  [[ $output == *0.toml*"10.0.0.2 8080"*--port* ]]
  [ "$(tree)" = "$before" ]
  : >"$CALLS"
  "$firmware/install.sh" --address 10.0.0.2 --camera 1 --port 8081
  run grep @0 "$CALLS"
  [ "$status" = 1 ] # the first camera is left alone
  grep -qx 'systemctl enable gelsight-wedge@1.service' "$CALLS"
  grep -q '^port = 8081' "$DESTDIR/etc/gelsight-wedge/1.toml"
  grep -q '^camera = 1' "$DESTDIR/etc/gelsight-wedge/1.toml"
  "$firmware/uninstall.sh"
  grep -qx 'systemctl disable --now gelsight-wedge@0.service' "$CALLS"
  grep -qx 'systemctl disable --now gelsight-wedge@1.service' "$CALLS"
}

@test "uninstalling takes away everything, byte for byte" {
  before=$(tree)
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ "$(tree)" != "$before" ]
  "$firmware/uninstall.sh" --purge
  [ "$(tree)" = "$before" ]
}

@test "a run that is cut off leaves nothing that is read, and nothing at all after the next" {
  before=$(tree)
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  whole=$(tree)
  "$firmware/uninstall.sh" --purge
  cat >"$stubs/mv" <<'END'
#!/bin/sh
case $2 in *"$CUT") kill -9 "$PPID" ;; *) exec /bin/mv "$@" ;; esac
END
  chmod +x "$stubs/mv"
  for CUT in sensor/files.py @.service .nmconnection; do
    export CUT
    for next in install uninstall; do
      run "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
      [ "$status" = 137 ]
      cut=$(find "$DESTDIR" -name '*.new')
      name=$(basename "$cut") # of one, and hidden
      [[ $name == .*.new ]]
      touch "$(dirname "$cut")/${name#.}" # as an older installer left it
      if [ "$next" = install ]; then
        CUT=nothing "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
        [ "$(tree)" = "$whole" ]
        "$firmware/uninstall.sh" --purge
      else
        "$firmware/uninstall.sh" --purge
      fi
      [ "$(tree)" = "$before" ]
    done
  done
}

@test "what a cut off write left beside config.txt goes, by installing and by uninstalling" {
  boot=$DESTDIR/boot/firmware
  echo "an editor's" >"$boot/.config.txt.swp"
  before=$(tree)
  cp "$boot/config.txt" "$boot/.config.txt.0123456789ab"
  "$firmware/uninstall.sh" --purge
  [ "$(tree)" = "$before" ]
  cp "$boot/config.txt" "$boot/.config.txt.0123456789ab"
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ ! -e "$boot/.config.txt.0123456789ab" ]
  "$firmware/uninstall.sh" --purge
  [ "$(tree)" = "$before" ]
}

@test "uninstalling keeps the settings unless it is told not to" {
  "$firmware/install.sh" --address 10.55.0.1
  "$firmware/uninstall.sh"
  [ -f "$DESTDIR/etc/gelsight-wedge/0.toml" ]
  [ ! -e "$DESTDIR/usr/local/lib/gelsight-wedge" ]
  "$firmware/uninstall.sh" --purge
  [ ! -e "$DESTDIR/etc/gelsight-wedge" ]
}

@test "uninstalling names what systemctl edit made, or takes it away too" {
  before=$(tree)
  "$firmware/install.sh" --address 10.55.0.1
  own=$DESTDIR/etc/systemd/system/gelsight-wedge@0.service.d
  mkdir "$own"
  echo '[Service]' >"$own/override.conf"
  run "$firmware/uninstall.sh"
  [[ $output == *"$own stay"* ]]
  [ -f "$own/override.conf" ]
  "$firmware/uninstall.sh" --purge
  [ "$(tree)" = "$before" ]
}

@test "uninstalling stops a camera whose settings were deleted by hand" {
  "$firmware/install.sh" --address 10.55.0.1
  mkdir "$DESTDIR/etc/systemd/system/multi-user.target.wants"
  ln -s /etc/systemd/system/gelsight-wedge@.service \
    "$DESTDIR/etc/systemd/system/multi-user.target.wants/gelsight-wedge@0.service"
  rm -r "$DESTDIR/etc/gelsight-wedge"
  "$firmware/uninstall.sh"
  grep -qx 'systemctl disable --now gelsight-wedge@0.service' "$CALLS"
}

@test "uninstalling twice, or where nothing is, is no fault" {
  "$firmware/uninstall.sh" --purge
  "$firmware/uninstall.sh" --purge
}

@test "the cable's network has the address, and nobody else may read its file" {
  "$firmware/install.sh" --address 10.55.3.1 --usb-gadget
  file=$DESTDIR/etc/NetworkManager/system-connections/gelsight-wedge.nmconnection
  grep -qx 'address1=10.55.3.1/24' "$file"
  [ "$(stat -c %a "$file")" = 600 ]
  grep -Eqx 'options g_ether dev_addr=02(:[0-9a-f]{2}){5} host_addr=06(:[0-9a-f]{2}){5}' \
    "$DESTDIR/etc/modprobe.d/gelsight-wedge.conf"
  [ "$(grep -c 'dtoverlay=dwc2,dr_mode=peripheral' "$DESTDIR/boot/firmware/config.txt")" = 1 ]
  # NetworkManager's own rule, which leaves USB gadgets alone, must come before ours.
  (cd "$DESTDIR/etc/udev/rules.d" && : >85-nm-unmanaged.rules && ls) | tail -n 1 >"$BATS_TEST_TMPDIR/last"
  grep -q 'ENV{DEVTYPE}=="gadget", ENV{NM_UNMANAGED}="0"' \
    "$DESTDIR/etc/udev/rules.d/$(cat "$BATS_TEST_TMPDIR/last")"
  # Whatever of the cable is new holds from a restart on, and no camera is interrupted for it.
  for file in boot/firmware/config.txt etc/*/gelsight-wedge.conf etc/udev/rules.d/86-gelsight-wedge.rules; do
    for changed in "$DESTDIR"/$file; do
      sed -i '/dwc2\|g_ether\|gadget\|gelsight/d' "$changed"
      cp "$CALLS" "$CALLS.before"
      run "$firmware/install.sh" --address 10.55.3.1 --usb-gadget
      [[ $output == *"restart the Pi"* ]]
      [ "$(grep -c restart "$CALLS")" = "$(grep -c restart "$CALLS.before")" ]
    done
  done
  run "$firmware/install.sh" --address 10.55.3.1 --usb-gadget
  [[ $output != *"restart the Pi"* ]]
}

@test "Pis with copies of one card have hardware addresses of their own, always the same" {
  serial=$DESTDIR/proc/device-tree/serial-number
  mkdir -p "${serial%/*}"
  made_by() {
    printf '%s\0' "$1" >"$serial"
    "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
    cat "$DESTDIR/etc/modprobe.d/gelsight-wedge.conf"
  }
  first=$(made_by 10000000aaaaaaaa)
  [ "$(made_by 10000000bbbbbbbb)" != "$first" ]
  [ "$(made_by 10000000aaaaaaaa)" = "$first" ]
}

@test "the second camera shares the cable of the first" {
  file=$DESTDIR/etc/NetworkManager/system-connections/gelsight-wedge.nmconnection
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  before=$(tree)
  : >"$CALLS"
  run "$firmware/install.sh" --address 10.55.9.1 --usb-gadget --camera 1
  [ "$status" = 2 ]
  [[ $output == *"10.55.0.1"*0.toml*"--address 10.55.0.1"* ]]
  [ "$(tree)" = "$before" ]
  [ ! -s "$CALLS" ]
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget --camera 1 --port 8081
  grep -qx 'address1=10.55.0.1/24' "$file"
  # Where no camera serves at the old address any more, the cable may have another.
  sed -i 's/10.55.0.1/10.55.9.1/' "$DESTDIR"/etc/gelsight-wedge/[01].toml
  run "$firmware/install.sh" --address 10.55.9.1 --usb-gadget
  [ "$status" = 0 ]
  [[ $output == *"restart the Pi"* ]]
  grep -qx 'address1=10.55.9.1/24' "$file"
}

@test "what an older installer wrote into config.txt is mended, by installing and by uninstalling" {
  config=$DESTDIR/boot/firmware/config.txt
  block='# gelsight-wedge begin\n[all]\ndtoverlay=dwc2,dr_mode=peripheral\n# gelsight-wedge end\n'
  printf '%b' "a=1\n$block" >"$BATS_TEST_TMPDIR/right"
  for wrong in "a=1$block" "a=1$block$block"; do
    printf '%b' "$wrong" >"$config"
    "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
    cmp "$config" "$BATS_TEST_TMPDIR/right"
    printf '%b' "$wrong" >"$config"
    "$DESTDIR/usr/local/lib/gelsight-wedge/uninstall.sh"
    [ "$(cat "$config")" = 'a=1' ]
  done
}

@test "a config.txt whose last line has no end keeps its lines" {
  config=$DESTDIR/boot/firmware/config.txt
  printf 'a=1' >"$config"
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  grep -qx 'a=1' "$config"
  grep -qx '# gelsight-wedge begin' "$config"
  before=$(cat "$config")
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ "$(cat "$config")" = "$before" ]
  "$firmware/uninstall.sh" --purge
  [ "$(cat "$config")" = 'a=1' ]
}

@test "bad options are one sentence and nothing is done" {
  before=$(tree)
  for words in '' '--adress 1' '--address' '--address 0.0.0.0' '--address nonsense' \
    '--address 10.0.0.1 --port 99999' '--address 10.0.0.1 --port abc' \
    '--address 10.0.0.1 --camera 7' '--address 255.255.255.255' '--address fe80::1%lo'; do
    # shellcheck disable=SC2086 # several words
    run "$firmware/install.sh" $words
    [ "$status" = 2 ]
    [[ $output == *install.sh:* || $output == *gelsight-wedge:* ]]
    [[ $output != *usage:* ]]
    [ "$(tree)" = "$before" ]
  done
  for words in '--purge --foo' '--foo'; do
    # shellcheck disable=SC2086 # several words
    run "$firmware/uninstall.sh" $words
    [ "$status" = 2 ]
    [[ $output == *"no option --foo"* ]]
    [ "$(tree)" = "$before" ]
  done
  [ ! -s "$CALLS" ] # neither apt nor systemctl
}

@test "a camera is one digit, so that it has one instance" {
  before=$(tree)
  for camera in 01 ' 2' 4 -1 '' x; do
    run "$firmware/install.sh" --address 10.55.0.1 --camera "$camera"
    [ "$status" = 2 ]
    [[ $output == *"--camera '$camera'"* ]]
    [ "$(tree)" = "$before" ]
  done
  [ ! -s "$CALLS" ]
}

@test "a cable that the stream would not be on is refused before anything is done" {
  "$firmware/install.sh" --address 192.168.1.42
  before=$(tree)
  : >"$CALLS"
  run "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ "$status" = 2 ]
  [[ $output == *192.168.1.42*0.toml*10.55.0.1* ]]
  run "$firmware/install.sh" --address fd00::1 --usb-gadget --camera 1
  [ "$status" = 2 ]
  [[ $output == *IPv4*fd00::1* ]]
  [ "$(tree)" = "$before" ]
  [ ! -s "$CALLS" ]
  sed -i 's/192.168.1.42/10.55.0.1/' "$DESTDIR/etc/gelsight-wedge/0.toml"
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
}

@test "no cable is made of what is no Raspberry Pi" {
  rm "$DESTDIR/boot/firmware/config.txt"
  before=$(tree)
  run "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ "$status" = 2 ]
  [[ $output == *config.txt*"Raspberry Pi?" ]]
  [ "$(tree)" = "$before" ]
  [ ! -s "$CALLS" ]
}

@test "no cable is made of a Pi whose USB sockets are a hub's" {
  mkdir -p "$DESTDIR/proc/device-tree"
  before=$(tree)
  for model in 'Model B Rev 2' '2 Model B Rev 1.1' '3 Model B Plus Rev 1.3'; do
    printf 'Raspberry Pi %s\0' "$model" >"$DESTDIR/proc/device-tree/model"
    run "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
    [ "$status" = 2 ]
    [[ $output == *"$model"*--usb-gadget* ]]
  done
  rm "$DESTDIR/proc/device-tree/model"
  [ "$(tree)" = "$before" ]
  echo boot=overlay >"$DESTDIR/proc/cmdline" # which is looked at once nothing is wrong with the cable
  for model in 'Zero 2 W Rev 1.0' '3 Model A Plus Rev 1.0' '4 Model B Rev 1.4' '5 Model B Rev 1.0'; do
    printf 'Raspberry Pi %s\0' "$model" >"$DESTDIR/proc/device-tree/model"
    run "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
    [[ $output == *"overlay file system"* ]]
  done
  rm "$DESTDIR/proc/cmdline"
  "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
}

@test "a cable is refused where config.txt cannot be written, before anything is done" {
  [ "$(id -u)" != 0 ] || skip "root may write everything"
  chmod a-w "$DESTDIR/boot/firmware/config.txt"
  before=$(tree)
  run "$firmware/install.sh" --address 10.55.0.1 --usb-gadget
  [ "$status" = 2 ]
  [[ $output == *"config.txt cannot be written"* ]]
  [ "$(tree)" = "$before" ]
}

@test "a system that forgets is not installed on" {
  mkdir "$DESTDIR/proc"
  for option in boot=overlay overlayroot=tmpfs; do
    echo "$option console=tty1" >"$DESTDIR/proc/cmdline"
    before=$(tree)
    run "$firmware/install.sh" --address 10.55.0.1
    [ "$status" = 2 ]
    [[ $output == *"overlay file system"* ]]
    [ "$(tree)" = "$before" ]
  done
  echo 'overlayroot=disabled console=tty1' >"$DESTDIR/proc/cmdline"
  "$firmware/install.sh" --address 10.55.0.1
}

@test "an older system is told what it can do" {
  printf '#!/bin/sh\nexit 1\n' >"$stubs/python3"
  chmod +x "$stubs/python3"
  run "$firmware/install.sh" --address 10.55.0.1
  [ "$status" = 2 ]
  [[ $output == *"Python 3.11"* ]]
}
