"""Sweeps: many cases from one with values changed, and one table of all, on this machine or on a cluster of Dask."""

from __future__ import annotations

import itertools
import math
import os
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from . import _core
from .cases import Case, _resolved, _toml
from .errors import CaseError, ElastocapWarning
from .results import Result
from .running import Progress, _reporter

if TYPE_CHECKING:
    import distributed
    import pandas

__all__ = ["sweep"]

Grid = Mapping[str, "str | Iterable[Any]"]
Values = Mapping[str, Any]
Row = dict[str, Any]


def sweep(
    case: Case,
    grid: Grid | Sequence[Values],
    *,
    client: distributed.Client | None = None,
    workers: int | None = None,
    prune: bool = True,
    progress: bool | Callable[[Progress], object] | None = None,
) -> pandas.DataFrame:
    """Solves a case with other values, many times, and gives one table with a row for each case and step.

    case
        The case that is varied.
    grid
        Either a dictionary of keys, as :meth:`Case.with_` takes them, and the values of each: every value is combined with every other one,
        and the last key changes fastest. Values are a list, or a text as ``--set`` of ``elastocap sweep`` takes it:
        ``"10um..100um:10"``, ``"1e-3..1e-1:3:log"``, ``"400um, 450um"``. Or a list of cases, each a dictionary of the values that it has.
    client
        A ``distributed.Client`` of Dask, on whose workers the cases are solved, one task for each. A task of a worker that dies is solved by
        another one; the table is the same. Without it they are solved on this machine. elastocap must be installed on the workers, and
        files that the case names must be under the same path.
    workers
        How many cases are solved at the same time on this machine, each on one thread; as many as there are processors without a number.
    prune, progress
        As in :func:`elastocap.run`; the steps of the progress are the cases.

    The table has the columns of the command's ``sweep.csv``: ``case`` (counted from 0), one for each key (a number in SI units, or the text
    as it was given), ``step``, the columns of ``curve.csv``, and ``message`` with what is to be said of the step. A case that is refused is
    no exception: it has one row with the status ``refused`` and the reason in ``message``. Cases are in their order, and the table does not
    depend on what was solved where and when. ``table.to_parquet("sweep.parquet")`` writes it as Parquet, where pyarrow is installed.

    Raises :class:`CaseError` if a key cannot be set in any case, and KeyboardInterrupt at Ctrl-C. Takes pandas.

    >>> import elastocap
    >>> case = elastocap.load("cases/in-plane-pair.toml").with_(compression=[0.0, 0.2], relative_tolerance=1e-2)
    >>> table = elastocap.sweep(case, {"gap": ["40 um", "50 um"], "height": ["200 um", "225 um"]})
    >>> table[["case", "electrodes.in_plane_pair.gap", "electrodes.in_plane_pair.height", "step"]].head(3)
       case  electrodes.in_plane_pair.gap  electrodes.in_plane_pair.height  step
    0     0                       0.00004                         0.000200     0
    1     0                       0.00004                         0.000200     1
    2     1                       0.00004                         0.000225     0
    """
    import pandas  # noqa: F401  (before hours of work, rather than after them)

    if not isinstance(case, Case):
        raise TypeError(f"sweep takes a case, from elastocap.load or elastocap.loads, and not a {type(case).__name__}")
    if workers is not None and workers < 1:
        raise ValueError(f"workers must be at least 1, and not {workers}")
    cases = list(_cases(case, grid))
    if not cases:
        raise ValueError("the grid has no values, so there are no cases")
    keys = list(dict.fromkeys(key for values in cases for key in values))
    for key in keys:
        # A key that cannot be set in any case is a mistake of the whole sweep.
        _core.with_value(case.text, key, next(values[key] for values in cases if key in values))
    report, close = _reporter(progress)
    begun = time.monotonic()

    def notify(done: int) -> None:
        seconds = time.monotonic() - begun
        remaining = seconds / done * (len(cases) - done) if done else None
        report(Progress(done, len(cases), "solving", seconds, remaining))

    try:
        if client is None:
            solved = _on_this_machine(case, cases, workers or os.cpu_count() or 1, prune, notify)
        else:
            solved = _on_cluster(client, case, cases, prune, notify)
    finally:
        close()
    return _table(case, keys, cases, solved)


def _cases(case: Case, grid: Grid | Sequence[Values]) -> Iterator[dict[str, str]]:
    """The values of each case, in TOML by the paths of their keys."""
    if isinstance(grid, Mapping):
        keys = [_resolved(case.text, name) for name in grid]
        if len(set(keys)) < len(keys):
            raise CaseError("error: a key is varied twice, by its path and by its short name")
        choices = [_choices(key, values) for key, values in zip(keys, grid.values(), strict=True)]
        for chosen in itertools.product(*choices) if keys else ():
            yield dict(zip(keys, chosen, strict=True))
    else:
        for values in grid:
            yield {_resolved(case.text, name): _toml(value, name) for name, value in values.items()}


def _choices(key: str, values: str | Iterable[Any]) -> list[str]:
    if isinstance(values, str):
        return _core.sweep_values(key, values)
    if isinstance(values, Mapping) or not isinstance(values, Iterable):
        raise TypeError(f"the values of `{key}` are a list, or a text such as \"10um..100um:10\", and not a {type(values).__name__}")
    return [_toml(value, key) for value in values]


