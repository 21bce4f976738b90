//! The meshes that a scene may be solved on, and the error expected on each. The expectation follows from how
//! far the upper bound falls on the first meshes, and from the energy in the last functions along the axis
//! there.

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// The degree of the polynomials on triangles.
    pub degree: usize,
    /// Number of layers toward corners of the plan.
    pub layers: usize,
    /// Number of strips of triangles toward edges.
    pub strips: usize,
    /// The degree of the polynomials along the axis.
    pub axis_degree: usize,
    /// Number of layers toward the places of the axis where something begins or ends.
    pub axis_layers: usize,
}

impl Level {
    /// The meshes that are solved for the upper bound first. The second has a layer and a degree more than
    /// the first, in the plan and along the axis, the third a strip more than the second, the fourth layers
    /// more than the third.
    pub(super) const EXPLORED: [Self; 4] =
        [Self::alike(2, 1, 0), Self::alike(3, 2, 0), Self::alike(3, 2, 1), Self::alike(3, 3, 1)];

    /// A mesh that is as fine in the plan as along the axis.
    pub(super) const fn alike(degree: usize, layers: usize, strips: usize) -> Self {
        Self { degree, layers, strips, axis_degree: degree, axis_layers: layers }
    }
}

/// Results of the meshes that are solved for the upper bound first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gained {
    /// The relative fall of the upper bound from the first mesh to the second.
    pub refined: f64,
    /// The shares of the energy that the last functions of the axis carry, at edges and elsewhere, on the
    /// third mesh; on the second where there are no edges.
    pub last_along_axis: [f64; 2],
    /// The relative fall of the upper bound from the second mesh to the third; zero where there are no edges.
    pub striped: f64,
    /// The relative fall of the upper bound from the third mesh to the fourth; infinite where the fourth was
    /// not solved, which is needed with sheets only.
    pub layered: f64,
}

/// The error on the second mesh as a share of the fall of the upper bound from the first mesh to the second:
/// the share that the lower bound and finer meshes add to the fall. Tuned: `benches/outlines.py`.
const SHARE_OF_FALL: f64 = 0.2;

/// The share of that error that comes from the layers toward corners and along the axis, and the factor by
/// which each further layer multiplies it; without and with sheets, whose edges are more singular than those
/// of bodies. The rest comes from the degrees. Tuned: `benches/outlines.py`.
const BY_LAYERS: [(f64, f64); 2] = [(0.75, 0.095), (0.9, 0.3)];

/// Errors with two layers and the third degree along the axis over the shares of the energy in the last
/// functions of the axis, at edges and elsewhere. Tuned: `benches/outlines.py`.
const OF_LAST: [f64; 2] = [1.0, 0.45];

/// Smallest shares of the errors by layers and by degrees that count for the plan, even where the axis seems
/// to cause more. Tuned: `benches/outlines.py`.
const MIN_SHARES_OF_PLAN: [f64; 2] = [0.25, 0.35];

/// The factor by which each degree beyond the third multiplies the error. Measured:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const BY_DEGREE: f64 = 0.18;

/// The error with the second degree over that with the third. Measured:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const SECOND_DEGREE: f64 = 10.0;

/// The factor by which each strip multiplies the error without strips; without and with sheets. Tuned:
/// `benches/outlines.py`.
const BY_STRIPS: [f64; 2] = [0.1, 0.17];

/// The factor by which a forecast of the error is multiplied before it is compared with the tolerance. Where
/// the forecast is too low nonetheless, another mesh is solved. Tuned: `benches/outlines.py`.
const SAFETY: f64 = 1.15;

/// Smallest expected error, where the upper bound did not fall; [`Expectation::learn`] can correct it. It is
/// not tuned.
const LEAST: f64 = 1e-12;

/// The highest degree. Not tuned: the five degrees beyond the third divide the error by 5,000.
pub(super) const HIGHEST: usize = 8;

/// The errors expected on the meshes of a scene. The numbers were measured on bars, bent electrodes, discs,
/// rings and boards: see docs/performance.md, "How constants were chosen".
#[derive(Debug, Clone)]
pub(super) struct Expectation {
    /// The relative errors that come from the layers on meshes with two of them: toward corners of the plan,
    /// and along the axis.
    two_layers: [f64; 2],
    /// The relative errors that come from the degrees on meshes of the third degree: in the plan, and along
    /// the axis.
    third_degree: [f64; 2],
    /// The relative error that comes from the edges on meshes without strips, at the third degree.
    without_strips: f64,
    /// Whether conductors are sheets, as [`Layout::has_sheets`](super::layout::Layout::has_sheets) says.
    sheets: bool,
    /// Numbers of triangles of the first three meshes.
    triangles: [f64; 3],
}

