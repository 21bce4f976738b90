"""The layer of cases/layer-on-substrate.toml by FElupe: half-length 4 H, bonded bottom, smooth top, free end, to 40 %.

    pip install felupe==11.3
    python benches/peers/layer_felupe.py [elements over the thickness, 24 if not given] [last compression, 0.4]

Bilinear quadrilaterals with constant pressure and dilatation, kappa/mu = 5000, no contact: the set-up that gets through
in this program. Prints force over mu H w and seconds. elastocap on the same work:

    cargo run --release -- run cases/layer-on-substrate.toml
"""

import sys
import time

import felupe
import numpy as np

n = int(sys.argv[1]) if len(sys.argv) > 1 else 24
last = float(sys.argv[2]) if len(sys.argv) > 2 else 0.4

start = time.perf_counter()
mesh = felupe.Rectangle(b=(4.0, 1.0), n=(4 * n + 1, n + 1))
region = felupe.RegionQuad(mesh)
field = felupe.FieldsMixed(region, n=3, planestrain=True)
u = field[0]
bounds = {
    "axis": felupe.Boundary(u, fx=0.0, skip=(0, 1)),
    "bottom": felupe.Boundary(u, fy=0.0),
    "top": felupe.Boundary(u, fy=1.0, skip=(1, 0)),
}
solid = felupe.SolidBody(felupe.ThreeFieldVariation(felupe.NeoHooke(mu=1.0, bulk=5000.0)), field)
step = felupe.Step(
    items=[solid],
    ramp={bounds["top"]: -felupe.math.linsteps([0.0, last], num=round(last / 0.01))},
    boundaries=bounds,
)
top = np.isclose(mesh.points[:, 1], 1.0)


def tell(number, _, substep):
    force = substep.fun[: u.values.size].reshape(-1, 2)[top, 1].sum() if substep.fun is not None else float("nan")
    compression = -bounds["top"].value
    if round(compression * 1000) % 50 == 0 and compression > 0:
        print(f"{compression:.2f} force {2 * abs(force):.4f} mu H w, {time.perf_counter() - start:.1f} s", flush=True)


plugin = lambda context, state: tell(state.stepnumber, state.substepnumber, context.substep)
felupe.Job(steps=[step], plugins=[plugin]).evaluate(verbose=False)
print(f"{mesh.ncells} elements, {u.values.size} displacements: {time.perf_counter() - start:.1f} s in all")
