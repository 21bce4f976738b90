"""A soft layer with a pair of stiff electrodes, pressed at large strain, by NGSolve. Two scenes:

    pair       plane strain, a smooth plate over the whole top, to 10, 20 and 30 % compression
    footprint  in space, a block of 1 mm x 0.5 mm with edges rounded by 90 um, without friction, to 10 %

    pip install -r benches/peers/requirements.txt
    OMP_NUM_THREADS=1 python benches/peers/layer_ngsolve.py pair --size 1 --order 4
    OMP_NUM_THREADS=1 python benches/peers/layer_ngsolve.py footprint --size 2 --order 2

The layer is 450 um of an incompressible Mooney-Rivlin rubber, bonded to the substrate. Displacement of degree k with a
continuous pressure of degree k - 1, one pressure field in the rubber and one in the electrodes. `pair` is half the scene
on triangles; its end is free and may come down on the substrate. `footprint` is a quarter on a graded grid of bricks,
solved with k = 2 on a grid twice as coarse first, from where the grid asked for starts; its wall along x1 is held in x1
and its wall along x3 is free. Contact is by a penalty. Lengths are in um, stresses in kPa, seconds are processor time.
"""

import argparse

import numpy as np
from ngsolve import *

from layer_ngsolve_meshes import bricks, triangles
from layer_scene import C01, C10, H, STIFF, WIDTH, tell


class Level:
    """The equations on one mesh: unknowns, residual, tangent and Newton's method."""

    def __init__(self, mesh, order, scene):
        plane = scene == "pair"
        fixed = {"dirichletx": "bottom|axis" + ("" if plane else "|end"), "dirichlety": "bottom" + ("|top" if plane else "")}
        self.V = VectorH1(mesh, order=order, **fixed, **({} if plane else {"dirichletz": "bottom|axis3"}))
        pressure = H1(mesh, order=order - 1)
        part = lambda name: Compress(pressure, active_dofs=pressure.GetDofs(mesh.Materials(name)))
        self.X = self.V * part("rubber") * part("electrode")
        (u, p, pe), (v, q, qe) = self.X.TnT()
        F = Id(mesh.dim) + Grad(u)
        C = F.trans * F
        self.mesh, self.form, self.steps = mesh, BilinearForm(self.X, condense=order > 2), 0
        for name, p, q in (("rubber", p, q), ("electrode", pe, qe)):
            # In plane strain both invariants are equal, so the law is neo-Hooke's with the sum of both constants.
            c1, c2 = (STIFF / 2, 0) if name == "electrode" else (C10 + C01, 0) if plane or ARGS.neo_hooke else (C10, C01)
            stress = 2 * c1 * F + (p - 2 * c1 - 4 * c2) * Cof(F)
            if c2:
                stress += 2 * c2 * (Trace(C) * F - F * C)
            self.form += (InnerProduct(stress, Grad(v)) + (Det(F) - 1) * q).Compile() * dx(name, bonus_intorder=1)
        self.state = GridFunction(self.X)
        self.u = self.state.components[0]
        self.down, self.penalty, self.held, self.flat = Parameter(0.0), Parameter(2e4), Parameter(0.0), Parameter(0.0)
        positive = lambda s: IfPos(s, s, 0.0)
        if plane:
            self.form += -self.penalty * positive(-y - u[1]) * v[1] * ds("end", bonus_intorder=4)
        else:
            self.before = GridFunction(self.V)  # the displacement at which a Newton step starts

            def place(u):  # from the nearest point of the block without its rounding
                a, b, c = positive(x + u[0] - 410), positive(H - self.down + 90 - y - u[1]), positive(z + u[2] - 160)
                return CF((a, -b, c)), sqrt(a * a + b * b + c * c + 1e-12)

            # The block's curvature makes the tangent indefinite: far from the solution its normal is held in a step.
            away, distance = place(CF(tuple(IfPos(self.held, w, now) for w, now in zip(self.before, u))))
            push = self.penalty * positive(90 - place(u)[1]) / distance * away
            plate = IfPos(415 - x, IfPos(165 - z, -self.penalty * (self.down + u[1]), 0.0), 0.0) * v[1]
            self.form += -IfPos(self.flat, plate, push * v) * ds("top", bonus_intorder=4)
        dofs = self.V.components[1].GetDofs(mesh.Boundaries("top" if plane else "bottom"))
        self.ends = np.array([self.V.components[0].ndof + i for i in range(mesh.nv) if dofs[i]])  # u2 where force is read

    def residual(self):
        vector = self.state.vec.CreateVector()
        self.form.Apply(self.state.vec, vector)
        return vector

    def correct(self, given=None):
        """One step by the tangent, with a given movement of fixed unknowns or none; the largest movement of a corner."""
        form, residual, change = self.form, self.residual(), self.state.vec.CreateVector()
        form.AssembleLinearization(self.state.vec)
        residual.data *= -1
        if given:
            residual.data -= form.mat * given
        inverse = form.mat.Inverse(self.X.FreeDofs(form.condense), inverse=ARGS.solver)
        if form.condense:
            residual.data += form.harmonic_extension_trans * residual
        change.data = inverse * residual
        if given:
            change.data += given
        if form.condense:
            change.data += form.harmonic_extension * change
            change.data += form.inner_solve * residual
        self.state.vec.data += change
        self.steps += 1
        moves = change.FV().NumPy()[: self.V.ndof].reshape(self.mesh.dim, -1)[:, : self.mesh.nv]
        return np.abs(moves).max()

    def newton(self, limit=20, close=1e-3):
        """Whether the corrections fall under `close` (um)."""
        size = np.inf
        for _ in range(limit):
            self.held.Set(1.0 if size > 2 else 0.0)
            if self.mesh.dim == 3:
                self.before.vec.data = self.u.vec
            size = self.correct()
            if not size < 1e4:
                return False
            if size < close:
                return True
        return False


