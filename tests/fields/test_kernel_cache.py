"""Compiled kernels never outlive the sources that they were compiled from."""

from __future__ import annotations

import ast
import gc
import importlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core import event
from numba.core.dispatcher import Dispatcher

from firstfix.fields import kernel_cache
from firstfix.fields.kernel_cache import PACKAGE, kernel, kernel_folder, kernel_sources


def kernels() -> list[Dispatcher]:
    found = []
    for file in kernel_sources():
        name = ".".join(["firstfix", *file.relative_to(PACKAGE).with_suffix("").parts])
        module = importlib.import_module(name)
        found += [
            value
            for value in vars(module).values()
            if isinstance(value, Dispatcher) and value.py_func.__module__ == name
        ]
    return found


def definition_of(name: str, module: str) -> Path:
    """Return the file that assigns a global name, through imports by ``from``."""
    path = PACKAGE.joinpath(*module.split(".")[1:]).with_suffix(".py")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and name in {alias.name for alias in node.names}:
            assert node.module is not None
            return definition_of(name, node.module)
    return path


def test_every_constant_and_callee_of_a_kernel_is_hashed():
    hashed = set(kernel_sources())
    assert len(kernels()) > 40
    for dispatcher in kernels():
        function = dispatcher.py_func
        for name in function.__code__.co_names:
            value = function.__globals__.get(name)
            if isinstance(value, (int, float, tuple, np.generic, np.ndarray, Dispatcher)):
                assert definition_of(name, function.__module__) in hashed, (function, name)


def test_every_file_with_a_kernel_is_hashed():
    hashed = set(kernel_sources())
    for file in PACKAGE.rglob("*.py"):
        if "\n@kernel\n" in file.read_text(encoding="utf-8"):
            assert file in hashed


def test_garbage_is_collected_again_after_a_kernel_was_compiled(monkeypatch, tmp_path):
    monkeypatch.setattr(kernel_cache, "kernel_folder", lambda: tmp_path)  # no test was here before
    collects = []

    @kernel
    def double(x: int) -> int:
        return 2 * x

    class Listener(event.Listener):
        def on_start(self, _: event.Event) -> None:
            collects.append(gc.isenabled())

        def on_end(self, _: event.Event) -> None:
            pass

    with event.install_listener("numba:compile", Listener()):
        assert double(2) == 4
    assert collects == [False]
    assert gc.isenabled()


def test_no_kernel_is_compiled_past_the_cache():
    for file in PACKAGE.rglob("*.py"):
        if file.name != "kernel_cache.py":
            assert "njit" not in file.read_text(encoding="utf-8"), file


SCRIPT = """
import numpy as np
from firstfix.global_localization.places import distinct_places
poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 3.9]])
print(len(distinct_places(poses, np.zeros(2), 0.05, 5)))
"""


def test_a_changed_constant_of_another_file_reaches_the_kernel(tmp_path):
    """With a full turn of 4 rad, headings of 0 and 3.9 rad are one place."""
    ignored = shutil.ignore_patterns("__pycache__", "static", "lab", "web", "ros", "cli")
    package = shutil.copytree(PACKAGE, tmp_path / "firstfix", ignore=ignored)
    angles = package / "core" / "angles.py"
    text = angles.read_text(encoding="utf-8")
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment["PYTHONPATH"] = str(tmp_path)

    def places(content: str) -> int:
        angles.write_text(content, encoding="utf-8")
        command = [sys.executable, "-c", SCRIPT]
        ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return int(ran.stdout)

    assert places(text) == 2
    assert places(f"{text}\nFULL_TURN = 4.0\n") == 1
    assert places(text) == 2


@pytest.fixture
def fresh(monkeypatch):
    """Choose the folder anew, in this test only."""
    monkeypatch.setattr(kernel_cache, "kernel_folder", kernel_folder.__wrapped__)
    return kernel_folder.__wrapped__


def test_settings_of_numba_stay_as_they_are():
    before = numba.config.CACHE_DIR

    @kernel
    def double(x: int) -> int:
        return 2 * x

    assert double(4) == 8
    assert before == numba.config.CACHE_DIR


def test_a_named_folder_is_used(fresh, monkeypatch, tmp_path):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "named"))
    assert fresh().parent == tmp_path / "named"


def test_an_installation_that_cannot_be_written_uses_the_cache_folder_of_the_user(
    fresh, monkeypatch, tmp_path
):
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setenv("FIRSTFIX_CACHE_DIR", str(tmp_path))
    writable = kernel_cache._is_writable
    monkeypatch.setattr(
        kernel_cache, "_is_writable", lambda path: PACKAGE not in path.parents and writable(path)
    )
    assert fresh().parent == tmp_path
    assert fresh().is_dir()


def test_folders_unused_for_a_day_are_removed_but_for_the_last_four(fresh, monkeypatch, tmp_path):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    for days in range(10):
        folder = tmp_path / f"kernels-{days}"
        folder.mkdir()
        (folder / "kernel.nbc").touch()
        os.utime(folder, times=(time.time() - 86_500.0 * days,) * 2)
    (tmp_path / "of numba").mkdir()
    used = fresh()
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {used.name, "kernels-0", "kernels-1", "kernels-2", "of numba"}
