# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a page's process imports and compiles as it begins, done once for all that fork from this.

It starts no thread, as none would live on in a fork.
"""
# ruff: noqa: F401  (modules that a page needs later)

import gc

import anyio._backends._asyncio
import cv2
import nicegui.ui_run
import uvicorn.lifespan.on
import uvicorn.loops.auto
import uvicorn.protocols.http.h11_impl
import uvicorn.protocols.websockets.wsproto_impl
from nicegui.client import templates
from PIL import Image

import app.pages.corners
import app.pages.label
import app.pages.live
from app import label, live
from app._words import understood
from recon.fast import FastReconstructor
from recon.labels import ball_size, odd_rows, press_doubts
from recon.pose.warm_up import warm_up
from tests.recon.fast.units import make_unit
from validation import datasets

understood(label.main, "wedge label", ["set"])
understood(live.main, "wedge live", ["set"])
Image.preinit()
templates.get_template("index.html")
cv2.setNumThreads(1)
FastReconstructor(make_unit((160, 120)))
warm_up()
cv2.setNumThreads(-1)
gc.freeze()  # or each fork would copy it all by looking for garbage