def _solve(
    text: str, path: str, values: dict[str, str], prune: bool, at_once: int, cancelled: Callable[[], bool] | None = None
) -> list[Row] | None:
    """The rows of one case; None if it was cancelled. Nothing in them depends on the machine or the time."""
    try:
        for key, value in values.items():
            text = _core.with_value(text, key, value)
        core = _core.parse(text, path)
    except CaseError as error:
        told = [f"{problem.message}; {problem.help}" if problem.help else problem.message for problem in error.problems]
        return [{"step": None, "status": "refused", "message": _one_line("\n".join(told) or str(error).removeprefix("error: "))}]
    outcome, stopped_by = _core.run(core, 1, prune, False, False, None, at_once, None, cancelled)
    if stopped_by is not None:
        raise stopped_by
    if outcome.stopped:
        return None
    columns: dict[str, Sequence[Any]] = {"step": range(len(outcome))}
    for name in Result.columns()[:-2]:
        numbers = memoryview(outcome.numbers(name)).cast("d")
        columns[name] = [number if math.isfinite(number) else math.nan for number in numbers]
    columns |= {"unknowns": outcome.unknowns, "status": outcome.statuses}
    columns["message"] = [_one_line(reason or "") for reason in outcome.reasons]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _one_line(text: str) -> str:
    return "; ".join(line.strip() for line in text.splitlines() if line.strip())


def _on_this_machine(
    case: Case, cases: list[dict[str, str]], workers: int, prune: bool, notify: Callable[[int], None]
) -> list[list[Row]]:
    """In threads of this process: Python's lock is free while a case is solved."""
    stop = threading.Event()
    at_once = min(workers, len(cases))
    solved: list[list[Row] | None] = [None] * len(cases)
    pool = ThreadPoolExecutor(at_once, thread_name_prefix="elastocap-sweep")
    try:
        todo = iter(enumerate(cases))

        def begin(count: int) -> dict[Future[list[Row] | None], int]:
            path = os.fspath(case.path)
            return {
                pool.submit(_solve, case.text, path, values, prune, at_once, stop.is_set): index
                for index, values in itertools.islice(todo, count)
            }

        # A few at a time, so that a million cases do not wait in memory, and Ctrl-C finds few of them.
        running, done = begin(2 * at_once), 0
        notify(done)
        while running:
            # With a time limit, so that Ctrl-C is seen on every system.
            for future in wait(running, timeout=0.1, return_when=FIRST_COMPLETED).done:
                solved[running.pop(future)] = future.result()
                running |= begin(1)
                done += 1
                notify(done)
    except BaseException:
        stop.set()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    return [rows or [] for rows in solved]


def _on_cluster(
    client: distributed.Client, case: Case, cases: list[dict[str, str]], prune: bool, notify: Callable[[int], None]
) -> list[list[Row]]:
    """One task for each case. Dask gives those of a worker that died to another one."""
    from distributed import as_completed

    text, path = case.text, os.fspath(case.path.absolute())
    # Not pure: a table is that of this program, and not of an earlier one whose results the cluster still holds.
    at_once = _at_once(client)
    futures = [client.submit(_solve, text, path, values, prune, at_once, pure=False, retries=3) for values in cases]
    notify(0)
    try:
        for done, _ in enumerate(as_completed(futures), 1):
            notify(done)
        found: list[list[Row]] = client.gather(futures)
        return found
    except BaseException:
        client.cancel(futures)
        raise


def _at_once(client: distributed.Client) -> int:
    """How many tasks share the memory of a machine, at most: the threads of the workers on it."""
    threads: Counter[str | None] = Counter()
    for address, count in client.nthreads().items():
        threads[urlsplit(address).hostname] += count
    return max(threads.values(), default=1)


def _table(case: Case, keys: list[str], cases: list[dict[str, str]], solved: list[list[Row]]) -> pandas.DataFrame:
    import pandas

    given = {key: _value(case, key) for key in keys}
    rows: list[Row] = []
    for index, (values, found) in enumerate(zip(cases, solved, strict=True)):
        start = {"case": index, **{key: _shown(values.get(key, given[key])) for key in keys}}
        rows.extend(start | row for row in found)
    table = pandas.DataFrame(rows, columns=["case", *keys, "step", *Result.columns(), "message"])
    numbers = {name: "float64" for name in Result.columns()[:-2]}
    table = table.astype({**numbers, "case": "int64", "step": "Int64", "unknowns": "Int64", "status": "object", "message": "object"})
    refused = int((table["status"] == "refused").sum())
    if refused:
        warnings.warn(f"{refused} of {len(cases)} cases are refused; the column `message` has the reasons", ElastocapWarning, stacklevel=3)
    return table


def _value(case: Case, key: str) -> str:
    """What the case itself has for a key, in TOML; empty where it has nothing."""
    found = case.parameters.get(key)
    return "" if found is None else _toml(found, key)


def _shown(value: str) -> float | str:
    """A number in SI units, or the text without its quotation marks."""
    number = _core.number_in_si(value)
    if number is not None:
        return number
    return value[1:-1] if len(value) >= 2 and value[0] == value[-1] == '"' else value
