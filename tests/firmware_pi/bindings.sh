#!/bin/sh
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
# Holds libcamera.toml and camera.py against the real bindings of Debian 13 and the real picamera2, in
# the folder that chroot.sh made of trixie; root and network are needed. There is no camera: frames
# are not taken.
#
#   sudo tests/firmware_pi/bindings.sh FOLDER
set -eu
root=${1:?a folder that chroot.sh made of trixie}
here=$(cd "$(dirname "$0")" && pwd)

chroot "$root" apt-get update -q >"$root.log" 2>&1
chroot "$root" apt-get install -q -y --no-install-recommends python3-libcamera >>"$root.log" 2>&1
chroot "$root" dpkg-query -W python3-libcamera
cp "$here/libcamera.toml" "$root/srv/libcamera.toml"
chroot "$root" python3 - <<'END'
import tomllib

import libcamera
from libcamera import controls


def kinds(holder):
    found = {name: getattr(holder, name) for name in dir(holder)}
    return {k: v.type.name for k, v in found.items() if isinstance(v, libcamera.ControlId)}


def members(enumeration):
    return {name: int(value) for name, value in enumeration.__members__.items()}


kept = tomllib.load(open("/srv/libcamera.toml", "rb"))
assert kept["controls"] == kinds(controls), "controls"
assert kept["draft"] == kinds(controls.draft), "draft controls"
for name, values in kept["enumerations"].items():
    assert values == members(getattr(controls.draft, name)), name
print(len(kept["controls"]) + len(kept["draft"]), "controls have the names and kinds that are kept")
END

chroot "$root" apt-get install -q -y --no-install-recommends \
  python3-pip python3-dev gcc libc6-dev libcap-dev >>"$root.log" 2>&1
mkdir -p "$root/etc/ssl/certs"
cp -L /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
chroot "$root" pip install -q --break-system-packages --no-cache-dir picamera2==0.3.38 numpy \
  >>"$root.log" 2>&1
cp -r "$here/../../firmware_pi" "$here/../../sensor" "$root/srv/wedge/"
chroot "$root" python3 - 2>>"$root.log" <<'END'
import inspect
import sys
from unittest.mock import MagicMock

sys.modules["pykms"] = MagicMock()  # draws on a screen, of which there is none
sys.path.insert(0, "/srv/wedge")

from libcamera import ColorSpace, controls
from picamera2 import Picamera2
from picamera2.encoders import JpegEncoder, LibavMjpegEncoder, MJPEGEncoder
from picamera2.outputs import Output

from firmware_pi.camera import PiCamera, camera_controls, steady_tuning
from firmware_pi.settings import Settings
from sensor.errors import WedgeError

camera_controls(Settings(), controls)
for encoder in (JpegEncoder(q=85), MJPEGEncoder(bitrate=1)):
    assert encoder.firsttimestamp is None
bind = {
    Picamera2.__init__: ((None, 0), {"tuning": {}}),
    Picamera2.create_video_configuration: (
        (None,),
        {"main": {}, "sensor": {}, "buffer_count": 4, "controls": {}}
        | {"colour_space": ColorSpace.Sycc()},
    ),
    Picamera2.start_recording: ((None, None, None), {}),
    Output.outputframe: ((None, b"", True, 0, None, False), {}),
}
for function, (given, named) in bind.items():
    inspect.signature(function).bind(*given, **named)
tuning = {"version": 2.0, "algorithms": [{"rpi.alsc": {}}, {"rpi.contrast": {}}]}
steady = steady_tuning(tuning)
assert Picamera2.find_tuning_algo(steady, "rpi.contrast") == {"ce_enable": 0}
assert Picamera2.find_tuning_algo(steady, "rpi.alsc") == {"n_iter": 0}
try:
    PiCamera(Settings(), print)
except WedgeError as error:
    assert "sees 0" in str(error), error
else:
    raise AssertionError("a camera?")
print("picamera2 0.3.38 takes what camera.py gives")
END
