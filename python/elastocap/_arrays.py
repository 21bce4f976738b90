"""From the bytes of the extension module to arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def floats(data: bytes, *shape: int) -> NDArray[np.float64]:
    """The numbers in an array of this shape, which cannot be written to: a result stays what it was."""
    return np.frombuffer(data, dtype=np.float64).reshape(shape)


def integers(data: bytes, *shape: int) -> NDArray[np.int32]:
    """The same for integers."""
    return np.frombuffer(data, dtype=np.int32).reshape(shape)
