//! Values with their gradients.

/// A value with its gradient in the reference triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet {
    /// The value.
    pub(crate) value: f64,
    /// The derivatives along the two axes of the reference triangle.
    pub(crate) slope: [f64; 2],
}

impl Jet {
    /// A constant, whose gradient is zero.
    pub(crate) const fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; 2] }
    }

    pub(crate) fn times(self, other: Self) -> Self {
        let slope = [0, 1].map(|k| self.value * other.slope[k] + other.value * self.slope[k]);
        Self { value: self.value * other.value, slope }
    }

    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, slope: self.slope.map(|s| factor * s) }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: [0, 1].map(|k| self.slope[k] + other.slope[k]) }
    }

    pub(crate) fn minus(self, other: Self) -> Self {
        self.plus(other.scaled(-1.0))
    }

    /// The quotient of this value and another one.
    pub(crate) fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, slope: [0, 1].map(|k| (self.slope[k] - value * other.slope[k]) / other.value) }
    }

    /// The cosine and the sine of the value, with their gradients.
    pub(crate) fn cosine_and_sine(self) -> [Self; 2] {
        let (sine, cosine) = self.value.sin_cos();
        [
            Self { value: cosine, slope: self.slope.map(|s| -sine * s) },
            Self { value: sine, slope: self.slope.map(|s| cosine * s) },
        ]
    }
}

/// The barycentric coordinates at a point of the reference triangle, with their gradients.
pub(crate) fn barycentric([x, y]: [f64; 2]) -> [Jet; 3] {
    [
        Jet { value: 1.0 - x - y, slope: [-1.0, -1.0] },
        Jet { value: x, slope: [1.0, 0.0] },
        Jet { value: y, slope: [0.0, 1.0] },
    ]
}
