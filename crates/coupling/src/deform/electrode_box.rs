//! The box that stands for an electrode of the finite-element layer where nothing needs its bent shape.

/// Lower and upper end along x1, x2 and x3, m.
pub type Ends = [[f64; 2]; 3];

/// An electrode after loading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectrodeBox {
    /// The box at the mean positions of the faces.
    pub mean: Ends,
    /// How far the electrode is from being a box, m: the largest distance between the ends of the largest box
    /// inside it and of the smallest box around it.
    pub deviation: f64,
}

/// One face of an electrode: weights (parts of its reference area, adding up to 1) and deformed points.
pub(super) type Face = Vec<(f64, [f64; 3])>;

impl ElectrodeBox {
    /// The box of an electrode from its faces, the lower and the upper one of each axis.
    pub(super) fn new(faces: &[[Face; 2]; 3]) -> Self {
        let mean = |face: &Face, axis: usize| face.iter().map(|(w, x)| w * x[axis]).sum::<f64>();
        let most =
            |face: &Face, axis: usize| face.iter().map(|p| p.1[axis]).fold(f64::NEG_INFINITY, f64::max);
        let least = |face: &Face, axis: usize| face.iter().map(|p| p.1[axis]).fold(f64::INFINITY, f64::min);
        let ends = |of: &dyn Fn(usize, &[Face; 2]) -> [f64; 2]| [0, 1, 2].map(|a| of(a, &faces[a]));
        let around = |axis: usize, _: &[Face; 2]| {
            let all_faces = || faces.iter().flatten();
            let low = all_faces().map(|f| least(f, axis)).fold(f64::INFINITY, f64::min);
            let high = all_faces().map(|f| most(f, axis)).fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        };
        let inside = ends(&|axis, [low, high]| [most(low, axis), least(high, axis)]);
        let around = ends(&around);
        let apart = |a: usize| [0, 1].map(|side| (inside[a][side] - around[a][side]).abs());
        Self {
            mean: ends(&|axis, [low, high]| [mean(low, axis), mean(high, axis)]),
            deviation: (0..3).flat_map(apart).fold(0.0, f64::max),
        }
    }

    /// The box of the whole electrode, of which this is the half with `x3 > 0`.
    pub(super) fn with_mirror_image(mut self) -> Self {
        self.mean[2][0] = -self.mean[2][1];
        self
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
    fn a_box_is_no_distance_from_being_one() {
        let found = tilted(0.0);
        assert_eq!(found.mean, [[0.0, 2.0], [0.0, 1.0], [-1.0, 3.0]]);
        assert_eq!(found.deviation, 0.0);
        assert_eq!(found.with_mirror_image().mean[2], [-3.0, 3.0]);
    }

    #[test]
    fn a_tilted_electrode_is_as_far_from_a_box_as_its_ends_rise() {
        assert!((tilted(0.2).deviation - 0.4).abs() < 1e-12);
    }
}
