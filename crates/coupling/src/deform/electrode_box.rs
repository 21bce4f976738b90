//! The box that an electrode of the finite-element layer is to the field solver.

use std::fmt;

/// An electrode after loading: the box nearest to it, and how far it is from being one. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectrodeBox {
    /// Left and right end along x1: the means over its end faces.
    pub x1: [f64; 2],
    /// Lower and upper face along x2: the means over its faces.
    pub x2: [f64; 2],
    /// Slope of its middle line, dx2/dx1, by least squares.
    pub tilt: f64,
    /// Largest distance of a point of its outline from the box's, across the face that it belongs to.
    pub deviation: f64,
}

/// Largest [`ElectrodeBox::deviation`] over the electrode's thickness with which an electrode passes for a box.
pub(super) const LARGEST_DEVIATION: f64 = 0.1;

/// An electrode that the box solver cannot take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotABox {
    /// What it is like.
    pub shape: ElectrodeBox,
}

impl fmt::Display for NotABox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ElectrodeBox { tilt, deviation, x2, .. } = self.shape;
        write!(
            f,
            "the electrodes are no boxes any more: tilted by {:.2} degrees, and bent out of the nearest box by {:.3} um, \
             {:.0} % of their thickness ({:.0} % are allowed); the solver for boxes cannot take them",
            tilt.atan().to_degrees(),
            deviation * 1e6,
            100.0 * deviation / (x2[1] - x2[0]),
            100.0 * LARGEST_DEVIATION
        )
    }
}

/// One face of an electrode: weights (reference lengths, adding up to 1) and deformed points.
pub(super) type Face = Vec<(f64, [f64; 2])>;

impl ElectrodeBox {
    /// The box of an electrode from its faces: left, right, lower and upper.
    pub(super) fn new([left, right, lower, upper]: &[Face; 4]) -> Self {
        let mean = |face: &Face, axis: usize| face.iter().map(|(w, x)| w * x[axis]).sum::<f64>();
        let x1 = [mean(left, 0), mean(right, 0)];
        let x2 = [mean(lower, 1), mean(upper, 1)];
        let off = |face: &Face, axis: usize, at: f64| {
            face.iter().map(|(_, x)| (x[axis] - at).abs()).fold(0.0, f64::max)
        };
        let deviation =
            [off(left, 0, x1[0]), off(right, 0, x1[1]), off(lower, 1, x2[0]), off(upper, 1, x2[1])]
                .into_iter()
                .fold(0.0, f64::max);
        let slope = |face: &Face| {
            let (a, b) = (mean(face, 0), mean(face, 1));
            let sum =
                |f: fn(f64, f64) -> f64| face.iter().map(|(w, x)| w * f(x[0] - a, x[1] - b)).sum::<f64>();
            sum(|dx, dy| dx * dy) / sum(|dx, _| dx * dx).max(f64::MIN_POSITIVE)
        };
        Self { x1, x2, tilt: 0.5 * (slope(lower) + slope(upper)), deviation }
    }

    /// Itself, if it passes for a box.
    ///
    /// # Errors
    /// [`NotABox`] if not.
    pub fn checked(self) -> Result<Self, NotABox> {
        if self.deviation <= LARGEST_DEVIATION * (self.x2[1] - self.x2[0]) {
            Ok(self)
        } else {
            Err(NotABox { shape: self })
        }
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
        let end = |x: f64| face(&[0.0, 0.5, 1.0].map(|y| [x, y]));
        ElectrodeBox::new(&[end(0.0), end(2.0), line(0.0), line(1.0)])
    }

    #[test]
    fn a_box_is_its_own_box() {
        let found = tilted(0.0);
        assert_eq!((found.x1, found.x2, found.tilt, found.deviation), ([0.0, 2.0], [0.0, 1.0], 0.0, 0.0));
        assert!(found.checked().is_ok());
    }

    #[test]
    fn a_tilted_electrode_is_refused_with_its_tilt() {
        assert!(tilted(0.05).checked().is_ok());
        let refused = tilted(0.2).checked().unwrap_err();
        assert!((refused.shape.tilt - 0.2).abs() < 1e-12);
        assert!(refused.to_string().contains("tilted by 11.31 degrees"), "{refused}");
    }
}
