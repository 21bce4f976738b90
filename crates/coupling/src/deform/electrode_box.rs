//! The boxes inside and around a deformed electrode, which represent it in the box solver.
//!
//! A deformed electrode is bent and tilted, and the box solver takes only boxes. Capacitances of a pair grow
//! with its electrodes (Dirichlet's principle: a larger conductor has fewer admissible potentials). So the
//! largest box inside an electrode gives a lower bound, and the smallest box around it an upper one.

/// Lower and upper end along x1, x2 and x3, m.
pub type Ends = [[f64; 2]; 3];

/// An electrode after loading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectrodeBox {
    /// The box at the mean positions of the faces.
    pub mean: Ends,
    /// A box inside the electrode; empty (an upper end at or below the lower one) if it is bent too much.
    pub inside: Ends,
    /// The box around the electrode.
    pub around: Ends,
    /// Slope dx2/dx1 of the middle of the electrode, by least squares.
    pub tilt: f64,
}

/// One face of an electrode: weights (parts of its reference area, adding up to 1) and deformed points.
pub(super) type Face = Vec<(f64, [f64; 3])>;

impl ElectrodeBox {
    /// The boxes of an electrode from its faces, the lower and the upper one of each axis.
    pub(super) fn new(faces: &[[Face; 2]; 3]) -> Self {
        let mean = |face: &Face, axis: usize| face.iter().map(|(w, x)| w * x[axis]).sum::<f64>();
        let most =
            |face: &Face, axis: usize| face.iter().map(|p| p.1[axis]).fold(f64::NEG_INFINITY, f64::max);
        let least = |face: &Face, axis: usize| face.iter().map(|p| p.1[axis]).fold(f64::INFINITY, f64::min);
        let slope = |face: &Face| {
            let (a, b) = (mean(face, 0), mean(face, 1));
            let sum =
                |f: fn(f64, f64) -> f64| face.iter().map(|(w, x)| w * f(x[0] - a, x[1] - b)).sum::<f64>();
            sum(|dx, dy| dx * dy) / sum(|dx, _| dx * dx).max(f64::MIN_POSITIVE)
        };
        let ends = |pick: &dyn Fn(usize, &[Face; 2]) -> [f64; 2]| [0, 1, 2].map(|a| pick(a, &faces[a]));
        let around = |axis: usize, _: &[Face; 2]| {
            let all_faces = || faces.iter().flatten();
            let low = all_faces().map(|f| least(f, axis)).fold(f64::INFINITY, f64::min);
            let high = all_faces().map(|f| most(f, axis)).fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        };
        let [lower, upper] = &faces[1];
        Self {
            mean: ends(&|axis, [low, high]| [mean(low, axis), mean(high, axis)]),
            inside: ends(&|axis, [low, high]| [most(low, axis), least(high, axis)]),
            around: ends(&around),
            tilt: 0.5 * (slope(lower) + slope(upper)),
        }
    }

    /// The boxes of the whole electrode, of which this is the half with `x3 > 0`.
    pub(super) fn across(mut self) -> Self {
        for ends in [&mut self.mean, &mut self.inside, &mut self.around] {
            ends[2][0] = -ends[2][1];
        }
        self
    }

    /// Largest distance between the inner and the outer box, m: the deviation from a box.
    pub fn deviation(&self) -> f64 {
        let distances = |a: usize| [0, 1].map(|s| (self.inside[a][s] - self.around[a][s]).abs());
        (0..3).flat_map(distances).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(points: &[[f64; 2]], x3: [f64; 2]) -> Face {
        let corners = x3.iter().flat_map(|z| points.iter().map(|x| [x[0], x[1], *z]));
        corners.map(|x| (0.5 / points.len() as f64, x)).collect()
    }

    fn tilted(slope: f64) -> ElectrodeBox {
        let line = |y: f64| [0.0, 2.0].map(|x| [x, y + slope * (x - 1.0)]);
        let end = |x: f64| [0.0, 1.0].map(|y| [x, y + slope * (x - 1.0)]);
        let x3 = [-1.0, 3.0];
        ElectrodeBox::new(&[
            [face(&end(0.0), x3), face(&end(2.0), x3)],
            [face(&line(0.0), x3), face(&line(1.0), x3)],
            x3.map(|z| face(&line(0.5), [z, z])),
        ])
    }

    #[test]
    fn a_box_is_its_own_box_inside_and_around() {
        let found = tilted(0.0);
        let ends = [[0.0, 2.0], [0.0, 1.0], [-1.0, 3.0]];
        assert_eq!((found.mean, found.inside, found.around), (ends, ends, ends));
        assert_eq!((found.tilt, found.deviation()), (0.0, 0.0));
        assert_eq!(found.across().inside[2], [-3.0, 3.0]);
    }

    #[test]
    fn a_tilted_electrode_lies_between_its_two_boxes() {
        let found = tilted(0.2);
        assert!((found.tilt - 0.2).abs() < 1e-12 && (found.deviation() - 0.4).abs() < 1e-12);
        assert_eq!(found.inside, [[0.0, 2.0], [0.2, 0.8], [-1.0, 3.0]]);
        assert_eq!(found.around, [[0.0, 2.0], [-0.2, 1.2], [-1.0, 3.0]]);
    }
}
