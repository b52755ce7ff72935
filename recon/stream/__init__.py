# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from wherever they come: a Pi, a USB camera, files; the newest one, or all recorded."""

from recon.stream.files import FolderSource, UsbSource, VideoSource
from recon.stream.frame import Clock, Counts, FrameSource, TimedFrame
from recon.stream.http import HttpSource, hidden_login, shown_address
from recon.stream.newest import Newest
from recon.stream.recording import McapSource, Recorder, is_recording, refuse_other_name
from recon.stream.sources import Paced, open_source, refuse_no_source

__all__ = [
    "Clock",
    "Counts",
    "FolderSource",
    "FrameSource",
    "HttpSource",
    "McapSource",
    "Newest",
    "Paced",
    "Recorder",
    "TimedFrame",
    "UsbSource",
    "VideoSource",
    "hidden_login",
    "is_recording",
    "open_source",
    "refuse_no_source",
    "refuse_other_name",
    "shown_address",
]
