//! Memoized functions of points. The displacements of the faces of an indenter's box are blended at every
//! node in the box, and the blends evaluate many points of the faces again.

use std::cell::RefCell;
use std::collections::HashMap;

/// A function of a point (m) with a cache of its values.
pub(super) struct Memoized<'a, T> {
    function: &'a dyn Fn([f64; 3]) -> T,
    values: RefCell<HashMap<[u64; 3], T>>,
}

impl<'a, T: Copy> Memoized<'a, T> {
    /// The function without known values.
    pub(super) fn new(function: &'a dyn Fn([f64; 3]) -> T) -> Self {
        Self { function, values: RefCell::default() }
    }

    /// The value at a point, computed on the first call.
    pub(super) fn at(&self, x: [f64; 3]) -> T {
        let key = x.map(f64::to_bits);
        let known = self.values.borrow().get(&key).copied();
        known.unwrap_or_else(|| {
            let value = (self.function)(x);
            self.values.borrow_mut().insert(key, value);
            value
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_place_is_looked_at_once_and_the_two_zeros_are_two_places() {
        let calls = Cell::new(0);
        let inverse = |x: [f64; 3]| {
            calls.set(calls.get() + 1);
            1.0 / x[0]
        };
        let memoized = Memoized::new(&inverse);
        for _ in 0..2 {
            assert_eq!(memoized.at([2.0, 0.0, 0.0]), 0.5);
            assert_eq!(memoized.at([0.0; 3]), f64::INFINITY);
            assert_eq!(memoized.at([-0.0, 0.0, 0.0]), f64::NEG_INFINITY);
        }
        assert_eq!(calls.get(), 3);
    }
}
