//! The matrix product, in one order of additions on every machine.
//!
//! `ndarray`'s own products pick their kernel by the processor, and with it the rounding. Here each
//! element of the result adds its terms by rising inner index, each a multiplication and then an
//! addition. Wide registers hold different elements, so their width changes nothing but the time.

use ndarray::{ArrayView2, ArrayViewMut2, Axis, s};

/// Rows and columns of the tile that stays in registers: eight registers of eight numbers, or four of sixteen. From about
/// twice as many numbers on, the compiler no longer keeps them there.
const TILE_ROWS: usize = 4;
const TILE_COLUMNS: usize = 16;

/// `left · right` into `out`: shapes `(m, k)`, `(k, n)` and `(m, n)`; `out` lies row by row.
pub fn product(left: ArrayView2<f32>, right: ArrayView2<f32>, out: ArrayViewMut2<f32>) {
    assert_eq!(left.ncols(), right.nrows(), "inner lengths must agree");
    assert_eq!(out.dim(), (left.nrows(), right.ncols()), "the result has the outer lengths");
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has just said that it knows the instructions.
        return unsafe { product_avx512(left, right, out) };
    } else if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: as above.
        return unsafe { product_avx2(left, right, out) };
    }
    product_inlined(left, right, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn product_avx512(left: ArrayView2<f32>, right: ArrayView2<f32>, out: ArrayViewMut2<f32>) {
    product_inlined(left, right, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn product_avx2(left: ArrayView2<f32>, right: ArrayView2<f32>, out: ArrayViewMut2<f32>) {
    product_inlined(left, right, out);
}

/// Inlined into each caller, like all that it calls, so that the compiler uses the instructions which that caller may
/// use.
#[inline(always)]
fn product_inlined(left: ArrayView2<f32>, right: ArrayView2<f32>, out: ArrayViewMut2<f32>) {
    if left.nrows() < TILE_ROWS {
        by_rows(left, right, out);
    } else {
        by_tiles(left, right, out);
    }
}

/// For fewer rows than a tile has, as when an agent acts: packing would not pay.
#[inline(always)]
fn by_rows(left: ArrayView2<f32>, right: ArrayView2<f32>, mut out: ArrayViewMut2<f32>) {
    for (factors, mut sums) in left.rows().into_iter().zip(out.rows_mut()) {
        sums.fill(0.0);
        for (&factor, terms) in factors.iter().zip(right.rows()) {
            for (sum, &term) in sums.iter_mut().zip(terms) {
                *sum += factor * term;
            }
        }
    }
}

#[inline(always)]
fn by_tiles(left: ArrayView2<f32>, right: ArrayView2<f32>, mut out: ArrayViewMut2<f32>) {
    let (rows, inner, columns) = (left.nrows(), left.ncols(), right.ncols());
    let to = out.as_slice_mut().expect("the result lies row by row");
    let bands = packed_rows(left);
    let mut panel = vec![0.0; inner * TILE_COLUMNS];
    for column in (0..columns).step_by(TILE_COLUMNS) {
        let width = TILE_COLUMNS.min(columns - column);
        pack_columns(right, column, width, &mut panel);
        for row in (0..rows).step_by(TILE_ROWS) {
            let sums = tile(&bands[row * inner..(row + TILE_ROWS) * inner], &panel);
            for (offset, sums) in sums.iter().enumerate().take(rows - row) {
                let begin = (row + offset) * columns + column;
                to[begin..begin + width].copy_from_slice(&sums[..width]);
            }
        }
    }
}

/// Bands of [`TILE_ROWS`] rows, each column by column; missing rows are 0.
#[inline(always)]
fn packed_rows(left: ArrayView2<f32>) -> Vec<f32> {
    let (rows, inner) = left.dim();
    let mut bands = vec![0.0; rows.div_ceil(TILE_ROWS) * TILE_ROWS * inner];
    for (band, rows) in
        bands.chunks_exact_mut(TILE_ROWS * inner).zip(left.axis_chunks_iter(Axis(0), TILE_ROWS))
    {
        // The order of reading follows the memory, whichever way the matrix lies there.
        if rows.strides()[1] == 1 {
            for (row, values) in rows.rows().into_iter().enumerate() {
                for (packed, &value) in band.chunks_exact_mut(TILE_ROWS).zip(values) {
                    packed[row] = value;
                }
            }
        } else {
            for (packed, values) in band.chunks_exact_mut(TILE_ROWS).zip(rows.columns()) {
                packed.iter_mut().zip(values).for_each(|(packed, &value)| *packed = value);
            }
        }
    }
    bands
}

/// A panel of `width` columns, row by row, each padded to [`TILE_COLUMNS`].
#[inline(always)]
fn pack_columns(right: ArrayView2<f32>, column: usize, width: usize, panel: &mut [f32]) {
    let columns = right.slice(s![.., column..column + width]);
    if width < TILE_COLUMNS {
        panel.fill(0.0);
    }
    if columns.strides()[1] == 1 {
        for (packed, values) in panel.chunks_exact_mut(TILE_COLUMNS).zip(columns.rows()) {
            let values = values.to_slice().expect("neighbours in a row are neighbours in memory");
            packed[..width].copy_from_slice(values);
        }
    } else {
        for (at, values) in columns.columns().into_iter().enumerate() {
            for (packed, &value) in panel.chunks_exact_mut(TILE_COLUMNS).zip(values) {
                packed[at] = value;
            }
        }
    }
}

#[inline(always)]
fn tile(band: &[f32], panel: &[f32]) -> [[f32; TILE_COLUMNS]; TILE_ROWS] {
    let mut sums = [[0.0; TILE_COLUMNS]; TILE_ROWS];
    for (factors, terms) in band.chunks_exact(TILE_ROWS).zip(panel.chunks_exact(TILE_COLUMNS)) {
        for row in 0..TILE_ROWS {
            for column in 0..TILE_COLUMNS {
                sums[row][column] += factors[row] * terms[column];
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;
    use proptest::prelude::*;

    fn naive(left: ArrayView2<f32>, right: ArrayView2<f32>) -> Array2<f32> {
        Array2::from_shape_fn((left.nrows(), right.ncols()), |(row, column)| {
            let terms = left.row(row).into_iter().zip(right.column(column));
            terms.fold(0.0, |sum, (a, b)| sum + a * b)
        })
    }

    #[cfg(target_arch = "x86_64")]
    type Kernel = unsafe fn(ArrayView2<f32>, ArrayView2<f32>, ArrayViewMut2<f32>);

    proptest! {
        #[test]
        fn every_way_gives_the_bits_of_the_naive_sum(
            (m, k, n) in (1_usize..11, 1_usize..20, 1_usize..40),
            values in proptest::collection::vec(-3.0_f32..3.0, 11 * 20 + 20 * 40),
        ) {
            let left = Array2::from_shape_fn((m, k), |(i, j)| values[i * 20 + j]);
            // Transposed, so that strides are put to the test too.
            let right = Array2::from_shape_fn((n, k), |(i, j)| values[220 + j * 40 + i]);
            let expected = naive(left.view(), right.t());
            let (mut by_choice, mut portable, mut plain) =
                (Array2::zeros((m, n)), Array2::zeros((m, n)), Array2::zeros((m, n)));
            product(left.view(), right.t(), by_choice.view_mut());
            by_tiles(left.view(), right.t(), portable.view_mut());
            by_rows(left.view(), right.t(), plain.view_mut());
            prop_assert_eq!(&by_choice, &expected);
            prop_assert_eq!(&portable, &expected);
            prop_assert_eq!(&plain, &expected);
            #[cfg(target_arch = "x86_64")]
            for (has, kernel) in [
                (std::arch::is_x86_feature_detected!("avx2"), product_avx2 as Kernel),
                (std::arch::is_x86_feature_detected!("avx512f"), product_avx512 as Kernel),
            ] {
                let mut wide = Array2::zeros((m, n));
                if has {
                    // SAFETY: the processor has just said that it knows the instructions.
                    unsafe { kernel(left.view(), right.t(), wide.view_mut()) };
                    prop_assert_eq!(&wide, &expected);
                }
            }
        }
    }
}
