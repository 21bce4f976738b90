//! The boxes that an electrode of the finite-element layer is to the field solver.
//!
//! A deformed electrode is bent and tilted, and the field solver knows boxes. Capacitances of a pair grow with its
//! electrodes (Dirichlet's principle: a larger conductor has fewer admissible potentials): the largest box inside
//! an electrode gives less, the smallest box around it more than the electrode itself. The two together are bounds.

/// Lower and upper end along x1 and along x2, m.
pub type Rectangle = [[f64; 2]; 2];

/// An electrode after loading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectrodeBox {
    /// The box of the means over its faces.
    pub mean: Rectangle,
    /// A box inside it; empty (an upper end at or below the lower one) where it is bent too much.
    pub inside: Rectangle,
    /// The box around it.
    pub around: Rectangle,
    /// Slope of its middle line, dx2/dx1, by least squares.
    pub tilt: f64,
}

/// One face of an electrode: weights (reference lengths, adding up to 1) and deformed points.
pub(super) type Face = Vec<(f64, [f64; 2])>;

impl ElectrodeBox {
    /// The boxes of an electrode from its faces: left, right, lower and upper.
    pub(super) fn new(faces: &[Face; 4]) -> Self {
        let [left, right, lower, upper] = faces;
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
        let around = [0, 1].map(|axis| {
            let low = faces.iter().map(|f| least(f, axis)).fold(f64::INFINITY, f64::min);
            let high = faces.iter().map(|f| most(f, axis)).fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        });
        Self {
            mean: [[mean(left, 0), mean(right, 0)], [mean(lower, 1), mean(upper, 1)]],
            inside: [[most(left, 0), least(right, 0)], [most(lower, 1), least(upper, 1)]],
            around,
            tilt: 0.5 * (slope(lower) + slope(upper)),
        }
    }

    /// Largest distance between the box inside and the box around, m: how far it is from being a box.
    pub fn deviation(&self) -> f64 {
        let of = |a: usize, s: usize| (self.inside[a][s] - self.around[a][s]).abs();
        [of(0, 0), of(0, 1), of(1, 0), of(1, 1)].into_iter().fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(points: &[[f64; 2]]) -> Face {
        points.iter().map(|x| (1.0 / points.len() as f64, *x)).collect()
    }

    fn tilted(slope: f64) -> ElectrodeBox {
        let line = |y: f64| face(&[0.0, 1.0, 2.0].map(|x| [x, y + slope * (x - 1.0)]));
        let end = |x: f64| face(&[0.0, 0.5, 1.0].map(|y| [x, y + slope * (x - 1.0)]));
        ElectrodeBox::new(&[end(0.0), end(2.0), line(0.0), line(1.0)])
    }

    #[test]
    fn a_box_is_its_own_box_inside_and_around() {
        let found = tilted(0.0);
        let own = [[0.0, 2.0], [0.0, 1.0]];
        assert_eq!((found.mean, found.inside, found.around), (own, own, own));
        assert_eq!((found.tilt, found.deviation()), (0.0, 0.0));
    }

    #[test]
    fn a_tilted_electrode_lies_between_its_two_boxes() {
        let found = tilted(0.2);
        assert!((found.tilt - 0.2).abs() < 1e-12 && (found.deviation() - 0.4).abs() < 1e-12);
        assert_eq!(found.inside, [[0.0, 2.0], [0.2, 0.8]]);
        assert_eq!(found.around, [[0.0, 2.0], [-0.2, 1.2]]);
    }
}
