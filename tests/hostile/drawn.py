"""Cases drawn from the schema: random ones of every key, most of them valid.

The schema gives the keys and their types. What it cannot give is which lengths fit one another: that is in the tables of this file,
in units of a length that is drawn for each case, and in a few functions for what depends on more than one key. A key that the tables
do not know is drawn by its type alone, so that new keys are tried too.
"""

import pathlib

from .schema import Walk, alternatives

MESH = pathlib.Path(__file__).resolve().parent.parent.parent / "cases/dome-from-gmsh.msh"
MESH_GROUPS = [("conductor", "dome"), ("conductor", "sheet"), ("dielectric", "rubber")]

UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}

# Ranges by path. Lengths are in units of the case's length, moduli in pascals; numbers without a dimension are bare.
RANGES = {
    "layer.thickness": (2.0, 5.0),
    "layer.half_length": (8.0, 20.0),
    "layer.relative_permittivity": (1.0, 10.0),
    "layer.foam.solid_permittivity": (2.0, 5.0),
    "layer.foam.solid_fraction": (0.1, 0.7),
    "layer.material.neo_hookean.shear_modulus": (2e4, 2e5),
    "layer.material.neo_hookean.bulk_modulus": (1e6, 1e9),
    "layer.material.mooney_rivlin.c10": (1e4, 1e5),
    "layer.material.mooney_rivlin.c01": (1e3, 1e4),
    "layer.material.mooney_rivlin.bulk_modulus": (1e6, 1e9),
    "layer.material.yeoh.c10": (1e4, 1e5),
    "layer.material.yeoh.c20": (-1e2, 1e3),
    "layer.material.yeoh.c30": (0.0, 1e2),
    "layer.material.yeoh.bulk_modulus": (1e6, 1e9),
    "layer.material.ogden.terms.mu": (1e4, 1e5),
    "layer.material.ogden.terms.alpha": (1.0, 3.0),
    "layer.material.ogden.bulk_modulus": (1e6, 1e9),
    "layer.material.gent.shear_modulus": (2e4, 2e5),
    "layer.material.gent.limiting_invariant": (10.0, 100.0),
    "layer.material.gent.bulk_modulus": (1e6, 1e9),
    "electrodes.in_plane_pair.gap": (0.1, 1.0),
    "electrodes.in_plane_pair.length": (0.5, 2.0),
    "electrodes.in_plane_pair.thickness": (0.05, 0.2),
    "electrodes.in_plane_pair.width": (1.0, 4.0),
    "electrodes.in_plane_pair.height": (0.4, 1.5),
    "electrodes.in_plane_pair.shear_modulus": (1e4, 1e9),
    "electrodes.stacked_pair.gap": (0.2, 0.8),
    "electrodes.stacked_pair.length": (0.5, 2.0),
    "electrodes.stacked_pair.thickness": (0.05, 0.2),
    "electrodes.stacked_pair.width": (1.0, 4.0),
    "electrodes.stacked_pair.height": (0.8, 1.2),
    "electrodes.stacked_pair.shear_modulus": (1e4, 1e9),
    "electrodes.comb.fingers": (2, 6),
    "electrodes.comb.finger_width": (0.1, 0.4),
    "electrodes.comb.gap": (0.1, 0.4),
    "electrodes.comb.overlap": (0.5, 2.0),
    "electrodes.comb.end_gap": (0.1, 0.3),
    "electrodes.comb.bus_width": (0.1, 0.4),
    "electrodes.array.pads": (1, 3),
    "electrodes.array.size": (0.3, 0.8),
    "electrodes.array.diameter": (0.4, 0.8),
    "electrodes.array.inner_diameter": (0.1, 0.35),
    "electrodes.array.pitch": (0.9, 1.5),
    "electrodes.array.common_plate.margin": (0.0, 0.5),
    "electrodes.spiral.turns": (1, 2),
    "electrodes.spiral.trace_width": (0.1, 0.2),
    "electrodes.spiral.gap": (0.1, 0.2),
    "electrodes.spiral.inner": (0.3, 0.5),
    "electrodes.ring.diameter": (0.8, 2.0),
    "electrodes.ring.inner_diameter": (0.2, 0.7),
    "mechanics.closed_form.contact_half_length": (4.0, 10.0),
    "mechanics.closed_form.contact_width": (4.0, 20.0),
    "mechanics.closed_form.shear_length": (4.0, 10.0),
    "mechanics.plane_strain.width": (2.0, 10.0),
    "mechanics.plane_strain.indenter.flat_punch.half_width": (1.0, 4.0),
    "mechanics.plane_strain.indenter.flat_punch.corner_radius": (0.1, 0.5),
    "mechanics.plane_strain.indenter.flat_punch.position": (-1.0, 1.0),
    "mechanics.plane_strain.indenter.cylinder.radius": (1.0, 5.0),
    "mechanics.plane_strain.indenter.cylinder.position": (-1.0, 1.0),
    "mechanics.solid.width": (8.0, 20.0),
    "mechanics.solid.indenter.flat_punch.half_width": (1.0, 4.0),
    "mechanics.solid.indenter.flat_punch.half_depth": (1.0, 4.0),
    "mechanics.solid.indenter.flat_punch.corner_radius": (0.1, 0.5),
    "mechanics.solid.indenter.cylinder.radius": (1.0, 5.0),
    "mechanics.solid.indenter.sphere.radius": (1.0, 5.0),
    "load.approach": (0.1, 5.0),
    "load.compression.from": (0.0, 0.05),
    "load.compression.to": (0.06, 0.3),
    "load.compression.points": (1, 3),
    "load.force.points": (1, 3),
    "load.steps.shift": (-0.1, 0.1),
    "indenter.height": (0.5, 5.0),
    "indenter.role.relative_permittivity": (1.0, 10.0),
    "dielectric.relative_permittivity": (0.5, 20.0),
    "surroundings.relative_permittivity": (1.0, 3.0),
    "surroundings.side_margin": (1.0, 8.0),
    "surroundings.below.relative_permittivity": (1.0, 10.0),
    "surroundings.above.relative_permittivity": (1.0, 10.0),
    "surroundings.below.thickness": (0.5, 5.0),
    "surroundings.above.thickness": (0.5, 8.0),
    "measurement.gain": (0.5, 2.0),
}

