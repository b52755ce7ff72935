# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""From a camera frame to gradients, depth and contact, and the calibration of one unit.

A frame comes by ``stream`` or ``images``, is unwarped (``geometry``), brought to the blank frame's
light (``same_light``), freed of dots (``markers``), and read as slopes (``estimators``). ``depth``
infers a slope that no light shows (``missing_axis``) and integrates (``integration``); ``contact``
tells what is touched. ``pipeline`` does all of it, ``fast`` the same at camera rate. What they find
is a ``touched.Touched``, from which ``cloud``, ``pose`` and ``follower`` go on.

Calibration goes another way: ``labels`` finds where balls touched, ``presses`` reads these frames,
``pixels`` tells the slopes there, and ``calibration`` fits and keeps a unit. ``training`` made the
weights of the networks that ship (``unet``).
"""
