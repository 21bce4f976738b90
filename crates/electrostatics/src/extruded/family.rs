//! The meshes that a scene may be solved on, and the error expected on each: from what the upper bound falls by on the first ones.

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// Of the polynomials.
    pub degree: usize,
    /// Layers toward corners of the plan, and toward the places of the axis where something begins or ends.
    pub layers: usize,
    /// Strips toward edges.
    pub strips: usize,
}

impl Level {
    /// The meshes that are solved for the upper bound first. The second has a layer and a degree more than the first, the third a
    /// strip more than the second, the fourth a layer more than the third.
    pub(super) const EXPLORED: [Self; 4] = [
        Self { degree: 2, layers: 1, strips: 0 },
        Self { degree: 3, layers: 2, strips: 0 },
        Self { degree: 3, layers: 2, strips: 1 },
        Self { degree: 3, layers: 3, strips: 1 },
    ];
}

/// What the lower bound and finer meshes add to the fall of the upper bound from the first mesh to the second: the error on the second
/// is that share of the fall.
const SHARE_OF_FALL: f64 = 0.2;

/// The share of that error that comes from the layers, and what a layer takes off it; without and with sheets, whose edges are more
/// singular than those of bodies. The rest comes from the degree.
const BY_LAYERS: [(f64, f64); 2] = [(0.75, 0.095), (0.9, 0.3)];

/// What a degree takes off; and what the second degree leaves over what the third does.
const BY_DEGREE: f64 = 0.18;
const SECOND_DEGREE: f64 = 10.0;

/// What a strip takes off the error without strips; without and with sheets.
const BY_STRIPS: [f64; 2] = [0.1, 0.17];

/// What a forecast of the error is multiplied by before it is compared with the tolerance. Where the forecast is too low nonetheless,
/// another mesh is solved.
const SAFETY: f64 = 1.1;

/// The error expected at least, where the upper bound did not fall: what is found can correct it.
const LEAST: f64 = 1e-12;

/// The highest degree.
const HIGHEST: usize = 8;

/// What is expected of the meshes of a scene. The numbers were measured on bars, bent electrodes, discs, rings and boards: see
/// docs/extruded.md.
#[derive(Debug, Clone)]
pub(super) struct Expectation {
    /// Relative error of meshes with two layers that comes from there.
    two_layers: f64,
    /// The same of polynomials of the third degree.
    third_degree: f64,
    /// The same of meshes without strips, at the third degree.
    without_strips: f64,
    sheets: bool,
    /// Triangles of the meshes that were explored, but for the last.
    triangles: [f64; 3],
}

impl Expectation {
    /// From what the upper bound fell by, relative, from each mesh of [`Level::EXPLORED`] to the next (infinite if the last was not
    /// solved, which is needed with sheets only), and the triangles of the first three.
    pub(super) fn new(falls: [f64; 3], triangles: [usize; 3], sheets: bool) -> Self {
        let [refined, striped, layered] = falls;
        let error = (SHARE_OF_FALL * refined).max(LEAST);
        let (share, by_layers) = BY_LAYERS[usize::from(sheets)];
        // The lower bound gains as much from a strip or a layer as the upper one does.
        let two_layers = share * error;
        Self {
            two_layers: if sheets { two_layers.min(2.0 * layered / (1.0 - by_layers)) } else { two_layers },
            third_degree: (1.0 - share) * error,
            without_strips: 2.0 * striped,
            sheets,
            triangles: triangles.map(|t| t as f64),
        }
    }

    /// The relative error expected on a mesh.
    pub(super) fn error(&self, level: Level) -> f64 {
        let beyond = |n: usize, of: usize| n as i32 - of as i32;
        let layers = BY_LAYERS[usize::from(self.sheets)].1.powi(beyond(level.layers, 2));
        let degree = if level.degree < 3 { SECOND_DEGREE } else { BY_DEGREE.powi(beyond(level.degree, 3)) };
        let strips = BY_STRIPS[usize::from(self.sheets)].powi(level.strips as i32)
            * (3.0 / level.degree as f64).powi(2);
        self.two_layers * layers + self.third_degree * degree + self.without_strips * strips
    }

    /// Corrects what is expected by the error that was found on a mesh.
    pub(super) fn learn(&mut self, level: Level, found: f64) {
        let factor = found / self.error(level);
        self.two_layers *= factor;
        self.third_degree *= factor;
        self.without_strips *= factor;
    }

