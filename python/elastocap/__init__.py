"""What capacitance will a soft touch or pressure sensor show under a force, and how far may the number be trusted?

A case describes an elastomer layer, the electrodes in it, the surroundings and the load. :func:`load` reads one, :func:`run` solves it, and
the result has the capacitance of each load step with a proved lower and upper bound, as NumPy arrays in SI units.

>>> import elastocap
>>> case = elastocap.load("cases/in-plane-pair.toml")
>>> result = elastocap.run(case.with_(gap="40 um", relative_tolerance=1e-2))
>>> bool(result.capacitance[0] > result.capacitance[-1] > 0)    # F: it falls under load
True
"""

from ._core import VERSION as __version__
from .cases import Case, load, loads
from .errors import CaseError, ElastocapError, ElastocapWarning, OutputError, Problem
from .fields import GridField, MeshField
from .results import Measurement, Result, Saved, Step
from .running import Progress, run
from .sweeps import sweep

__all__ = [
    "Case",
    "CaseError",
    "ElastocapError",
    "ElastocapWarning",
    "GridField",
    "Measurement",
    "MeshField",
    "OutputError",
    "Problem",
    "Progress",
    "Result",
    "Saved",
    "Step",
    "__version__",
    "load",
    "loads",
    "run",
    "sweep",
]
