"""What the tests of the Python package share.

They test the installed package, from the folder `python/` of a clone, with the command beside it: `cargo build --release` and
`pip install ./python` come first. `pytest python/tests`.
"""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def workspace(tmp_path, monkeypatch):
    """A folder of its own for each test, with the cases of the clone as `cases`."""
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def command():
    """Runs the command with these arguments."""
    program = Path(os.environ.get("ELASTOCAP_COMMAND", ROOT / "target/release/elastocap"))
    if not program.is_file():
        pytest.fail(f"there is no {program}: build it with `cargo build --release`, or set ELASTOCAP_COMMAND")

    def run(*arguments, status=0):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        return done

    return run