# Alternatives of one key: the words, and the share of the cases that take one of them rather than a quantity or a table.
WORDS = {
    "mechanics.closed_form.shear_length": (["finite-element"], 0.15),
    "mechanics.plane_strain.indenter": (["whole-top"], 0.4),
    "mechanics.solid.indenter": (["whole-top"], 0.4),
    "electrodes.in_plane_pair.shear_modulus": (["rigid"], 0.6),
    "electrodes.stacked_pair.shear_modulus": (["rigid"], 0.6),
    "indenter.role": (["grounded", "floating", "absent"], 0.7),
}

# Cheap runs: loose tolerances.
TOLERANCES = [0.5, 0.3, 0.2, 0.1, 0.1, 0.05, 0.03, 0.01]


class Scene(Walk):
    """One case. After `draw`, `case` is the tree of its keys and `files` what must lie beside it."""

    weights = {
        "conductor.box": 6, "conductor.boxes": 2, "conductor.sheet": 2, "conductor.sphere": 1, "conductor.capsule": 0.7,
        "conductor.cylinder": 1.5, "conductor.extrusion": 1.5, "conductor.surface": 0.3, "conductor.shell": 0.0, "conductor.physical": 0.0,
        "dielectric.box": 4, "dielectric.slab": 2, "dielectric.sphere": 0.7, "dielectric.capsule": 0.5, "dielectric.cylinder": 1,
        "dielectric.extrusion": 1, "dielectric.surface": 0.2, "dielectric.physical": 0.0,
        "load.compression": 3, "load.force": 1.5, "load.steps": 1.5,
    }
    chances = {
        "title": 0.3, "terminal": 0.3, "measure": 0.4, "measurement": 0.05, "conductor.charge": 0.1, "electrostatics": 1.0,
        "electrostatics.relative_tolerance": 1.0, "electrostatics.solver": 0.06, "electrostatics.order": 0.05, "electrostatics.bounds": 0.1,
        "electrostatics.change_tolerance": 0.04, "dielectric.attached": 0.1, "layer.half_length": 0.5,
    }

    def __init__(self, rng, schema, cheap=False):
        super().__init__(rng)
        # A scene that is solved in a second or two: few bodies, loose tolerances.
        self.cheap = cheap
        self.schema = schema
        self.files = {}
        self.case = {}
        # Round shapes take tetrahedra, which cost more: most cases are without them.
        if rng.random() < (0.9 if cheap else 0.85):
            dear = [f"{body}.{shape}" for body in ("conductor", "dielectric") for shape in ("sphere", "capsule", "cylinder", "extrusion", "surface")]
            self.weights = {**self.weights, **dict.fromkeys(dear, 0.0)}
        self.u = float(f"{rng.choice([1, 2, 2.5, 5])}e{rng.choice([-6, -5, -5, -4, -4, -4, -3, -3, -2])}")
        self.unit = rng.choice(["um", "um", "mm", "mm", "m", "nm"])
        self.names = []
        self.bodies = 0

    # --- quantities -------------------------------------------------------------------------------------------------------------

    def length(self, times):
        """So many lengths of the case."""
        unit = self.unit if self.rng.random() < 0.95 else self.rng.choice(list(UNITS))
        return f"{times * self.u / UNITS[unit]:.9g} {unit}"

    def point(self, coordinates):
        return [self.length(x) for x in coordinates]

    def between(self, low, high):
        return round(self.rng.uniform(low, high), 3)

    def force(self):
        """A force that compresses the layer by a few hundredths, roughly."""
        layer = self.case["layer"]
        area = {"closed_form": 40.0, "plane_strain": 20.0, "solid": 30.0}[self.moves] * self.u ** 2
        return float(f"{area * 1e5 * self.rng.uniform(0.0, 0.2) if layer else 0.0:.3g}")

    # --- what the walk asks -----------------------------------------------------------------------------------------------------

    def fitting(self, path, node):
        by_hand = getattr(self, "fit_" + path.replace(".", "_"), None)
        if by_hand:
            return by_hand(node)
        word = WORDS.get(path)
        if word and self.rng.random() < word[1]:
            return self.rng.choice(word[0])
        if word and not (path in RANGES):
            tables = [choice for choice in alternatives(node) if choice.get("type") == "object"]
            return self.table(path, tables[0]) if tables else None
        if path not in RANGES or any(choice.get("type") in ("array", "object") for choice in alternatives(node)):
            return None
        low, high = RANGES[path]
        sample = next((choice["examples"][0] for choice in alternatives(node) if "examples" in choice), None)
        if sample is None:
            whole = any(choice.get("type") == "integer" for choice in alternatives(node))
            return self.rng.randint(low, high) if whole else self.between(low, high)
        if sample.endswith("Pa"):
            return f"{self.rng.uniform(low, high):.4g} Pa"
        return self.length(self.between(low, high))

    # --- bodies -----------------------------------------------------------------------------------------------------------------

    def body(self, shape_is_flat=False):
        """The lower corner and the size of a place in which a body does not touch another one."""
        if not self.slots:
            return [self.between(-3, 3) for _ in range(3)], [1.0, 1.0, 1.0]
        corner = self.slots.pop() if self.rng.random() < 0.97 else self.rng.choice(self.slots)
        return corner, [self.between(0.3, 2.0) for _ in range(3)]

    def fit_conductor_box(self, node):
        corner, size = self.body()
        return {"min": self.point(corner), "max": self.point([a + b for a, b in zip(corner, size)])}

    fit_dielectric_box = fit_conductor_box

    def fit_conductor_boxes(self, node):
        corner, size = self.body()
        end = [a + b for a, b in zip(corner, size)]
        middle = corner[0] + size[0] * self.rng.choice([0.25, 0.5])
        lower = corner[2] + size[2] * self.rng.choice([0, 0.5])
        return [{"min": self.point(corner), "max": self.point([middle, end[1], end[2]])},
                {"min": self.point([middle, corner[1], lower]), "max": self.point(end)}]

    def fit_conductor_sheet(self, node):
        corner, size = self.body()
        across = self.rng.randrange(3)
        rest = [k for k in range(3) if k != across]
        return {"normal": f"x{across + 1}", "at": self.length(corner[across]), "min": self.point([corner[k] for k in rest]),
                "max": self.point([corner[k] + size[k] for k in rest])}

    def fit_conductor_sphere(self, node):
        corner, size = self.body()
        radius = round(min(size) / 2, 3)
        return {"center": self.point([x + radius for x in corner]), "radius": self.length(radius)}

    fit_dielectric_sphere = fit_conductor_sphere

    def fit_conductor_capsule(self, node):
        corner, size = self.body()
        radius = round(min(size) / 4, 3)
        ends = [x + radius for x in corner], [x + y - radius for x, y in zip(corner, size)]
        return {"from": self.point(ends[0]), "to": self.point(ends[self.rng.choice([0, 1, 1, 1])]), "radius": self.length(radius)}

    fit_dielectric_capsule = fit_conductor_capsule

    def fit_conductor_cylinder(self, node, flat=True):
        corner, size = self.body()
        axis = self.rng.choice([1, 1, 1, 0, 2])
        radius = round(min(size[k] for k in range(3) if k != axis) / 2, 3)
        base = [x + (0 if k == axis else radius) for k, x in enumerate(corner)]
        made = {"axis": f"x{axis + 1}", "base": self.point(base), "radius": self.length(radius),
                "height": self.length(0 if flat and self.rng.random() < 0.3 else size[axis])}
        if self.rng.random() < 0.3:
            made["inner_radius"] = self.length(round(radius * self.between(0.2, 0.8), 4))
        return made

    def fit_dielectric_cylinder(self, node):
        return self.fit_conductor_cylinder(node, flat=False)

    def fit_conductor_extrusion(self, node):
        corner, size = self.body()
        axis = self.rng.choice([1, 1, 1, 0, 2])
        rest = [k for k in range(3) if k != axis]
        at = lambda x, y: self.point([corner[rest[0]] + size[rest[0]] * x, corner[rest[1]] + size[rest[1]] * y])
        outline = self.rng.choice([
            [at(0, 0), at(1, 0), at(0.5, 1)],
            [at(0, 0), at(1, 0), at(1, 1), at(0, 1)],
            [at(0, 0), at(1, 0), at(1, 0.4), at(0.4, 0.4), at(0.4, 1), at(0, 1)],
            [at(0, 0), at(0.8, 0), {"through": at(0.9, 0.5), "to": at(0.8, 1)}, at(0, 1)],
            [{"corner": at(x, y), "radius": self.length(min(size) * 0.2)} for x, y in [(0, 0), (1, 0), (1, 1), (0, 1)]],
            [at(0, 0), at(1, 0), {"spline": [at(0.9, 0.4), at(0.8, 0.7)], "to": at(1, 1)}, at(0, 1)],
            [{"spline": [at(0.5, 0), at(1, 0.5), at(0.5, 1), at(0, 0.5)], "to": at(0.5, 0)}],
        ])
        made = {"axis": f"x{axis + 1}", "from": self.length(corner[axis]), "to": self.length(corner[axis] + size[axis]), "outline": outline}
        if len(outline) == 4 and isinstance(outline[2], list) and self.rng.random() < 0.3:
            made["holes"] = [[at(0.3, 0.3), at(0.7, 0.3), at(0.7, 0.7), at(0.3, 0.7)]]
        elif self.rng.random() < 0.05:
            made["holes"] = [[at(0.3, 0.3), {"through": at(0.4, 0.2), "to": at(0.5, 0.3)}, {"corner": at(0.5, 0.5), "radius": self.length(0.01)},
                              {"spline": [at(0.35, 0.45)], "to": at(0.3, 0.4)}]]
        return made

    fit_dielectric_extrusion = fit_conductor_extrusion

    def fit_dielectric_slab(self, node):
        low = self.between(-4, 4)
        return {"axis": self.rng.choice(["x1", "x2", "x2", "x3"]), "from": self.length(low), "to": self.length(low + self.between(0.5, 3))}

    def fit_conductor_surface(self, node):
        corner, size = self.body()
        self.files["body.obj"] = cube()
        made = {"file": "body.obj", "unit": f"{min(size) * self.u * 1e3:.6g} mm", "translate": self.point(corner)}
        if self.rng.random() < 0.1:
            del made["translate"]
        return made

    fit_dielectric_surface = fit_conductor_surface

    def fit_conductor_shell(self, node):
        return {"center": self.point([1.0, 1.0, 1.0]), "radius": self.length(self.between(14, 30))}

    def fit_conductor_name(self, node):
        self.bodies += 1
        self.names.append(f"c{self.bodies}")
        return self.names[-1]

    def fit_dielectric_name(self, node):
        self.bodies += 1
        return f"d{self.bodies}"

    def fit_conductor_charge(self, node):
        return self.rng.choice(["0 C", "0 C", "1 pC", "-0.5 pC"])

    def fit_conductor_attached(self, node):
        return self.rng.choice(self.attachments)

    fit_dielectric_attached = fit_conductor_attached

    # --- layer and electrodes ---------------------------------------------------------------------------------------------------

    def fit_layer_thickness(self, node):
        self.thickness = self.between(*RANGES["layer.thickness"])
        return self.length(self.thickness)

    def fit_layer_half_length(self, node):
        self.half_length = self.between(*RANGES["layer.half_length"])
        return self.length(self.half_length)

    def fit_electrode_thickness(self, node):
        self.thick = self.rng.choice([0, 0, 0.02, 0.05, 0.1])
        return self.length(self.thick)

    fit_electrodes_comb_thickness = fit_electrodes_array_thickness = fit_electrode_thickness
    fit_electrodes_spiral_thickness = fit_electrodes_ring_thickness = fit_electrode_thickness
    fit_electrodes_array_common_plate_thickness = fit_electrode_thickness

    def fit_height(self, node):
        return self.length(self.between(0.3, 1.0))

    fit_electrodes_comb_height = fit_electrodes_array_height = fit_electrodes_spiral_height = fit_electrodes_ring_height = fit_height

    def fit_electrodes_array_common_plate_height(self, node):
        return self.length(self.between(1.3, 1.8))

    def fit_center(self, node):
        return self.point([self.between(-1, 1), self.between(-1, 1)])

    fit_electrodes_comb_center = fit_electrodes_array_center = fit_electrodes_spiral_center = fit_electrodes_ring_center = fit_center

    def fit_guard(self, node):
        return {"gap": self.length(self.between(0.1, 0.4)), "width": self.length(self.between(0.1, 0.4))}

    fit_electrodes_comb_guard = fit_electrodes_array_guard = fit_electrodes_spiral_guard = fit_electrodes_ring_guard = fit_guard

    # --- load -------------------------------------------------------------------------------------------------------------------

    def fit_load_compression(self, node):
        largest = 0.12 if self.moves != "closed_form" else 0.3
        steps = [self.between(0, largest) for _ in range(self.rng.choice([0, 1, 1, 2]))]
        steps = sorted({0.0, *steps}) if self.rng.random() < 0.7 else steps or [0.05]
        if self.rng.random() < 0.2:
            return {"from": self.between(0, 0.05), "to": self.between(0.06, largest), "points": self.rng.choice([1, 2, 3])}
        return steps

    def fit_load_force(self, node):
        if self.rng.random() < 0.2:
            return {"from": "0 N", "to": f"{self.force()} N", "points": self.rng.choice([1, 2, 3])}
        return [f"{x} N" for x in sorted(self.force() for _ in range(self.rng.choice([1, 1, 2])))]

    def fit_load_steps(self, node):
        by_force = self.rng.random() < 0.2
        steps = []
        for _ in range(self.rng.choice([1, 2, 2, 3])):
            step = {"force": f"{self.force()} N"} if by_force else {"compression": self.between(0, 0.2)}
            if self.rng.random() < 0.4:
                step["shift"] = self.point([self.between(-0.1, 0.1), self.between(-0.1, 0.1)])
            if self.rng.random() < 0.2:
                step["tilt"] = [f"{self.between(-0.3, 0.3)} deg", f"{self.between(-0.005, 0.005)} rad"]
            steps.append(step)
        return steps

    def fit_load_approach(self, node):
        return sorted((self.length(x) for x in {self.between(0.1, 5) for _ in range(self.rng.choice([1, 2]))}), reverse=True)

    def fit_tolerance(self, node):
        return self.rng.choice([0.5, 0.3, 0.2] if self.cheap else TOLERANCES)

    fit_electrostatics_relative_tolerance = fit_tolerance

    def fit_electrostatics_bounds(self, node):
        return self.rng.random() < 0.2

    def fit_electrostatics_change_tolerance(self, node):
        return self.rng.choice([1.0, 0.5, 0.3])

    def fit_mechanics_tolerance(self, node):
        return self.rng.choice([0.3, 0.1, 0.1, 0.05])

    fit_mechanics_plane_strain_relative_tolerance = fit_mechanics_solid_relative_tolerance = fit_mechanics_tolerance

    # --- what is around, what is measured -----------------------------------------------------------------------------------------

    def fit_surroundings_boundary(self, node):
        return self.boundary

    def fit_surroundings_walls(self, node):
        low, high = [-9, -9, -9], [12, 12, 12]
        if self.rng.random() < 0.3:
            low, high = [self.between(-12, -6) for _ in low], [self.between(9, 14) for _ in high]
        return {"min": self.point(low), "max": self.point(high)}

    def face(self, path, node):
        words = [self.rng.choice(["insulated", "grounded"])]
        if self.rng.random() < 0.2:
            return words[0]
        made = {"relative_permittivity": self.between(1, 6), "thickness": self.length(self.between(2, 8))}
        if self.boundary == "open" and self.rng.random() < 0.5:
            made["thickness"] = "open"
        elif self.rng.random() < 0.4:
            made["then"] = self.rng.choice(words + [self.boundary])
        return made

    def fit_surroundings_above(self, node):
        return self.face("above", node)

    def fit_surroundings_below(self, node):
        return self.face("below", node)

    def fit_measurement_columns(self, node):
        load = self.rng.choice(["force", "displacement", "compression"])
        capacitance = {"name": "c", "unit": self.rng.choice(["fF", "pF"])}
        made = {load: {"name": "x", **{"force": {"unit": "mN"}, "displacement": {"unit": "um"}, "compression": {}}[load]}, "capacitance": capacitance}
        if self.rng.random() < 0.3:
            made["deviation"] = {"name": "s", "unit": "fF"}
        return made

    def fit_measurement_file(self, node):
        rows = "".join(f"{0.01 * k:g},{10 - k},0.1,{'up' if k % 2 else 'down'}\n" for k in range(self.rng.choice([1, 4, 8])))
        self.files["points.csv"] = b"# points\nx,c,s,way\n" + rows.encode()
        return "points.csv"

    def fit_measurement_rows(self, node):
        return {"column": "way", "equals": self.rng.choice(["up", "down"])}

    def fit_measurement_offset(self, node):
        load = next(iter(self.case.get("load", {"compression": 0})))
        return "1 mN" if load == "force" else 0.001

    # --- the whole --------------------------------------------------------------------------------------------------------------

    def top(self, key):
        """Draws one table of the case."""
        node = self.schema["properties"][key]
        table = next((choice for choice in alternatives(node) if choice.get("type") == "object"), node)
        self.case[key] = self.value(key, table)
        return self.case[key]

    def several(self, key, count):
        node = self.schema["properties"][key]["items"]
        if count:
            self.case[key] = [self.value(key, node) for _ in range(count)]

    def draw(self):
        rng = self.rng
        self.kind = rng.choices(["bodies", "layer", "mesh"], [5, 5, 0.0 if self.cheap else 0.2])[0]
        self.moves = None
        self.attachments = ["fixed"]
        self.boundary = rng.choices(["open", "grounded", "insulated"], [5, 3, 1])[0]
        self.case["format"] = 1
        if rng.random() < 0.3:
            self.case["title"] = rng.choice(["A case", "C <b>&</b> \"D\"", "case of 50 \u00b5m", "x"])
        {"bodies": self.draw_bodies, "layer": self.draw_layer, "mesh": self.draw_mesh}[self.kind]()
        self.draw_wires()
        self.top("electrostatics")
        if rng.random() < 0.1 and self.case.get("load"):
            self.case["measurement"] = self.any_value("measurement", self.schema["properties"]["measurement"])
        self.draw_new_keys()
        return self.case

    def draw_new_keys(self):
        """Tables that this file does not know yet."""
        known = {"format", "title", "conductor", "dielectric", "electrodes", "electrostatics", "indenter", "layer", "load", "measure",
                 "measurement", "mechanics", "mesh", "surroundings", "terminal"}
        for key in sorted(set(self.schema["properties"]) - known):
            if self.rng.random() < 0.05:
                self.case[key] = self.any_value(key, self.schema["properties"][key])

    def draw_bodies(self):
        rng = self.rng
        self.slots = [[3.0 * i - 4 + rng.choice([0, 0, 0.5]), 3.0 * j - 4, 3.0 * k - 4] for i in range(3) for j in range(3) for k in range(3)]
        rng.shuffle(self.slots)
        if self.cheap:
            # Neighbours.
            self.slots = [[0.0, 3.0, 0.0], rng.choice([[2.5, 0.0, 0.0], [0.0, 0.0, 2.5]]), [0.0, 0.0, 0.0]]
        shell = rng.random() < 0.04
        self.several("conductor", rng.choice([1, 2, 2] if self.cheap else [1, 2, 2, 2, 3, 3, 4]))
        self.several("dielectric", rng.choice([0, 0, 1] if self.cheap else [0, 0, 0, 1, 1, 2]))
        if shell:
            self.case["conductor"].append({"name": self.fit_conductor_name(None), "shell": self.fit_conductor_shell(None)})
            self.boundary = "open"
        for body in self.case["conductor"] + self.case.get("dielectric", []):
            body.pop("attached", None)
        self.case["surroundings"] = {"boundary": self.boundary}
        if self.boundary != "open":
            self.case["surroundings"]["walls"] = self.fit_surroundings_walls(None)
        if rng.random() < 0.2:
            self.case["surroundings"]["relative_permittivity"] = self.between(1, 3)

    def draw_mesh(self):
        """The whole scene is a mesh from Gmsh: a ball's quarter in a dielectric, from cases/."""
        self.files["mesh.msh"] = MESH.read_bytes()
        self.case["mesh"] = {"file": "mesh.msh", "unit": self.rng.choice(["mm", "um", "0.1 mm"])}
        for key, physical in MESH_GROUPS:
            body = {"name": physical, "physical": physical}
            if key == "dielectric":
                body["relative_permittivity"] = self.between(1, 10)
            else:
                self.names.append(physical)
            self.case.setdefault(key, []).append(body)
        self.case["surroundings"] = {"boundary": self.rng.choice(["open", "insulated", "grounded"])}

    def draw_layer(self):
        rng = self.rng
        self.moves = rng.choices([None, "closed_form", "plane_strain", "solid"], [2, 5, 3, 1])[0]
        layer = self.top("layer")
        properties = self.schema["properties"]["layer"]["properties"]
        if self.moves:
            laws = ["neo_hookean", "mooney_rivlin"] + ["yeoh", "ogden", "gent"] * (self.moves != "closed_form")
            self.weights = {**self.weights, **{f"layer.material.{law}": law in laws for law in ["neo_hookean", "mooney_rivlin", "yeoh", "ogden", "gent"]}}
            layer["material"] = self.table("layer.material", properties["material"])
            if self.moves == "closed_form":
                for law in layer["material"].values():
                    law.pop("bulk_modulus", None)
            self.chances = {**Scene.chances}
            self.case["mechanics"] = {self.moves: self.table(f"mechanics.{self.moves}", self.schema["properties"]["mechanics"]["properties"][self.moves])}
            self.repair_punch()
        if self.moves in ("plane_strain", "solid") and "half_length" not in layer:
            layer["half_length"] = self.fit_layer_half_length(None)
        if "foam" in layer and rng.random() < 0.9 and self.moves in ("plane_strain", "solid"):
            del layer["foam"]
        if ("foam" in layer) == ("relative_permittivity" in layer):
            layer.pop("foam", None)
            layer["relative_permittivity"] = self.between(1, 10)
        pressed = self.case.get("mechanics", {}).get(self.moves, {})
        flat = self.moves == "closed_form" or pressed.get("indenter") == "whole-top"
        self.field_indenter = bool(self.moves) and rng.random() < 0.25
        self.draw_electrodes()
        # Bodies over the layer, or in its upper part.
        above = self.thickness + rng.choice([0.0, 0.3])
        self.slots = [[3.0 * i - 4, above + 3.0 * j, 3.0 * k - 4] for i in range(3) for j in range(2) for k in range(3)]
        rng.shuffle(self.slots)
        others = 0 if self.field_indenter or self.moves == "solid" else rng.choice([0, 0, 0, 1, 1, 2])
        if not self.names and not others and rng.random() < 0.7:
            others = 2
        if self.moves and flat:
            self.attachments = ["layer-top", "fixed"]
        self.several("conductor", others)
        self.several("dielectric", rng.choice([0, 0, 0, 0, 1]) if not self.field_indenter else 0)
        if rng.random() < 0.15:
            self.draw_inside()
        if self.field_indenter:
            self.top("indenter")
        elif self.moves and rng.random() < 0.05:
            self.case["indenter"] = {"role": "absent"}
        if self.moves:
            self.draw_load(flat)
        self.draw_surroundings()

    def draw_inside(self):
        """A box or a sheet in the upper half of the layer."""
        low = self.between(0.75, 0.85) * self.thickness
        corner, size = [self.between(-2, 0), low, self.between(-2, 0)], [self.between(0.5, 2), 0.1 * self.thickness, self.between(0.5, 2)]
        body = {"name": self.fit_conductor_name(None)}
        if self.moves:
            body["attached"] = "layer"
        if self.rng.random() < 0.5:
            body["box"] = {"min": self.point(corner), "max": self.point([a + b for a, b in zip(corner, size)])}
        else:
            body["sheet"] = {"normal": "x2", "at": self.length(low), "min": self.point([corner[0], corner[2]]),
                             "max": self.point([corner[0] + size[0], corner[2] + size[2]])}
        self.case.setdefault("conductor", []).append(body)

    def repair_punch(self):
        """Sharp corners do not go with every contact, nor with every place."""
        indenter = self.case["mechanics"][self.moves].get("indenter")
        punch = indenter.get("flat_punch") if isinstance(indenter, dict) else None
        if not punch or self.rng.random() < 0.1:
            return
        if punch.get("contact", "smooth") != "smooth":
            punch.pop("corner_radius", None)
            punch.pop("half_depth", None)
        elif self.moves == "solid":
            punch.setdefault("corner_radius", self.length(0.3))
        if "corner_radius" not in punch:
            punch.pop("position", None)
            punch.pop("half_depth", None)

    def draw_electrodes(self):
        rng = self.rng
        forms = self.schema["properties"]["electrodes"]["properties"]
        weights = {"in_plane_pair": 4, "stacked_pair": 3, "comb": 0.5 if self.cheap else 2, "array": 2, "spiral": 1, "ring": 0.0 if self.moves else 1}
        form = rng.choices(list(forms), [weights.get(form, 1) for form in forms])[0]
        if rng.random() < 0.1:
            return
        self.chances = {**Scene.chances, "electrodes.array.size": 0.0, "electrodes.array.diameter": 0.0, "electrodes.array.inner_diameter": 0.0,
                        f"electrodes.{form}.shear_modulus": 1.0 if self.moves else 0.2}
        node = forms[form]
        # Forms that may stand more than once have an array and a table as alternatives.
        table = next(choice for choice in alternatives(node) if choice.get("type") == "object")
        made = self.table(f"electrodes.{form}", table)
        self.repair_electrodes(form, made)
        entries = [made]
        if form not in ("in_plane_pair", "stacked_pair") and rng.random() < 0.15:
            second = self.table(f"electrodes.{form}", table)
            self.repair_electrodes(form, second)
            second["name"] = "other"
            second["center"] = self.point([12.0, 0.0])
            entries.append(second)
        self.case["electrodes"] = {form: entries if len(entries) > 1 or rng.random() < 0.2 and form not in ("in_plane_pair", "stacked_pair") else made}
        for entry in entries:
            self.names += electrode_names(form, entry)

    def repair_electrodes(self, form, made):
        """Keys that need one another."""
        rng = self.rng
        if form == "array":
            if rng.random() < 0.3 and not self.moves:
                made["diameter"] = self.length(self.between(0.4, 0.8))
                if rng.random() < 0.3:
                    made["inner_diameter"] = self.length(self.between(0.1, 0.35))
            else:
                made["size"] = self.point([self.between(0.3, 0.8), self.between(0.3, 0.8)])
            if "common_plate" in made and made["common_plate"].get("on") == made.get("on") is not None:
                del made["common_plate"]
        if "name" in made:
            made["name"] = f"{form}x"
        if self.moves and rng.random() < 0.9:
            made.pop("guard", None)

    def draw_wires(self):
        rng = self.rng
        names = [body["name"] for body in self.case.get("conductor", []) if "charge" in body]
        driven = [name for name in self.names if name not in names]
        if len(driven) > 2 and rng.random() < 0.35:
            rng.shuffle(driven)
            wire = {"name": "wire", "conductors": driven[: rng.choice([1, 2])]}
            if rng.random() < 0.4:
                wire["potential"] = "ground"
            self.case["terminal"] = [wire]
            driven = driven[len(wire["conductors"]):] + (["wire"] if "potential" not in wire else [])
        if driven and (rng.random() < 0.6 or len(driven) > 3):
            self.case["measure"] = {"capacitance": rng.sample(driven, min(len(driven), rng.choice([1, 2, 2])))}

    def draw_load(self, flat):
        load = self.top("load")
        if "approach" in load and not self.field_indenter:
            del load["approach"]
        if "steps" in load and not (flat and any(body.get("attached") == "layer-top" for body in self.case.get("conductor", []))):
            for step in load["steps"]:
                step.pop("shift", None)
                step.pop("tilt", None)

    def draw_surroundings(self):
        made = {"boundary": self.boundary}
        if self.boundary != "open":
            made["side_margin"] = self.length(self.between(1, 8))
        for face in ("below", "above"):
            if self.rng.random() < 0.5:
                made[face] = self.face(face, None)
        self.case["surroundings"] = made


def electrode_names(form, made):
    """The names of the conductors that an electrode form stands for."""
    name = made.get("name", {"array": "pad"}.get(form, form))
    if form in ("in_plane_pair", "stacked_pair"):
        return []
    if form == "comb":
        names = [f"{name}-1", f"{name}-2"]
    elif form == "array":
        names = [f"{name}-{i}-{j}" for i in range(1, made["pads"][0] + 1) for j in range(1, made["pads"][1] + 1)]
    elif form == "spiral":
        names = [f"{name}-1", f"{name}-2"] if made.get("arms", 2) == 2 else [name]
    else:
        names = [name]
    return names


def cube():
    """A cube from 0 to 1 as OBJ."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + ["f " + " ".join(map(str, side)) for side in sides]
    return ("\n".join(lines) + "\n").encode()
