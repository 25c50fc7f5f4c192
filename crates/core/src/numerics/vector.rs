use super::lanes::{Lanes, dispatch};

/// Partial sums that [`dot`] keeps side by side; fixed, so that the order of summation is the same
/// for every width of the machine's vectors.
const STRIPES: usize = 8;

/// Σ aᵢbᵢ. Entry `i` goes to partial sum `i mod 8`, each from left to right; the partial sums are
/// then added pairwise: ((0+4)+(2+6)) + ((1+5)+(3+7)).
///
/// - panics: the lengths differ.
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len(), "vectors of one length");
    let mut sums = [0.0; STRIPES];
    let whole = a.len() / STRIPES * STRIPES;
    // SAFETY: both slices have at least `whole` numbers, a multiple of `STRIPES`, and `sums` has
    // `STRIPES`.
    unsafe { stripes(a.as_ptr(), b.as_ptr(), whole, sums.as_mut_ptr()) };
    fold(sums, &a[whole..], |i, x| x * b[whole + i])
}

/// Σ aᵢ, summed in the order of [`dot`].
pub fn sum(a: &[f32]) -> f32 {
    let mut sums = [0.0; STRIPES];
    let whole = a.len() / STRIPES * STRIPES;
    // SAFETY: `a` has at least `whole` numbers, a multiple of `STRIPES`, and `sums` has `STRIPES`.
    unsafe { plain_stripes(a.as_ptr(), whole, sums.as_mut_ptr()) };
    fold(sums, &a[whole..], |_, x| x)
}

/// The Euclidean distance, summed in the order of [`dot`]. Exactly 0 for equal vectors.
///
/// - panics: the lengths differ.
pub fn distance(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len(), "vectors of one length");
    let mut sums = [0.0; STRIPES];
    let whole = a.len() / STRIPES * STRIPES;
    // SAFETY: as in `dot`.
    unsafe { square_stripes(a.as_ptr(), b.as_ptr(), whole, sums.as_mut_ptr()) };
    fold(sums, &a[whole..], |i, x| (x - b[whole + i]) * (x - b[whole + i])).sqrt()
}

fn fold(mut sums: [f32; STRIPES], rest: &[f32], term: impl Fn(usize, f32) -> f32) -> f32 {
    for (i, &x) in rest.iter().enumerate() {
        sums[i] += term(i, x);
    }
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

dispatch!(stripes, stripes_body, (a: *const f32, b: *const f32, count: usize, sums: *mut f32));

/// # Safety
/// As [`add_up`]; `a` and `b` are valid for reads of `count` numbers.
#[inline(always)]
unsafe fn stripes_body<L: Lanes>(a: *const f32, b: *const f32, count: usize, sums: *mut f32) {
    // SAFETY: `add_up` asks for `WIDTH` numbers at places that end before `count`.
    unsafe { add_up::<L>(count, sums, |at| L::mul(L::load(a.add(at)), L::load(b.add(at)))) }
}

dispatch!(plain_stripes, plain_body, (a: *const f32, count: usize, sums: *mut f32));

/// # Safety
/// As [`add_up`]; `a` is valid for reads of `count` numbers.
#[inline(always)]
unsafe fn plain_body<L: Lanes>(a: *const f32, count: usize, sums: *mut f32) {
    // SAFETY: `add_up` asks for `WIDTH` numbers at places that end before `count`.
    unsafe { add_up::<L>(count, sums, |at| L::load(a.add(at))) }
}

dispatch!(
    square_stripes,
    square_body,
    (a: *const f32, b: *const f32, count: usize, sums: *mut f32)
);

/// # Safety
/// As [`stripes_body`].
#[inline(always)]
unsafe fn square_body<L: Lanes>(a: *const f32, b: *const f32, count: usize, sums: *mut f32) {
    // SAFETY: `add_up` asks for `WIDTH` numbers at places that end before `count`.
    let term = |at| unsafe {
        let gap = L::sub(L::load(a.add(at)), L::load(b.add(at)));
        L::mul(gap, gap)
    };
    // SAFETY: the caller's promises are those of `add_up`.
    unsafe { add_up::<L>(count, sums, term) }
}

/// Adds `term(at)` for `at = 0, WIDTH, 2·WIDTH, … < count` to the partial sums.
///
/// # Safety
/// The machine has the instruction set of `L`. `count` is a multiple of [`STRIPES`], which is one
/// of `L::WIDTH`; `sums` is valid for writes of [`STRIPES`] numbers.
#[inline(always)]
unsafe fn add_up<L: Lanes>(count: usize, sums: *mut f32, term: impl Fn(usize) -> L::Vector) {
    // SAFETY: the operations need the instruction set alone. The stores go to `vectors · WIDTH =
    // STRIPES` numbers at `sums`.
    unsafe {
        let mut stripe = [L::splat(0.0); STRIPES];
        let vectors = STRIPES / L::WIDTH;
        let mut at = 0;
        while at < count {
            for (v, sum) in stripe.iter_mut().enumerate().take(vectors) {
                *sum = L::add(*sum, term(at + v * L::WIDTH));
            }
            at += STRIPES;
        }
        for (v, sum) in stripe.iter().enumerate().take(vectors) {
            L::store(sums.add(v * L::WIDTH), *sum);
        }
    }
}

/// The Euclidean length.
pub fn norm(a: &[f32]) -> f32 {
    dot(a, a).sqrt()
}

/// a·b / (‖a‖‖b‖), between −1 and 1; 0 when either vector is zero.
pub fn cosine(a: &[f32], b: &[f32]) -> f32 {
    let lengths = norm(a) * norm(b);
    if lengths > 0.0 { (dot(a, b) / lengths).clamp(-1.0, 1.0) } else { 0.0 }
}

/// Divides by the length; the zero vector stays. Returns the length.
pub fn normalise(a: &mut [f32]) -> f32 {
    let length = norm(a);
    if length > 0.0 {
        a.iter_mut().for_each(|x| *x /= length);
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{Kernel, Rng};

    #[test]
    fn every_kernel_sums_alike() {
        let mut rng = Rng::from_u64(3);
        for length in 0..70 {
            let a: Vec<f32> = (0..length).map(|_| rng.normal()).collect();
            let b: Vec<f32> = (0..length).map(|_| rng.normal()).collect();
            let mut striped = [0.0f32; 8];
            let mut squares = [0.0f32; 8];
            let mut plain = [0.0f32; 8];
            for i in 0..length {
                striped[i % 8] += a[i] * b[i];
                plain[i % 8] += a[i];
                squares[i % 8] += (a[i] - b[i]) * (a[i] - b[i]);
            }
            let pairs =
                |s: [f32; 8]| ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
            for kernel in Kernel::available() {
                let found = kernel.run(|| [dot(&a, &b), distance(&a, &b), sum(&a)]);
                let expected = [pairs(striped), pairs(squares).sqrt(), pairs(plain)];
                let bits = |numbers: [f32; 3]| numbers.map(f32::to_bits);
                assert_eq!(bits(found), bits(expected), "{kernel:?} {length}");
            }
        }
    }

    #[test]
    fn cosine_knows_parallel_opposite_and_zero() {
        assert_eq!(cosine(&[2.0, 0.0], &[5.0, 0.0]), 1.0);
        assert_eq!(cosine(&[2.0, 0.0], &[-5.0, 0.0]), -1.0);
        assert_eq!(cosine(&[0.0, 0.0], &[1.0, 0.0]), 0.0);
        let mut a = [3.0, 4.0];
        assert_eq!(normalise(&mut a), 5.0);
        assert_eq!(a, [0.6, 0.8]);
    }
}
