//! Small dense matrix products without packing: the work horse of every tensor-product operation.
//!
//! One factor is always a 1D line matrix of tens to a few hundred rows that stays in cache, so that packing
//! buys little. The kernel of faer would not do: faer 0.24.4 (private-gemm-x86 0.1.22) returns wrong
//! single-precision products or writes out of bounds on AVX-512 machines when the destination is row-major
//! with a stride, which is every slab of a three-dimensional array.

use pulp::{Arch, Simd, WithSimd};

/// Scalars of the kernels: `f32` inside preconditioners, `f64` elsewhere.
pub trait Real:
    Copy
    + Default
    + Send
    + Sync
    + PartialEq
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + std::ops::AddAssign
    + 'static
{
    /// Rounds from double precision.
    fn from_f64(x: f64) -> Self;
    /// Widens to double precision.
    fn to_f64(self) -> f64;
    /// `self * a + b`, rounded once.
    #[must_use]
    fn multiply_add(self, a: Self, b: Self) -> Self;
    #[doc(hidden)]
    fn product(a: Left<'_, Self>, b: Right<'_, Self>, c: &mut Target<'_, Self>, accumulate: bool);
}

/// Left factor: element (i, p) at `i * row + p * col`.
#[derive(Debug, Clone, Copy)]
pub struct Left<'a, T> {
    /// The entries.
    pub data: &'a [T],
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// Stride between rows.
    pub row: usize,
    /// Stride between columns.
    pub col: usize,
}

/// Right factor: element (p, j) at `p * stride + j`; as many rows as the left factor has columns.
#[derive(Debug, Clone, Copy)]
pub struct Right<'a, T> {
    /// The entries.
    pub data: &'a [T],
    /// Number of columns.
    pub cols: usize,
    /// Stride between rows.
    pub stride: usize,
}

/// Destination of the product: element (i, j) at `i * stride + j`.
#[derive(Debug)]
pub struct Target<'a, T> {
    /// The entries.
    pub data: &'a mut [T],
    /// Stride between rows.
    pub stride: usize,
}

/// `c = a b`, or `c += a b`, on the calling thread, with the widest vectors the processor has.
///
/// Every entry is summed in the order of the inner index, whatever the shape: splitting a product by rows or
/// columns does not change its bytes.
pub fn multiply<T: Real>(a: Left<'_, T>, b: Right<'_, T>, mut c: Target<'_, T>, accumulate: bool) {
    if a.rows > 0 && b.cols > 0 {
        T::product(a, b, &mut c, accumulate);
    }
}