impl Expectation {
    /// The expectation from the results of the first meshes and the numbers of triangles of three of them.
    pub(super) fn new(gained: Gained, triangles: [usize; 3], sheets: bool) -> Self {
        let error = (SHARE_OF_FALL * gained.refined).max(LEAST);
        let (share, by_layers) = BY_LAYERS[usize::from(sheets)];
        let mut of_layers = share * error;
        let of_degrees = (1.0 - share) * error;
        if sheets && gained.layered.is_finite() {
            // The lower bound gains as much from a layer as the upper one does.
            of_layers = of_layers.min(2.0 * gained.layered / (1.0 - by_layers));
        }
        let of_axis =
            |k: usize, total: f64| (OF_LAST[k] * gained.last_along_axis[k]).clamp(LEAST.min(total), total);
        let along_axis = [of_axis(0, of_layers), of_axis(1, of_degrees)];
        let of_plan = |k: usize, total: f64| (total - along_axis[k]).max(MIN_SHARES_OF_PLAN[k] * total);
        Self {
            two_layers: [of_plan(0, of_layers), along_axis[0]],
            third_degree: [of_plan(1, of_degrees), along_axis[1]],
            // As for layers, the lower bound gains as much as the upper one.
            without_strips: 2.0 * gained.striped,
            sheets,
            triangles: triangles.map(|t| t as f64),
        }
    }

    /// The relative error expected on a mesh.
    pub(super) fn error(&self, level: Level) -> f64 {
        let above = |n: usize, base: usize| n as i32 - base as i32;
        let by_layers = |n: usize| BY_LAYERS[usize::from(self.sheets)].1.powi(above(n, 2));
        let by_degree = |p: usize| if p < 3 { SECOND_DEGREE } else { BY_DEGREE.powi(above(p, 3)) };
        let strips = BY_STRIPS[usize::from(self.sheets)].powi(level.strips as i32)
            * (3.0 / level.degree as f64).powi(2);
        self.two_layers[0] * by_layers(level.layers)
            + self.two_layers[1] * by_layers(level.axis_layers)
            + self.third_degree[0] * by_degree(level.degree)
            + self.third_degree[1] * by_degree(level.axis_degree)
            + self.without_strips * strips
    }

    /// Scales the expected errors so that the one on a mesh is `error`.
    pub(super) fn learn(&mut self, level: Level, error: f64) {
        let factor = error / self.error(level);
        self.two_layers.iter_mut().chain(&mut self.third_degree).for_each(|share| *share *= factor);
        self.without_strips *= factor;
    }

    /// The mesh with the fewest unknowns that is expected to meet a tolerance or, where none is, the one with
    /// the least expected error; and its number of unknowns. Only meshes count that are in no way coarser
    /// than `least` and have fewer unknowns than `max_unknowns`. `functions` gives the number of functions of
    /// the line for a degree and a number of layers of the axis.
    pub(super) fn cheapest(
        &self,
        tolerance: f64,
        least: Option<Level>,
        max_unknowns: f64,
        functions: impl Fn(usize, usize) -> usize,
    ) -> Option<(Level, f64)> {
        let least =
            least.unwrap_or(Level { degree: 2, layers: 1, strips: 0, axis_degree: 2, axis_layers: 0 });
        let mut best: Option<(Level, f64, bool)> = None;
        let mut consider = |level: Level, line: f64| {
            let unknowns = self.triangles(level) * per_triangle(level.degree) * line;
            if unknowns >= max_unknowns {
                return;
            }
            let meets = SAFETY * self.error(level) <= tolerance;
            let better = best.is_none_or(|(other, n, met)| match (meets, met) {
                (true, true) => unknowns < n,
                (false, false) => self.error(level) < self.error(other),
                (meets, _) => meets,
            });
            if better {
                best = Some((level, unknowns, meets));
            }
        };
        // Further layers bring nothing without a higher degree.
        let layers_for = |degree: usize| degree + usize::from(self.sheets);
        for axis_degree in least.axis_degree..=HIGHEST {
            // The degree along the axis grows by one from layer to layer, so that fewer do not reach it.
            for axis_layers in least.axis_layers.max(axis_degree - 2)..=layers_for(axis_degree) {
                let line = functions(axis_degree, axis_layers) as f64;
                for degree in least.degree..=HIGHEST {
                    for layers in least.layers..=layers_for(degree) {
                        for strips in least.strips..=layers {
                            consider(Level { degree, layers, strips, axis_degree, axis_layers }, line);
                        }
                    }
                }
            }
        }
        best.map(|(level, unknowns, _)| (level, unknowns))
    }

