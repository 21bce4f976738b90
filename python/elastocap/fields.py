"""The field around the sensor at one step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._arrays import floats, integers

if TYPE_CHECKING:
    from . import _core

__all__ = ["GridField", "MeshField"]


@dataclass(frozen=True, eq=False, repr=False)
class GridField:
    """The field of a step on a grid of boxes, with ``n1`` x ``n2`` x ``n3`` nodes. Arrays have x1 first and cannot be written to."""

    axes: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
    """Coordinates of the nodes along x1, x2 and x3, m; shapes (n1,), (n2,), (n3,)."""
    points: NDArray[np.float64] | None
    """Where the nodes are instead, m, shape (n1, n2, n3, 3), in a scene that is bent; otherwise None."""
    potential: NDArray[np.float64]
    """At the nodes, V; shape (n1, n2, n3)."""
    electric_field: NDArray[np.float64]
    """At the nodes, V/m; shape (n1, n2, n3, 2, 3). The component along an axis may jump at a node, where bodies meet: ``[..., 0, a]`` is
    its value below the node along axis ``a``, ``[..., 1, a]`` above it."""
    relative_permittivity: NDArray[np.float64]
    """Of the cells, 1 in conductors; shape (n1 - 1, n2 - 1, n3 - 1)."""
    body_id: NDArray[np.int32]
    """Which body fills each cell, as its place in ``body_names``; shape (n1 - 1, n2 - 1, n3 - 1)."""
    body_names: tuple[str, ...]
    """Names of the bodies: the surroundings, the dielectrics, the conductors."""

    def __repr__(self) -> str:
        return f"<elastocap.GridField of {' x '.join(str(n) for n in self.potential.shape)} nodes>"


@dataclass(frozen=True, eq=False, repr=False)
class MeshField:
    """The field of a step on ``m`` tetrahedra with ``n`` nodes. Arrays cannot be written to."""

    points: NDArray[np.float64]
    """Where the nodes are, m; shape (n, 3)."""
    cells: NDArray[np.int32]
    """The corners of each tetrahedron, as places in ``points``; shape (m, 4)."""
    point_data: dict[str, NDArray[np.float64]]
    """Fields at the nodes by their names in the ``.vtu`` file: ``potential``, V, shape (n,), for instance."""
    cell_data: dict[str, NDArray[np.float64]]
    """Fields in the tetrahedra: ``relative_permittivity``, shape (m,), for instance."""
    body_id: NDArray[np.int32]
    """Which body each tetrahedron is part of, as its place in ``body_names``; shape (m,)."""
    body_names: tuple[str, ...]
    """Names of the bodies."""

    def __repr__(self) -> str:
        return f"<elastocap.MeshField of {len(self.cells)} tetrahedra>"


def field_of(raw: _core._Grid | _core._Mesh) -> GridField | MeshField:
    """The field with its arrays in shape."""
    body_id, names = raw["body_id"], tuple(raw["body_names"])
    if "axes" in raw:
        x1, x2, x3 = (floats(axis, -1) for axis in raw["axes"])
        nodes = (len(x1), len(x2), len(x3))
        cells = tuple(count - 1 for count in nodes)
        bent = raw["points"]
        return GridField(
            axes=(x1, x2, x3),
            points=None if bent is None else floats(bent, *nodes, 3),
            potential=floats(raw["potential"], *nodes),
            electric_field=floats(raw["electric_field"], *nodes, 2, 3),
            relative_permittivity=floats(raw["relative_permittivity"], *cells),
            body_id=integers(body_id, *cells),
            body_names=names,
        )
    return MeshField(
        points=floats(raw["points"] or b"", -1, 3),
        cells=integers(raw["cells"], -1, 4),
        point_data={name: _named(*array) for name, array in raw["point_data"].items()},
        cell_data={name: _named(*array) for name, array in raw["cell_data"].items()},
        body_id=integers(body_id, -1),
        body_names=names,
    )


def _named(components: int, data: bytes) -> NDArray[np.float64]:
    return floats(data, -1) if components == 1 else floats(data, -1, components)
