use super::lanes::{Lanes, dispatch};

/// The sizes of one product: `[rows × inner] · [inner × columns]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Rows of the left side and of the result.
    pub rows: usize,
    /// Columns of the left side, rows of the right side.
    pub inner: usize,
    /// Columns of the right side and of the result.
    pub columns: usize,
}

/// What happens to the numbers that are where the product goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sink {
    /// The product takes its place.
    Replace,
    /// The product is added to them, term by term.
    Add,
}

/// `c = a · b`, all row-major: `a` is `[rows × inner]`, `b` is `[inner × columns]`.
///
/// Same bits on every machine: each entry starts at 0 (or at its present number) and adds its terms
/// for `inner = 0, 1, 2, …`, product and sum rounded separately. Lanes lie along the columns, so
/// the width of the machine's vectors does not change that order.
///
/// - panics: a slice does not have the size that `shape` says.
pub fn gemm(shape: Shape, a: &[f32], b: &[f32], c: &mut [f32], sink: Sink) {
    product(shape, a, [shape.inner, 1], b, c, sink);
}

/// `c = aᵀ · b`: as [`gemm`], with `a` stored as `[inner × rows]`.
///
/// - panics: a slice does not have the size that `shape` says.
pub fn gemm_transposed_a(shape: Shape, a: &[f32], b: &[f32], c: &mut [f32], sink: Sink) {
    product(shape, a, [1, shape.rows], b, c, sink);
}

/// [`gemm`] as a plain triple loop with the same order of summation. The kernels are tested against
/// it.
///
/// - panics: a slice is smaller than `shape` says.
pub fn gemm_oracle(shape: Shape, a: &[f32], b: &[f32], c: &mut [f32], sink: Sink) {
    let Shape { rows, inner, columns } = shape;
    for row in 0..rows {
        for column in 0..columns {
            let entry = &mut c[row * columns + column];
            let mut sum = if sink == Sink::Add { *entry } else { 0.0 };
            for k in 0..inner {
                sum += a[row * inner + k] * b[k * columns + column];
            }
            *entry = sum;
        }
    }
}

/// Writes `x` `[rows × columns]` as `out` `[columns × rows]`.
///
/// - panics: `x` does not have its size.
pub fn transpose(rows: usize, columns: usize, x: &[f32], out: &mut Vec<f32>) {
    assert_eq!(x.len(), rows * columns, "a matrix of {rows} × {columns}");
    out.clear();
    out.reserve(rows * columns);
    for column in 0..columns {
        out.extend((0..rows).map(|row| x[row * columns + column]));
    }
}

fn product(shape: Shape, a: &[f32], strides: [usize; 2], b: &[f32], c: &mut [f32], sink: Sink) {
    let Shape { rows, inner, columns } = shape;
    assert_eq!(a.len(), rows * inner, "left side of {shape:?}");
    assert_eq!(b.len(), inner * columns, "right side of {shape:?}");
    assert_eq!(c.len(), rows * columns, "result of {shape:?}");
    let task = Task { shape, strides, add: sink == Sink::Add };
    // SAFETY: the three slices have the sizes that `task` says.
    unsafe { run(task, a.as_ptr(), b.as_ptr(), c.as_mut_ptr()) }
}

#[derive(Clone, Copy)]
struct Task {
    shape: Shape,
    /// Steps in `a` to the next row and to the next inner index.
    strides: [usize; 2],
    add: bool,
}

dispatch!(run, all, (task: Task, a: *const f32, b: *const f32, c: *mut f32));

/// Rows computed together: each loaded piece of `b` serves all of them.
const ROWS: usize = 4;

/// # Safety
/// The machine has the instruction set of `L`. `a` and `b` are valid for reads and `c` for writes
/// of the matrices that `task` describes.
#[inline(always)]
unsafe fn all<L: Lanes>(task: Task, a: *const f32, b: *const f32, c: *mut f32) {
    let Shape { rows, columns, .. } = task.shape;
    let mut row = 0;
    while row < rows {
        // SAFETY: `row < rows`, so the row lies in the matrix.
        let a = unsafe { a.add(row * task.strides[0]) };
        // SAFETY: as above.
        let c = unsafe { c.add(row * columns) };
        if rows - row >= ROWS {
            // SAFETY: `ROWS` rows are left from here.
            unsafe { band::<L, ROWS, 2>(task, a, b, c) };
            row += ROWS;
        } else {
            // SAFETY: one row is left from here.
            unsafe { band::<L, 1, 4>(task, a, b, c) };
            row += 1;
        }
    }
}

