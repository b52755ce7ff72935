# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The compiled engine is used where it works; where it crashes, nobody notices."""

import sys

import numpy as np
import pytest

from sensor.design import FINGER
from sensor.errors import WedgeError
from simulation import engine
from simulation.engine import SCALAR, Engine, best_engine, llvm_libraries, llvm_version, renders
from simulation.render import render
from simulation.skin import gel_view


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mitsuba")
    monkeypatch.setattr(engine, "best_engine", best_engine.__wrapped__)


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM.so.19.1", 19),
        ("libLLVM-15.so.1", 15),
        ("libLLVM-19.so", 19),
        ("libLLVM.so", 0),
        ("libc.so.6", 0),
    ],
)
def test_a_librarys_version_is_in_its_name(name: str, version: int) -> None:
    assert llvm_version(name) == version


def test_old_libraries_are_not_tried(tmp_path, monkeypatch) -> None:
    for name in ("libLLVM-15.so.1", "libLLVM.so.18.1", "libLLVM-21.so"):
        (tmp_path / name).touch()
    monkeypatch.delenv(engine.LIBRARY_VARIABLE, raising=False)
    monkeypatch.setattr(engine, "SEARCHED", (str(tmp_path),))
    assert llvm_libraries() == [str(tmp_path / "libLLVM-21.so"), str(tmp_path / "libLLVM.so.18.1")]


def test_a_library_that_the_user_names_is_the_only_one_tried(tmp_path, monkeypatch) -> None:
    (tmp_path / "libLLVM-21.so").touch()
    monkeypatch.setattr(engine, "SEARCHED", (str(tmp_path),))
    monkeypatch.setenv(engine.LIBRARY_VARIABLE, "/opt/mine/libLLVM.so")
    assert llvm_libraries() == ["/opt/mine/libLLVM.so"]


def test_an_engine_that_crashes_costs_a_child_only(fresh, monkeypatch) -> None:
    crash = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    monkeypatch.setattr(engine, "_TRIAL", crash)
    monkeypatch.setattr(engine, "has_nvidia_driver", lambda: True)
    monkeypatch.setattr(engine, "llvm_libraries", lambda: ["libLLVM-99.so"])
    assert not renders(Engine(variant="cuda_ad_rgb"))
    assert engine.best_engine() == SCALAR


def test_a_gpu_comes_before_the_processor_and_a_driver_alone_is_none(fresh, monkeypatch) -> None:
    gpu, compiled = (
        Engine(variant="cuda_ad_rgb"),
        Engine(variant="llvm_ad_rgb", library="libLLVM-99.so"),
    )
    monkeypatch.setattr(engine, "has_nvidia_driver", lambda: True)
    monkeypatch.setattr(engine, "llvm_libraries", lambda: ["libLLVM-99.so"])
    monkeypatch.setattr(engine, "renders", lambda item: True)
    assert engine.best_engine() == gpu
    monkeypatch.setattr(engine, "renders", lambda item: item != gpu)
    assert engine.best_engine() == compiled
    monkeypatch.setattr(engine, "has_nvidia_driver", lambda: False)
    monkeypatch.setattr(engine, "renders", lambda item: True)
    assert engine.best_engine() == compiled


def test_a_library_that_is_no_driver_is_not_taken_for_one(monkeypatch) -> None:
    monkeypatch.setattr(engine, "NVIDIA_DRIVER", "libno_such_driver.so.1")
    assert not engine.has_nvidia_driver()


def test_without_mitsuba_the_extra_is_named(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(WedgeError, match=r"\[simulation\]"), SCALAR.loaded():
        pass


def test_both_engines_see_the_same_gel(mitsuba) -> None:
    best = best_engine()
    if best == SCALAR:
        pytest.skip("no libLLVM 16 or later works on this machine")
    view = gel_view(FINGER, 16)
    pictures = [
        render(item, FINGER, view, np.zeros(view.size_px[::-1]), samples=256, seed=0)
        for item in (best, SCALAR)
    ]
    np.testing.assert_allclose(*(p.mean((0, 1)) for p in pictures), rtol=0.03)


def test_a_render_of_few_threads_leaves_the_others_what_they_had(mitsuba) -> None:
    import drjit

    had = drjit.thread_count()
    try:
        drjit.set_thread_count(3)
        with pytest.raises(ZeroDivisionError), SCALAR.loaded(threads=1):
            assert drjit.thread_count() == 1
            raise ZeroDivisionError
        with SCALAR.loaded():
            assert drjit.thread_count() == 3
    finally:
        drjit.set_thread_count(had)
