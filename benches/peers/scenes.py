"""The scenes that every program solves, and what is known of them.

`known` maps an entry of the answer to its value in farad: "C11", "C22", "C12" are entries of the Maxwell matrix, "C" is the
capacitance between two terminals with equal and opposite charges. `cases` are the case files of elastocap in cases/; those
with "imported" in their names hold the same bodies, from OBJ files, and those that end with "on-tetrahedra" take them as surfaces,
though they are boxes.
"""

from dataclasses import dataclass
from math import pi

EPS0 = 8.8541878128e-12
OPEN = 4 * pi * EPS0  # F/m


@dataclass(frozen=True)
class Scene:
    title: str
    cases: tuple
    known: dict
    source: str

    def error(self, entries):
        """The largest relative error among the known entries."""
        return max(abs(entries[name] / value - 1) for name, value in self.known.items())


def two_terminal(c11, c12, c22):
    """Equal and opposite charges on two conductors, from their Maxwell matrix."""
    return (c11 * c22 - c12 * c12) / (c11 + 2 * c12 + c22)


SCENES = {
    "cube-in-cube": Scene(
        "cube in cube",
        ("imported-cube-in-cube.toml", "imported-cube-in-cube-on-tetrahedra.toml"),
        {"C11": 19.127134997 * EPS0},
        "19.127134997 eps0 a by boundary elements graded towards the edges, degree and grading raised together "
        "(charge balance 2e-16)",
    ),
    "two-spheres": Scene(
        "two spheres, open",
        ("two-spheres.toml",),
        {
            "C11": 0.01105933977598848 * OPEN,
            "C22": 0.02185361967309565 * OPEN,
            "C12": -0.004444944336055013 * OPEN,
        },
        "series of image charges, every digit; the table has the worst of C11, C22 and C12",
    ),
    "layered-spheres": Scene(
        "layered spheres",
        ("layered-spheres.toml",),
        {"C11": OPEN / ((1 / 4) * (1 / 1e-3 - 1 / 1.5e-3) + (1 / 2) * (1 / 1.5e-3 - 1 / 2e-3))},
        "closed form: 4 pi eps0 / sum (1/eps_k) (1/r_k - 1/r_(k+1))",
    ),
    "in-plane-pair": Scene(
        "in-plane pair, unloaded",
        (
            "in-plane-pair-unloaded.toml",
            "in-plane-pair-as-outlines.toml",
            "in-plane-pair-imported.toml",
            "in-plane-pair-imported-on-tetrahedra.toml",
        ),
        {"C": 43.96589e-15},
        "our reference: graded hexahedra of order 7 to 9, 43.965895 fF and falling, good to 1e-6; hexahedra and tetrahedra of "
        "two codes agree to 7e-6",
    ),
    "square-plates": Scene(
        "square plates, open, gap a/10",
        ("square-plates.toml",),
        {"C": 1.039044814755 * OPEN},
        "1.039044814755 * 4 pi eps0 a by boundary elements graded towards the edges, stable to 1e-12",
    ),
    "coaxial-discs": Scene(
        "coaxial discs, open, gap R/10",
        ("coaxial-discs.toml",),
        {"C": 1.1755923194 * EPS0 * pi * 0.03**2 / 0.003},
        "1.1755923194 eps0 pi R^2 / d by Love's integral equation",
    ),
}