/// `R` rows of the result, over all columns.
///
/// # Safety
/// As [`all`], with `a` and `c` at the first of `R` rows.
#[inline(always)]
unsafe fn band<L: Lanes, const R: usize, const V: usize>(
    task: Task,
    a: *const f32,
    b: *const f32,
    c: *mut f32,
) {
    let columns = task.shape.columns;
    let mut column = 0;
    // SAFETY: each tile is as wide as there are columns left at least; narrower lanes need an
    // instruction set that the wider ones include.
    unsafe {
        while columns - column >= V * L::WIDTH {
            tile::<L, R, V>(task, a, b.add(column), c.add(column));
            column += V * L::WIDTH;
        }
        while columns - column >= L::WIDTH {
            tile::<L, R, 1>(task, a, b.add(column), c.add(column));
            column += L::WIDTH;
        }
        while columns - column >= L::Narrower::WIDTH {
            tile::<L::Narrower, R, 1>(task, a, b.add(column), c.add(column));
            column += L::Narrower::WIDTH;
        }
        while column < columns {
            tile::<super::lanes::One, R, 1>(task, a, b.add(column), c.add(column));
            column += 1;
        }
    }
}

/// `R` rows × `V` vectors of the result, kept in registers during the whole inner loop.
///
/// # Safety
/// As [`all`], with `a` at the first of `R` rows, and `b` and `c` at a column with `V · L::WIDTH`
/// columns left.
#[inline(always)]
unsafe fn tile<L: Lanes, const R: usize, const V: usize>(
    task: Task,
    a: *const f32,
    b: *const f32,
    c: *mut f32,
) {
    let columns = task.shape.columns;
    // SAFETY: `r < R`, `k < inner` and `v < V`, so every place is in its matrix.
    unsafe {
        let mut sums = [[L::splat(0.0); V]; R];
        if task.add {
            for (r, row) in sums.iter_mut().enumerate() {
                for (v, sum) in row.iter_mut().enumerate() {
                    *sum = L::load(c.add(r * columns + v * L::WIDTH));
                }
            }
        }
        for k in 0..task.shape.inner {
            let mut right = [L::splat(0.0); V];
            for (v, piece) in right.iter_mut().enumerate() {
                *piece = L::load(b.add(k * columns + v * L::WIDTH));
            }
            for (r, row) in sums.iter_mut().enumerate() {
                let left = L::splat(*a.add(r * task.strides[0] + k * task.strides[1]));
                for (sum, piece) in row.iter_mut().zip(right) {
                    *sum = L::add(*sum, L::mul(left, piece));
                }
            }
        }
        for (r, row) in sums.iter().enumerate() {
            for (v, sum) in row.iter().enumerate() {
                L::store(c.add(r * columns + v * L::WIDTH), *sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Kernel, Rng};

    fn bits(x: &[f32]) -> Vec<u32> {
        x.iter().map(|value| value.to_bits()).collect()
    }

    #[test]
    fn every_kernel_gives_the_bits_of_the_plain_loop() {
        let seed = 11;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        for round in 0..200 {
            let shape =
                Shape { rows: 1 + rng.below(19), inner: rng.below(40), columns: 1 + rng.below(45) };
            let Shape { rows, inner, columns } = shape;
            let mut draw = |count: usize| (0..count).map(|_| rng.normal()).collect::<Vec<f32>>();
            let (a, b) = (draw(rows * inner), draw(inner * columns));
            let start = draw(rows * columns);
            let mut a_transposed = Vec::new();
            transpose(rows, inner, &a, &mut a_transposed);
            for sink in [Sink::Replace, Sink::Add] {
                let mut expected = start.clone();
                gemm_oracle(shape, &a, &b, &mut expected, sink);
                for kernel in Kernel::available() {
                    let (mut plain, mut transposed) = (start.clone(), start.clone());
                    kernel.run(|| {
                        gemm(shape, &a, &b, &mut plain, sink);
                        gemm_transposed_a(shape, &a_transposed, &b, &mut transposed, sink);
                    });
                    assert_eq!(bits(&plain), bits(&expected), "{kernel:?} {shape:?} {round}");
                    assert_eq!(bits(&transposed), bits(&expected), "{kernel:?} {shape:?} {round}");
                }
            }
        }
    }

    #[test]
    #[should_panic(expected = "left side")]
    fn a_slice_of_the_wrong_size_is_refused() {
        let shape = Shape { rows: 2, inner: 2, columns: 2 };
        gemm(shape, &[1.0; 3], &[1.0; 4], &mut [0.0; 4], Sink::Replace);
    }
}
