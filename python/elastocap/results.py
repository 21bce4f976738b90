"""What a run found: arrays, tables of other libraries, files."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import floats
from .errors import ElastocapWarning
from .fields import GridField, MeshField, field_of

if TYPE_CHECKING:
    import pandas
    import xarray

    from .cases import Case

__all__ = ["Measurement", "Result", "Saved", "Step"]

_UNITS = {"_m": "m", "_n": "N", "_f": "F", "_f_per_n": "F/N"}


class Measurement(NamedTuple):
    """What ``capacitance`` is."""

    kind: str
    """``"two_terminal"``, ``"mutual"``, ``"own"`` (against ground), ``"guarded"`` (the first terminal against ground with the second, its
    guard, at the same potential), or ``"matrix"``, of which one entry is shown: the first that ``[measure]`` names, or the mutual
    capacitance of the first two terminals."""
    terminals: tuple[str, ...]
    """The names of its terminals."""


class Saved(NamedTuple):
    """Where the files of a run are."""

    folder: Path
    """The folder that was asked for. For a run that was stopped, and for one with failed steps where the folder holds a complete result,
    the folder beside it whose name ends in ``.partial``."""
    files: tuple[Path, ...]
    """The files, sorted."""


class Step:
    """One load step of a result. Numbers are those of the arrays of :class:`Result`; NaN where there is none."""

    __slots__ = ("_result", "index")

    def __init__(self, result: Result, index: int) -> None:
        self._result = result
        self.index = index
        """Its place among the steps, counted from 0."""

    def __getitem__(self, column: str) -> Any:
        """A number, or the status, by the name of its column in ``curve.csv``."""
        return self._result[column][self.index]

    @property
    def compression(self) -> float:
        """U/H."""
        return float(self._result.compression[self.index])

    @property
    def force(self) -> float:
        """Of the indenter on the layer, N."""
        return float(self._result.force[self.index])

    @property
    def capacitance(self) -> float:
        """What is measured, F; see :attr:`Result.measurement`."""
        return float(self._result.capacitance[self.index])

    @property
    def lower(self) -> float:
        """Lower bound of the capacitance, F."""
        return float(self._result.lower[self.index])

    @property
    def upper(self) -> float:
        """Upper bound of the capacitance, F."""
        return float(self._result.upper[self.index])

    @property
    def change(self) -> float:
        """Capacitance less that of the first load step, F."""
        return float(self._result.change[self.index])

    @property
    def maxwell(self) -> NDArray[np.float64]:
        """Maxwell capacitance matrix, F; shape (k, k) for k terminals."""
        matrix: NDArray[np.float64] = self._result.maxwell[self.index]
        return matrix

    @property
    def maxwell_lower(self) -> NDArray[np.float64]:
        """Lower bounds of its entries, F; shape (k, k)."""
        matrix: NDArray[np.float64] = self._result.maxwell_lower[self.index]
        return matrix

    @property
    def maxwell_upper(self) -> NDArray[np.float64]:
        """Upper bounds of its entries, F; shape (k, k)."""
        matrix: NDArray[np.float64] = self._result.maxwell_upper[self.index]
        return matrix

    @property
    def status(self) -> str:
        """How it went, in the words of ``curve.csv``."""
        return self._result.status[self.index]

    @property
    def ok(self) -> bool:
        """Whether it has all that was asked for."""
        return self._result._outcome.ok[self.index]

    @property
    def reason(self) -> str | None:
        """Why it failed, missed its tolerance or has no force; None where it did not."""
        return self._result._outcome.reasons[self.index]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What one should know about it."""
        return tuple(self._result._outcome.step_warnings[self.index])

    @property
    def seconds(self) -> float:
        """How long it took, s; 0 for a step that is taken from an earlier one."""
        return self._result._outcome.seconds[self.index]

    @property
    def field(self) -> GridField | MeshField | None:
        """The field around the sensor, if the run was asked for ``fields=True`` and the step has one. Made anew each time."""
        raw = self._result._outcome.field(self.index)
        return None if raw is None else field_of(raw)

    def __repr__(self) -> str:
        return f"<elastocap.Step {self.index}: {self.status}>"


