# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which Mitsuba renders: the plain one that always works, or a compiled one where it does.

``cuda_ad_rgb`` needs an NVIDIA GPU and its driver with OptiX. ``llvm_ad_rgb``, several times faster
than the plain one, needs libLLVM 16 or later, and an older one ends the process without a word. So
a candidate is tried in a child process first.
"""

import ctypes
import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from sensor.errors import WedgeError
from sensor.extras import how_to_install

Variant = Literal["scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb"]
OLDEST_LLVM = 16
LIBRARY_VARIABLE = "DRJIT_LIBLLVM_PATH"
NVIDIA_DRIVER = "libcuda.so.1"
SEARCHED = ("/usr/lib", "/usr/lib64", "/usr/local/lib", "/opt/homebrew/opt", "/usr/local/opt")
TRIAL_S = 60
_ONE_AT_A_TIME = threading.RLock()
_TRIAL = (
    "import sys, mitsuba as mi; mi.set_variant(sys.argv[1]); scene = mi.cornell_box(); "
    "scene['sensor']['film']['width'] = scene['sensor']['film']['height'] = 8; "
    "assert float(mi.render(mi.load_dict(scene), spp=4).array[0]) >= 0"
)


def _installed() -> str:
    try:
        return version("mitsuba")
    except PackageNotFoundError:
        return ""


@dataclass(frozen=True, kw_only=True)
class Engine:
    """A variant of Mitsuba, and the library that it needs; small enough to send to a worker."""

    variant: Variant
    library: str | None = None
    mitsuba: str = field(default_factory=_installed)
    """Its version where this engine was chosen, as on a worker; empty where there is none."""

    @contextmanager
    def loaded(self, threads: int | None = None) -> Iterator[Any]:
        """Mitsuba, set to this variant.

        One thread of a process has it at a time, as variant and threads are the whole process's:
        a worker of a cluster may be given several renders at once.

        Args:
            threads: that a render may use; all cores by default.

        Raises:
            WedgeError: Mitsuba is not installed.
        """
        with _ONE_AT_A_TIME:
            if self.library:
                os.environ[LIBRARY_VARIABLE] = self.library
            try:
                import mitsuba as mi
            except ModuleNotFoundError as error:
                raise WedgeError(
                    f"the twin renders with Mitsuba: {how_to_install('simulation')}."
                ) from error
            mi.set_variant(self.variant)
            mi.set_log_level(mi.LogLevel.Error)  # else it warns of every rounded number of samples
            import drjit

            before = drjit.thread_count()
            drjit.set_thread_count(threads or before)
            try:
                yield mi
            finally:
                drjit.set_thread_count(before)


SCALAR = Engine(variant="scalar_rgb")


@lru_cache
def best_engine() -> Engine:
    """The fastest engine with which a trial render succeeds: on a GPU, compiled, or the plain one.

    Raises:
        WedgeError: Mitsuba is not installed.
    """
    with SCALAR.loaded():
        pass
    candidates = [Engine(variant="cuda_ad_rgb")] if has_nvidia_driver() else []
    candidates += [Engine(variant="llvm_ad_rgb", library=path) for path in llvm_libraries()]
    return next((engine for engine in candidates if renders(engine)), SCALAR)


def has_nvidia_driver() -> bool:
    """Whether the driver of an NVIDIA GPU is found."""
    try:
        ctypes.CDLL(NVIDIA_DRIVER)
    except OSError:
        return False
    return True


def llvm_libraries() -> list[str]:
    """Paths of libLLVM that are new enough, the newest first."""
    if own := os.environ.get(LIBRARY_VARIABLE):
        return [own]
    found: dict[int, str] = {}
    for folder in SEARCHED:
        for pattern in ("libLLVM*.so*", "*/libLLVM*.so*", "*/lib/libLLVM*", "*/*/libLLVM*.dylib"):
            for path in sorted(Path(folder).glob(pattern)):
                version = llvm_version(path.resolve().name) or llvm_version(path.name)
                if version >= OLDEST_LLVM:
                    found.setdefault(version, str(path))
    return [found[version] for version in sorted(found, reverse=True)]


def llvm_version(name: str) -> int:
    """Major version that a library's file name tells; 0 where it tells none."""
    match = re.search(r"libLLVM(?:-|\.so\.)(\d+)", name)
    return int(match[1]) if match else 0


def renders(engine: Engine) -> bool:
    """Whether a render with this engine comes back, tried where a crash does no harm."""
    environment = {**os.environ, **({LIBRARY_VARIABLE: engine.library} if engine.library else {})}
    command = [sys.executable, "-c", _TRIAL, engine.variant]
    try:
        done = subprocess.run(command, env=environment, capture_output=True, timeout=TRIAL_S)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0
