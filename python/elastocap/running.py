"""Runs: from a case to its result."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from typing import NamedTuple, TextIO

from . import _core
from .cases import Case
from .errors import ElastocapWarning
from .results import Result

__all__ = ["Progress", "run"]


class Progress(NamedTuple):
    """How far a run is."""

    done: int
    """Steps that are done."""
    total: int
    """Steps to be solved; 0 while the run is being planned. A step that has load and scene of an earlier one is not solved again."""
    doing: str
    """What is being done, in words."""
    seconds: float
    """Time since the run began, s."""
    remaining: float | None
    """Time that the rest will take, by the steps that are done, s; None before the first is."""


def run(
    case: Case,
    *,
    threads: int | None = None,
    fields: bool = False,
    prune: bool = True,
    max_time: float | None = None,
    progress: bool | Callable[[Progress], object] | None = None,
) -> Result:
    """Solves a case.

    The numbers are those that the command writes to ``curve.csv``, to the last bit, and do not depend on the number of threads. Python's
    lock is free while it computes, so that other threads of the program go on.

    case
        From :func:`elastocap.load` or :func:`elastocap.loads`.
    threads
        How many threads compute; without a number as many as the machine has processors.
    fields
        Whether the fields are kept, for :attr:`Step.field` and for the files of :meth:`Result.save`. A field takes some 100 bytes
        for each node of its grid, and a few hundred for each node of tetrahedra.
    prune
        False leaves nothing out, as ``--no-prune`` of the command: the same numbers without using symmetry, for instance.
    max_time
        Stops the run after this time, s. The result has what is finished by then, and is marked as stopped.
    progress
        True shows a bar on the standard error; a function is called with a :class:`Progress` whenever it changes, by the thread that
        called ``run``. An exception that it raises stops the run and is raised from here.

    A step that fails is no exception: :attr:`Result.complete` is false then, :attr:`Step.status` says how each step went, and what the
    command warns of is given to :mod:`warnings`, as :class:`ElastocapWarning`.

    Ctrl-C stops the run in order and raises KeyboardInterrupt; its attribute ``result`` has what is finished.

    >>> import elastocap
    >>> case = elastocap.load("cases/cube-in-cube.toml").with_(relative_tolerance=1e-2)
    >>> result = elastocap.run(case, threads=2, progress=lambda p: print(p.done, "of", p.total) if p.done else None)
    1 of 1
    >>> result.terminals, result.maxwell.shape
    (('inner',), (1, 1, 1))
    """
    if not isinstance(case, Case):
        raise TypeError(f"run takes a case, from elastocap.load or elastocap.loads, and not a {type(case).__name__}")
    if threads is not None and not 1 <= threads <= 1024:
        raise ValueError(f"threads must be between 1 and 1024, and not {threads}")
    if max_time is not None and not max_time >= 0:
        raise ValueError(f"max_time must be a number of seconds, and not {max_time}")
    report, close = _reporter(progress)
    begun = time.monotonic()

    def notify(done: int, total: int, doing: str) -> None:
        seconds = time.monotonic() - begun
        remaining = seconds / done * (total - done) if done else None
        report(Progress(done, total, doing, seconds, remaining))

    try:
        outcome, stopped_by = _core.run(
            case._core, threads, prune, fields, True, max_time, 1, notify if progress else None, None
        )
    finally:
        close()
    result = Result(case, outcome)
    if stopped_by is not None:
        stopped_by.result = result  # type: ignore[attr-defined]
        raise stopped_by
    for text in result.warnings:
        warnings.warn(text, ElastocapWarning, stacklevel=2)
    return result


def _reporter(
    progress: bool | Callable[[Progress], object] | None,
) -> tuple[Callable[[Progress], object], Callable[[], None]]:
    """What is told of the progress, and what is done at the end."""
    if progress is True:
        bar = _Bar(sys.stderr)
        return bar.show, bar.clear
    if callable(progress):
        return progress, lambda: None
    return lambda _: None, lambda: None


class _Bar:
    """A bar of text on one line of a stream."""

    WIDTH = 30

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.shown = 0

    def show(self, progress: Progress) -> None:
        filled = self.WIDTH * progress.done // max(progress.total, 1)
        text = f"{'#' * filled}{'.' * (self.WIDTH - filled)} {progress.done}/{progress.total} steps, {progress.seconds:.0f} s elapsed"
        if progress.remaining is not None:
            text += f", about {max(progress.remaining, 1):.0f} s left"
        elif progress.doing:
            text += f", {progress.doing}"
        self._write(text)

    def clear(self) -> None:
        self._write("")
        self.stream.write("\r")
        self.stream.flush()

    def _write(self, text: str) -> None:
        self.stream.write("\r" + text.ljust(self.shown))
        self.stream.flush()
        self.shown = len(text)