def press(level, start, end):
    """The plate from one compression to the next, in halves where Newton's method fails."""
    keep, given = level.state.vec.CreateVector(), level.state.vec.CreateVector()
    keep.data = level.state.vec
    given[:] = 0
    given.FV().NumPy()[level.ends] = (start - end) * H
    level.correct(given)
    if not level.newton(12):
        level.state.vec.data = keep
        if end - start < 1e-3:
            raise SystemExit(f"no solution past {start:.3f}")
        press(level, start, (start + end) / 2)
        press(level, (start + end) / 2, end)


def pair():
    level = Level(triangles(ARGS.size), ARGS.order, "pair")
    for start, end in ((0.0, 0.1), (0.1, 0.2), (0.2, 0.3)):
        press(level, start, end)
        force = -2e-6 * WIDTH * sum(level.residual().FV().NumPy()[level.ends])
        tell("pair", end, level.X.ndof, level.steps, force, gap(level))


def footprint():
    steps, coarse = [], None
    for factor, order in ((2, 2), (1, ARGS.order)):
        level = Level(bricks(ARGS.size * factor), order, "footprint")
        level.down.Set(0.1 * H)
        if coarse is None:  # a flat plate first, then the block
            level.flat.Set(1.0)
            level.penalty.Set(50.0)
            for _ in range(3):
                level.correct()
            level.flat.Set(0.0)
        else:
            far = (1400.0, H, 800.0)
            zs, ys, xs = np.meshgrid(*(np.linspace(0, f, n) for f, n in zip(far[::-1], (81, 46, 141))), indexing="ij")
            values = coarse.u(coarse.mesh(xs.ravel(), ys.ravel(), zs.ravel())).reshape(*xs.shape, 3)
            level.u.Set(CF(tuple(VoxelCoefficient((0, 0, 0), far, values[..., i].copy()) for i in range(3))))
        for penalty in (50.0, 500.0, 4000.0) if coarse is None else (4000.0,):
            level.penalty.Set(penalty)
            if not level.newton():
                raise SystemExit("Newton's method failed")
        steps.append(str(level.steps))
        coarse = level
    force = 4e-6 * sum(level.residual().FV().NumPy()[level.ends])
    scene = "footprint" + (", neo-Hooke" if ARGS.neo_hooke else "")
    tell(scene, 0.1, level.X.ndof, " + ".join(steps), force, gap(level))


def gap(level):
    inner = level.mesh.Boundaries("inner")
    return 50 + 2 * Integrate(level.u[0], level.mesh, definedon=inner) / Integrate(CF(1), level.mesh, definedon=inner)


SetNumThreads(1)
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scene", choices=["pair", "footprint"])
parser.add_argument("--size", type=float, default=1.0, help="factor on the sizes of the elements")
parser.add_argument("--order", type=int, default=3, help="degree of the displacement")
parser.add_argument("--solver", default="umfpack", help="umfpack, or pardiso where mkl is installed")
parser.add_argument("--neo-hooke", action="store_true", help="footprint with neo-Hooke's law of the same shear modulus")
ARGS = parser.parse_args()
{"pair": pair, "footprint": footprint}[ARGS.scene]()
