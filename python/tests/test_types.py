"""Types: the package by itself, the stubs against the extension module, and a program that uses it."""

import subprocess
import sys

import pytest

from conftest import ROOT

pytest.importorskip("mypy")
CONFIG = str(ROOT / "python/pyproject.toml")

PROGRAM = """
import numpy as np
from numpy.typing import NDArray
import elastocap

case: elastocap.Case = elastocap.load("a.toml").with_(gap="40 um").with_({"layer.thickness": "400 um"})
result = elastocap.run(case, threads=2, progress=lambda progress: print(progress.done))
force: NDArray[np.float64] = result.force
for step in result:
    field = step.field
    if isinstance(field, elastocap.GridField):
        potential: NDArray[np.float64] = field.potential
folder: str = str(result.save("results").folder)
wrong: int = result.force
elastocap.run("a.toml")
"""


def mypy(*arguments):
    done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def test_the_package_is_typed_throughout():
    status, told = mypy("mypy", "--config-file", CONFIG, "-p", "elastocap")
    assert status == 0, told


def test_the_stubs_say_what_the_extension_module_has():
    status, told = mypy("mypy.stubtest", "elastocap._core")
    assert status == 0, told


def test_a_program_is_checked_against_the_types(workspace):
    (workspace / "program.py").write_text(PROGRAM)
    status, told = mypy("mypy", "--strict", "program.py")
    errors = [line for line in told.splitlines() if ": error:" in line]
    assert status == 1 and len(errors) == 2, told
    assert "program.py:15" in errors[0] and "program.py:16" in errors[1]
