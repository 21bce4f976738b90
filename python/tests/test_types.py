"""Types: the package by itself, the stubs against the extension module, and a program that uses it."""

import os
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


@pytest.fixture(scope="module")
def mypy(tmp_path_factory):
    """Runs mypy, or one of its tools, with one cache for all tests: reading the types of NumPy and pandas takes longest."""
    environment = os.environ | {"MYPY_CACHE_DIR": str(tmp_path_factory.mktemp("mypy"))}

    def run(*arguments):
        done = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, env=environment)
        return done.returncode, done.stdout + done.stderr

    return run


def test_the_package_is_typed_throughout(mypy):
    status, told = mypy("mypy", "--config-file", CONFIG, "-p", "elastocap")
    assert status == 0, told


def test_the_stubs_say_what_the_extension_module_has(mypy, workspace):
    # The rest of the package imports much that is of no use here and takes long to read.
    (workspace / "mypy.ini").write_text("[mypy]\nfollow_imports = skip\n")
    status, told = mypy("mypy.stubtest", "--mypy-config-file", "mypy.ini", "elastocap._core")
    assert status == 0, told


def test_a_program_is_checked_against_the_types(workspace, mypy):
    (workspace / "program.py").write_text(PROGRAM)
    status, told = mypy("mypy", "--config-file", CONFIG, "program.py")
    errors = [line for line in told.splitlines() if ": error:" in line]
    assert status == 1 and len(errors) == 2, told
    assert "program.py:14" in errors[0] and "program.py:15" in errors[1]