macro_rules! real {
    ($t:ident, $module:ident, $vector:ident, $lanes:ident, $splat:ident, $fma:ident, $add:ident, $as_simd:ident,
     $as_mut:ident, $load:ident, $store:ident) => {
        mod $module {
            use super::*;

            struct Product<'a, 'b, 'c> {
                a: Left<'a, $t>,
                b: Right<'b, $t>,
                c: &'c mut Target<'b, $t>,
                accumulate: bool,
            }

            impl WithSimd for Product<'_, '_, '_> {
                type Output = ();
                #[inline(always)]
                fn with_simd<S: Simd>(self, simd: S) {
                    let Product { a, b, c, accumulate } = self;
                    let (n, w) = (b.cols, S::$lanes);
                    // Columns outermost: a strip of b stays in the first-level cache for all rows of a.
                    let mut j = 0;
                    while j < n {
                        let left = n - j;
                        let width = if left >= 8 * w {
                            4 * w
                        } else if left > 4 * w {
                            3 * w
                        } else {
                            left
                        };
                        match width.div_ceil(w) {
                            1 => strip::<S, 1>(simd, a, b, c, accumulate, j, width),
                            2 => strip::<S, 2>(simd, a, b, c, accumulate, j, width),
                            3 => strip::<S, 3>(simd, a, b, c, accumulate, j, width),
                            _ => strip::<S, 4>(simd, a, b, c, accumulate, j, width),
                        }
                        j += width;
                    }
                }
            }

            /// The product for the columns `j .. j + width`, which fill at most `NV` vectors.
            #[inline(always)]
            fn strip<S: Simd, const NV: usize>(
                simd: S,
                a: Left<'_, $t>,
                b: Right<'_, $t>,
                c: &mut Target<'_, $t>,
                accumulate: bool,
                j: usize,
                width: usize,
            ) {
                let full = width == NV * S::$lanes;
                let mut i = 0;
                while a.rows - i >= 6 {
                    tile::<S, 6, NV>(simd, a, b, c, accumulate, i, j, width, full);
                    i += 6;
                }
                if a.rows - i >= 3 {
                    tile::<S, 3, NV>(simd, a, b, c, accumulate, i, j, width, full);
                    i += 3;
                }
                while a.rows > i {
                    tile::<S, 1, NV>(simd, a, b, c, accumulate, i, j, width, full);
                    i += 1;
                }
            }

            /// The product for `MR` rows from row `i` on of the columns of a strip; `full` says that these
            /// columns fill all `NV` vectors.
            #[inline(always)]
            fn tile<S: Simd, const MR: usize, const NV: usize>(
                simd: S,
                a: Left<'_, $t>,
                b: Right<'_, $t>,
                c: &mut Target<'_, $t>,
                accumulate: bool,
                i: usize,
                j: usize,
                width: usize,
                full: bool,
            ) {
                let w = S::$lanes;
                let mut sum = [[simd.$splat(0.0); NV]; MR];
                for p in 0..a.cols {
                    let row = &b.data[p * b.stride + j..][..width];
                    let mut v = [simd.$splat(0.0); NV];
                    let (whole, _) = S::$as_simd(row);
                    if full {
                        v.copy_from_slice(whole);
                    } else {
                        v[..NV - 1].copy_from_slice(&whole[..NV - 1]);
                        v[NV - 1] = simd.$load(&row[(NV - 1) * w..]);
                    }
                    for r in 0..MR {
                        let x = simd.$splat(a.data[(i + r) * a.row + p * a.col]);
                        for s in 0..NV {
                            sum[r][s] = simd.$fma(x, v[s], sum[r][s]);
                        }
                    }
                }
                for r in 0..MR {
                    let row = &mut c.data[(i + r) * c.stride + j..][..width];
                    if full {
                        let (whole, _) = S::$as_mut(row);
                        for s in 0..NV {
                            whole[s] = if accumulate { simd.$add(whole[s], sum[r][s]) } else { sum[r][s] };
                        }
                    } else {
                        let (head, tail) = row.split_at_mut((NV - 1) * w);
                        let (whole, _) = S::$as_mut(head);
                        for s in 0..NV - 1 {
                            whole[s] = if accumulate { simd.$add(whole[s], sum[r][s]) } else { sum[r][s] };
                        }
                        let old = if accumulate { simd.$load(tail) } else { simd.$splat(0.0) };
                        simd.$store(tail, simd.$add(old, sum[r][NV - 1]));
                    }
                }
            }

            impl Real for $t {
                #[inline(always)]
                fn from_f64(x: f64) -> Self {
                    x as $t
                }
                #[inline(always)]
                fn to_f64(self) -> f64 {
                    f64::from(self)
                }
                #[inline(always)]
                fn multiply_add(self, a: Self, b: Self) -> Self {
                    self.mul_add(a, b)
                }
                fn product(
                    a: Left<'_, Self>,
                    b: Right<'_, Self>,
                    c: &mut Target<'_, Self>,
                    accumulate: bool,
                ) {
                    let c = &mut Target { data: &mut *c.data, stride: c.stride };
                    Arch::new().dispatch(Product { a, b, c, accumulate });
                }
            }
        }
    };
}

real!(
    f32,
    single,
    f32s,
    F32_LANES,
    splat_f32s,
    mul_add_e_f32s,
    add_f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    partial_load_f32s,
    partial_store_f32s
);
real!(
    f64,
    double,
    f64s,
    F64_LANES,
    splat_f64s,
    mul_add_e_f64s,
    add_f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    partial_load_f64s,
    partial_store_f64s
);

#[cfg(test)]
mod tests {
    use super::*;

    fn check<T: Real>(tolerance: f64) {
        for (m, k, n) in
            [(1, 1, 1), (3, 5, 2), (8, 7, 33), (13, 9, 70), (21, 17, 15), (7, 4, 64), (2, 3, 129)]
        {
            for pad in [0, 5] {
                let (bs, cs) = (n + pad, n + 2 * pad);
                let a: Vec<T> = (0..m * k).map(|i| T::from_f64((i as f64 * 0.7).sin())).collect();
                let b: Vec<T> = (0..k * bs).map(|i| T::from_f64((i as f64 * 1.3).cos())).collect();
                let before: Vec<T> = (0..m * cs).map(|i| T::from_f64(i as f64 * 0.01)).collect();
                for (accumulate, (row, col)) in
                    [(false, (k, 1)), (true, (k, 1)), (false, (1, m)), (true, (1, m))]
                {
                    let mut c = before.clone();
                    multiply(
                        Left { data: &a, rows: m, cols: k, row, col },
                        Right { data: &b, cols: n, stride: bs },
                        Target { data: &mut c, stride: cs },
                        accumulate,
                    );
                    for i in 0..m {
                        for j in 0..cs {
                            let mut want = before[i * cs + j].to_f64();
                            if j < n {
                                let sum: f64 = (0..k)
                                    .map(|p| a[i * row + p * col].to_f64() * b[p * bs + j].to_f64())
                                    .sum();
                                want = if accumulate { want + sum } else { sum };
                            }
                            assert!(
                                (c[i * cs + j].to_f64() - want).abs() < tolerance,
                                "{m} {k} {n} at {i} {j}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn products_of_all_shapes_and_strides_agree_with_the_definition() {
        check::<f64>(1e-13);
        check::<f32>(1e-4);
    }
}
