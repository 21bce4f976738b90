//! Numbers as bytes in native byte order, as `numpy.frombuffer` reads them.

use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// A number with a fixed size in memory.
pub(crate) trait Number: Copy {
    /// The type of its bytes.
    type Bytes: AsRef<[u8]>;
    /// Its size in bytes.
    const SIZE: usize = size_of::<Self::Bytes>();
    /// The number as bytes.
    fn bytes(self) -> Self::Bytes;
}

impl Number for f64 {
    type Bytes = [u8; 8];
    fn bytes(self) -> [u8; 8] {
        self.to_ne_bytes()
    }
}

impl Number for i32 {
    type Bytes = [u8; 4];
    fn bytes(self) -> [u8; 4] {
        self.to_ne_bytes()
    }
}

impl Number for u32 {
    type Bytes = [u8; 4];
    fn bytes(self) -> [u8; 4] {
        self.to_ne_bytes()
    }
}

/// The bytes of `count` numbers. Further ones in `numbers` are left out, missing ones are zero.
///
/// # Errors
/// An error if Python has no memory for them.
pub(crate) fn bytes<'py, T: Number>(
    py: Python<'py>,
    count: usize,
    numbers: impl IntoIterator<Item = T>,
) -> PyResult<Bound<'py, PyBytes>> {
    PyBytes::new_with(py, count * T::SIZE, |buffer| {
        for (place, number) in buffer.chunks_exact_mut(T::SIZE).zip(numbers) {
            place.copy_from_slice(number.bytes().as_ref());
        }
        Ok(())
    })
}

/// The bytes of all numbers of a slice.
///
/// # Errors
/// As [`bytes`].
pub(crate) fn slice_bytes<'py, T: Number>(py: Python<'py>, numbers: &[T]) -> PyResult<Bound<'py, PyBytes>> {
    bytes(py, numbers.len(), numbers.iter().copied())
}