    /// Approximate number of triangles of a mesh: each layer and each strip adds as many as in the first
    /// meshes.
    fn triangles(&self, level: Level) -> f64 {
        let [first, second, striped] = self.triangles;
        let layers = (level.layers as f64 - 2.0) * (second - first);
        second + layers + level.strips as f64 * (striped - second)
    }
}

/// Approximate number of unknowns of both problems for each triangle and function of the line: a triangle has
/// half a corner and one and a half sides.
fn per_triangle(degree: usize) -> f64 {
    let p = degree as f64;
    let upper = 0.5 + 1.5 * (p - 1.0) + 0.5 * (p - 1.0) * (p - 2.0);
    let lower = 1.5 * p + 0.5 * p * (p + 1.0);
    upper + lower
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: f64 = f64::INFINITY;

    fn functions(degree: usize, layers: usize) -> usize {
        degree * (4 + 2 * layers)
    }

    fn bars() -> Expectation {
        let gained = Gained {
            refined: 2.7e-2,
            last_along_axis: [6.3e-3, 2.7e-3],
            striped: 2.4e-4,
            layered: f64::INFINITY,
        };
        Expectation::new(gained, [200, 300, 420], false)
    }

    #[test]
    fn the_mesh_that_is_chosen_meets_the_tolerance_and_no_smaller_one_does() {
        let pads = Gained {
            refined: 2.1e-1,
            last_along_axis: [6.2e-2, 2.4e-2],
            striped: 1.3e-2,
            layered: f64::INFINITY,
        };
        let pads = Expectation::new(pads, [400, 500, 1200], false);
        let discs = Gained { refined: 2.5e-1, last_along_axis: [2e-1, 6e-3], striped: 5.2e-2, layered: 1e-2 };
        let discs = Expectation::new(discs, [200, 260, 500], true);
        let bars = bars();
        for expected in [&bars, &pads, &discs] {
            let mut before = 0.0;
            for tolerance in [1e-2, 1e-3, 1e-4] {
                let (level, unknowns) = expected.cheapest(tolerance, None, ANY, functions).unwrap();
                assert!(expected.error(level) <= tolerance, "{level:?}");
                assert!(unknowns > before);
                before = unknowns;
                for smaller in [
                    Level { degree: level.degree - 1, ..level },
                    Level { axis_layers: level.axis_layers - 1, ..level },
                    Level { degree: level.degree - 1, axis_degree: level.axis_degree - 1, ..level },
                ] {
                    assert!(SAFETY * expected.error(smaller) > tolerance, "{level:?} {smaller:?}");
                }
            }
        }
        // Strips are for scenes whose edges matter.
        let strips = |e: &Expectation| e.cheapest(1e-2, None, ANY, functions).unwrap().0.strips;
        assert_eq!([strips(&bars), strips(&pads).min(1)], [0, 1]);
    }

    #[test]
    fn what_the_last_functions_of_the_axis_carry_makes_the_axis_finer_and_not_the_plan() {
        let gained = |last_along_axis| Gained {
            refined: 2.7e-2,
            last_along_axis,
            striped: 2.4e-4,
            layered: f64::INFINITY,
        };
        let [smooth, singular] = [[1e-6; 2], [6e-2, 2e-2]].map(|last| {
            Expectation::new(gained(last), [200, 300, 420], false)
                .cheapest(1e-3, None, ANY, functions)
                .unwrap()
                .0
        });
        assert!(singular.axis_layers > smooth.axis_layers && singular.axis_degree > smooth.axis_degree);
        assert!(singular.degree <= smooth.degree && singular.layers <= smooth.layers);
    }

    #[test]
    fn an_error_larger_than_expected_makes_the_next_mesh_finer() {
        let mut expected = bars();
        let (first, unknowns) = expected.cheapest(1e-3, None, ANY, functions).unwrap();
        expected.learn(first, 3e-3);
        assert!((expected.error(first) - 3e-3).abs() < 1e-12);
        let (second, more) = expected.cheapest(1e-3, Some(first), ANY, functions).unwrap();
        assert!(more > unknowns && expected.error(second) < 1e-3);
        // Even where the field is uniform, and the upper bound exact on any mesh.
        let uniform =
            Gained { refined: 0.0, last_along_axis: [0.0; 2], striped: 0.0, layered: f64::INFINITY };
        let mut uniform = Expectation::new(uniform, [200, 300, 420], false);
        let (smallest, few) = uniform.cheapest(1e-6, None, ANY, functions).unwrap();
        uniform.learn(smallest, 2e-6);
        assert!(uniform.cheapest(1e-6, Some(smallest), ANY, functions).unwrap().1 > few);
        // Where a mesh that meets the tolerance is out of reach, the best of the others.
        let (coarse, fewer) = expected.cheapest(1e-3, None, unknowns, functions).unwrap();
        assert!(fewer < unknowns && expected.error(coarse) > 1e-3);
    }
}