    /// The mesh with the fewest unknowns, of those with more than `above` and fewer than `below`, that is expected to meet a tolerance;
    /// where none is, that with the least error. `functions` gives the functions of the line for a degree and a number of layers.
    pub(super) fn cheapest(
        &self,
        tolerance: f64,
        [above, below]: [f64; 2],
        functions: impl Fn(usize, usize) -> usize,
    ) -> Option<(Level, f64)> {
        let mut best: Option<(Level, f64, bool)> = None;
        for degree in 2..=HIGHEST {
            // More layers than that bring nothing without a higher degree.
            for layers in 1..=degree + usize::from(self.sheets) {
                let line = functions(degree, layers);
                for strips in 0..=layers {
                    let level = Level { degree, layers, strips };
                    let unknowns = self.triangles(level) * per_triangle(degree) * line as f64;
                    if unknowns <= above || unknowns >= below {
                        continue;
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
                }
            }
        }
        best.map(|(level, unknowns, _)| (level, unknowns))
    }

    /// Triangles of a mesh, about: each layer and each strip adds as many as the ones explored.
    fn triangles(&self, level: Level) -> f64 {
        let [first, second, striped] = self.triangles;
        let layers = (level.layers as f64 - 2.0) * (second - first);
        second + layers + level.strips as f64 * (striped - second)
    }
}

/// Unknowns of both problems for each triangle and function of the line, about: a triangle has half a corner and one and a half sides.
fn per_triangle(degree: usize) -> f64 {
    let p = degree as f64;
    let upper = 0.5 + 1.5 * (p - 1.0) + 0.5 * (p - 1.0) * (p - 2.0);
    let lower = 1.5 * p + 0.5 * p * (p + 1.0);
    upper + lower
}

#[cfg(test)]
mod tests {
    use super::*;

    fn functions(degree: usize, layers: usize) -> usize {
        degree * (4 + 2 * layers)
    }

    #[test]
    fn the_mesh_that_is_chosen_meets_the_tolerance_and_no_smaller_one_does() {
        let bars = Expectation::new([2.7e-2, 2.4e-4, f64::INFINITY], [200, 300, 420], false);
        let pads = Expectation::new([2.1e-1, 1.3e-2, f64::INFINITY], [400, 500, 1200], false);
        let discs = Expectation::new([2.5e-1, 5.2e-2, 1e-2], [200, 260, 500], true);
        for expected in [&bars, &pads, &discs] {
            let mut before = 0.0;
            for tolerance in [1e-2, 1e-3, 1e-4] {
                let (level, unknowns) =
                    expected.cheapest(tolerance, [0.0, f64::INFINITY], functions).unwrap();
                assert!(expected.error(level) <= tolerance, "{level:?}");
                assert!(unknowns > before);
                before = unknowns;
                let lower = Level { degree: level.degree - 1, layers: level.layers - 1, ..level };
                let coarser = Level { layers: level.layers - 1, ..level };
                for smaller in [lower, coarser] {
                    assert!(SAFETY * expected.error(smaller) > tolerance, "{level:?}");
                }
            }
        }
        // Strips are for scenes whose edges matter.
        let strips = |e: &Expectation| e.cheapest(1e-2, [0.0, f64::INFINITY], functions).unwrap().0.strips;
        assert_eq!([strips(&bars), strips(&pads).min(1)], [0, 1]);
    }

    #[test]
    fn an_error_larger_than_expected_makes_the_next_mesh_finer() {
        let mut expected = Expectation::new([2.7e-2, 2.4e-4, f64::INFINITY], [200, 300, 420], false);
        let any = [0.0, f64::INFINITY];
        let (first, unknowns) = expected.cheapest(1e-3, any, functions).unwrap();
        expected.learn(first, 3e-3);
        assert!((expected.error(first) - 3e-3).abs() < 1e-12);
        let (second, more) = expected.cheapest(1e-3, [unknowns, f64::INFINITY], functions).unwrap();
        assert!(more > unknowns && expected.error(second) < 1e-3);
        // Even where the field is uniform, and the upper bound exact on any mesh.
        let mut uniform = Expectation::new([0.0, 0.0, f64::INFINITY], [200, 300, 420], false);
        let (smallest, few) = uniform.cheapest(1e-6, any, functions).unwrap();
        uniform.learn(smallest, 2e-6);
        assert!(uniform.cheapest(1e-6, [few, f64::INFINITY], functions).unwrap().1 > few);
        // Where what would do is out of reach, the best of what remains.
        let (coarse, fewer) = expected.cheapest(1e-3, [0.0, unknowns], functions).unwrap();
        assert!(fewer < unknowns && expected.error(coarse) > 1e-3);
    }
}