class Result:
    """What a run found. Arrays have one entry for each of the ``n`` load steps, are in SI units and cannot be written to; an entry is NaN
    where ``curve.csv`` has an empty cell.

    ``result["gap_m"]`` gives any column of ``curve.csv`` by its name, ``result[0]`` or iteration the steps.

    >>> import elastocap
    >>> result = elastocap.run(elastocap.load("cases/in-plane-pair.toml").with_(relative_tolerance=1e-2))
    >>> result.force.shape, result.maxwell.shape
    ((6,), (6, 2, 2))
    >>> bool((result.lower <= result.capacitance).all() and (result.capacitance <= result.upper).all())
    True
    """

    def __init__(self, case: Case, outcome: _core.Outcome) -> None:
        self.case = case
        """The case that was run."""
        self._outcome = outcome

    @staticmethod
    def columns() -> tuple[str, ...]:
        """The names of the columns of ``curve.csv``, in their order."""
        return tuple(_core.Outcome.columns())

    # A column of curve.csv for each.

    def _numbers(self, column: str) -> NDArray[np.float64]:
        return floats(self._outcome.numbers(column), len(self))

    @cached_property
    def compression(self) -> NDArray[np.float64]:
        """Displacement of the top over the thickness of the layer, U/H; shape (n,)."""
        return self._numbers("compression")

    @cached_property
    def force(self) -> NDArray[np.float64]:
        """Of the indenter on the layer, N; shape (n,). NaN where the closed form has none."""
        return self._numbers("force_n")

    @cached_property
    def capacitance(self) -> NDArray[np.float64]:
        """What is measured (see :attr:`measurement`), F; shape (n,)."""
        return self._numbers("capacitance_f")

    @cached_property
    def lower(self) -> NDArray[np.float64]:
        """Lower bound of the capacitance, F; shape (n,). Proved, or estimated with ``bounds = false`` in the case."""
        return self._numbers("capacitance_lower_f")

    @cached_property
    def upper(self) -> NDArray[np.float64]:
        """Upper bound of the capacitance, F; shape (n,). Proved, or estimated with ``bounds = false`` in the case."""
        return self._numbers("capacitance_upper_f")

    @cached_property
    def change(self) -> NDArray[np.float64]:
        """Capacitance less that of the first load step, F; shape (n,)."""
        return self._numbers("change_f")

    @cached_property
    def change_lower(self) -> NDArray[np.float64]:
        """Lower bound of the change, F; shape (n,)."""
        return self._numbers("change_lower_f")

    @cached_property
    def change_upper(self) -> NDArray[np.float64]:
        """Upper bound of the change, F; shape (n,)."""
        return self._numbers("change_upper_f")

    @cached_property
    def status(self) -> tuple[str, ...]:
        """How each step went, in the words of ``curve.csv``."""
        return tuple(self._outcome.statuses)

    @overload
    def __getitem__(self, key: int) -> Step: ...
    @overload
    def __getitem__(self, key: str) -> Any: ...
    def __getitem__(self, key: int | str) -> Any:
        if isinstance(key, str):
            if key == "status":
                return self.status
            if key == "unknowns":
                return tuple(self._outcome.unknowns)
            return self._numbers(key)
        return self.steps[key]

    # Matrices.

    @property
    def terminals(self) -> tuple[str, ...]:
        """Names of the k driven terminals, in the order of the matrices."""
        return tuple(self._outcome.terminals)

    @property
    def measurement(self) -> Measurement | None:
        """What ``capacitance`` is; None without conductors."""
        found = self._outcome.measurement
        return None if found is None else Measurement(found[0], tuple(found[1]))

    @cached_property
    def _maxwell(self) -> tuple[NDArray[np.float64], ...]:
        k = len(self.terminals)
        return tuple(floats(part, len(self), k, k) for part in self._outcome.maxwell())

    @property
    def maxwell(self) -> NDArray[np.float64]:
        """Maxwell capacitance matrices (Q = C V), F; shape (n, k, k) for k terminals. NaN where a step was not solved."""
        return self._maxwell[0]

    @property
    def maxwell_lower(self) -> NDArray[np.float64]:
        """Lower bounds of their entries, F; shape (n, k, k)."""
        return self._maxwell[1]

    @property
    def maxwell_upper(self) -> NDArray[np.float64]:
        """Upper bounds of their entries, F; shape (n, k, k)."""
        return self._maxwell[2]

    # Steps.

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The load steps in the order of the case; a case without a load has one."""
        return tuple(Step(self, index) for index in range(len(self)))

    def __len__(self) -> int:
        return len(self._outcome)

    def __iter__(self) -> Iterator[Step]:
        return iter(self.steps)

    # How it went.

    @property
    def complete(self) -> bool:
        """Whether every step has all that was asked for: where the command ends with exit status 0, and not 3."""
        return self._outcome.complete

    @property
    def stopped(self) -> bool:
        """Whether the run was stopped, by Ctrl-C or ``max_time``, before all steps were done."""
        return self._outcome.stopped

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the command warns of. :func:`elastocap.run` has also given each of them to Python's :mod:`warnings`."""
        return tuple(self._outcome.warnings)

    @property
    def seconds(self) -> float:
        """Wall-clock time of all steps together, s."""
        return self._outcome.solve_seconds

    @property
    def threads(self) -> int:
        """Threads that worked on it."""
        return self._outcome.threads

    # Other forms.

    def to_dict(self) -> dict[str, Any]:
        """All that ``result.json`` holds, but for the names of files: floating conductors, meshes of the layer, the plan, times."""
        document: dict[str, Any] = json.loads(self._outcome.json())
        return document

    def to_pandas(self) -> pandas.DataFrame:
        """A table with the columns of ``curve.csv`` and one row for each step; the index is the step, counted from 0.

        Takes pandas, which is not installed with elastocap unless asked for: ``pip install './python[pandas]'``.
        """
        import pandas

        columns: dict[str, Any] = {name: self[name] for name in self.columns()}
        columns["unknowns"] = pandas.array(list(self["unknowns"]), dtype="Int64")
        return pandas.DataFrame(columns, index=pandas.RangeIndex(len(self), name="step"))

    def to_xarray(self) -> xarray.Dataset:
        """A data set with the dimensions ``step`` (n), ``row`` and ``column`` (the k terminals, by name).

        It has the columns of ``curve.csv`` along ``step``, with compression and force as coordinates, and ``maxwell_f``,
        ``maxwell_lower_f`` and ``maxwell_upper_f`` of shape (n, k, k). The attribute ``units`` has the unit of each.

        Takes xarray, which is not installed with elastocap unless asked for: ``pip install './python[xarray]'``.
        """
        import xarray

        along: dict[str, Any] = {}
        for name in self.columns():
            if name == "unknowns":
                values: Any = np.array([np.nan if n is None else n for n in self[name]], dtype=np.float64)
            elif name == "status":
                values = np.array(self.status, dtype=np.str_)
            else:
                values = self[name]
            along[name] = ("step", values, _attributes(name))
        names = list(self.terminals)
        coordinates = {"step": np.arange(len(self)), "row": names, "column": names}
        coordinates |= {name: along.pop(name) for name in ("compression", "force_n")}
        parts = {"maxwell_f": self.maxwell, "maxwell_lower_f": self.maxwell_lower, "maxwell_upper_f": self.maxwell_upper}
        for name, matrices in parts.items():
            along[name] = (("step", "row", "column"), matrices, {"units": "F"})
        measured = self.measurement
        attributes = {"title": self.case.title, "complete": int(self.complete)}
        if measured is not None:
            attributes |= {"measurement": measured.kind, "terminals": list(measured.terminals)}
        return xarray.Dataset(along, coords=coordinates, attrs=attributes)

    def save(self, folder: str | os.PathLike[str], *, scene: bool = True) -> Saved:
        """Writes the files that ``elastocap run CASE --output FOLDER`` writes: all at once, in place of those of an earlier run.

        Without ``fields=True`` in :func:`elastocap.run` they are those of ``--no-fields``; ``scene=False`` leaves out ``scene.glb``.
        A result that was stopped goes to the folder whose name ends in ``.partial``, as the command's does.

        Raises :class:`OutputError` if the files cannot be written, or files of somebody else are in their place.
        """
        found, files, told = self._outcome.save(os.fspath(folder), scene)
        known = set(self.warnings)
        for text in told:
            if text not in known:
                warnings.warn(text, ElastocapWarning, stacklevel=2)
        return Saved(found, tuple(files))

    def __repr__(self) -> str:
        state = "complete" if self.complete else "stopped" if self.stopped else "incomplete"
        return f"<elastocap.Result of {self.case.title!r}: {len(self)} steps, {state}>"


def _attributes(column: str) -> dict[str, str]:
    """The unit of a column, by the end of its name."""
    if column in ("status", "unknowns"):
        return {}
    fitting = [unit for ending, unit in _UNITS.items() if column.endswith(ending)]
    return {"units": fitting[-1] if fitting else "1"}
