//! The operations that kernels are written with, the same for every instruction set. A kernel is
//! written once over [`Lanes`] and compiled for each set. Every operation is one IEEE-754 operation
//! per lane, so the results have the same bits for every width.

use std::sync::atomic::{AtomicU8, Ordering};

/// Which instructions the kernels use. All give the same bits; only the time differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Kernel {
    /// No explicit vector instructions: any architecture.
    Plain = 1,
    /// Four lanes. Every x86-64 has it.
    Sse2 = 2,
    /// Eight lanes.
    Avx2 = 3,
}

// Global, but not a hidden input: every value here gives the same bits.
static FORCED: AtomicU8 = AtomicU8::new(0);

impl Kernel {
    /// The kernels this machine can run, slowest first.
    pub fn available() -> Vec<Kernel> {
        let all = [Kernel::Plain, Kernel::Sse2, Kernel::Avx2];
        all.into_iter().filter(|kernel| kernel.runs_here()).collect()
    }

    fn runs_here(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return self != Kernel::Avx2 || std::arch::is_x86_feature_detected!("avx2");
        #[cfg(not(target_arch = "x86_64"))]
        return self == Kernel::Plain;
    }

    /// Makes every later call in this process use `kernel` (`None`: the fastest again). For tests
    /// and measurements.
    ///
    /// - panics: this machine cannot run `kernel`.
    pub fn force(kernel: Option<Kernel>) {
        if let Some(kernel) = kernel {
            assert!(kernel.runs_here(), "no {kernel:?} on this machine");
        }
        FORCED.store(kernel.map_or(0, |kernel| kernel as u8), Ordering::Relaxed);
    }

    /// Runs `task` with this kernel, for tests and measurements. Callers of one process wait for
    /// each other.
    ///
    /// - panics: as [`Kernel::force`].
    pub fn run<T>(self, task: impl FnOnce() -> T) -> T {
        static ONE: std::sync::Mutex<()> = std::sync::Mutex::new(());
        let _guard = ONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        Kernel::force(Some(self));
        let result = task();
        Kernel::force(None);
        result
    }

    /// The kernel that calls use now.
    pub fn current() -> Kernel {
        match FORCED.load(Ordering::Relaxed) {
            1 => Kernel::Plain,
            2 => Kernel::Sse2,
            3 => Kernel::Avx2,
            _ => Kernel::fastest(),
        }
    }

    fn fastest() -> Kernel {
        let fastest_first = [Kernel::Avx2, Kernel::Sse2];
        fastest_first.into_iter().find(|kernel| kernel.runs_here()).unwrap_or(Kernel::Plain)
    }
}

/// `WIDTH` numbers side by side.
///
/// # Safety
/// For every method: the machine has the instruction set of the type. For `load`, the pointer is
/// valid for reads of `WIDTH` numbers; for `store`, for writes. It is aligned as an `f32` is.
pub(super) trait Lanes {
    const WIDTH: usize;
    type Vector: Copy;
    /// The next narrower lanes, for what is left over at the end of a row.
    type Narrower: Lanes;
    unsafe fn splat(value: f32) -> Self::Vector;
    unsafe fn load(from: *const f32) -> Self::Vector;
    unsafe fn store(to: *mut f32, value: Self::Vector);
    unsafe fn add(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    unsafe fn sub(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    unsafe fn mul(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    unsafe fn div(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    unsafe fn sqrt(a: Self::Vector) -> Self::Vector;
    /// The smaller; `b` where either is NaN.
    unsafe fn min(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// The larger; `b` where either is NaN.
    unsafe fn max(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// 2 to the power of a whole number between −126 and 127.
    unsafe fn power_of_two(whole: Self::Vector) -> Self::Vector;
}

pub(super) struct One;

impl Lanes for One {
    const WIDTH: usize = 1;
    type Vector = f32;
    type Narrower = One;
    #[inline(always)]
    unsafe fn splat(value: f32) -> f32 {
        value
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> f32 {
        // SAFETY: the caller's pointer is valid for reads of one number, and aligned.
        unsafe { *from }
    }
    #[inline(always)]
    unsafe fn store(to: *mut f32, value: f32) {
        // SAFETY: the caller's pointer is valid for writes of one number, and aligned.
        unsafe { *to = value }
    }
    #[inline(always)]
    unsafe fn add(a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline(always)]
    unsafe fn sub(a: f32, b: f32) -> f32 {
        a - b
    }
    #[inline(always)]
    unsafe fn mul(a: f32, b: f32) -> f32 {
        a * b
    }
    #[inline(always)]
    unsafe fn div(a: f32, b: f32) -> f32 {
        a / b
    }
    #[inline(always)]
    unsafe fn sqrt(a: f32) -> f32 {
        a.sqrt()
    }
    #[inline(always)]
    unsafe fn min(a: f32, b: f32) -> f32 {
        if a < b { a } else { b }
    }
    #[inline(always)]
    unsafe fn max(a: f32, b: f32) -> f32 {
        if a > b { a } else { b }
    }
    #[inline(always)]
    unsafe fn power_of_two(whole: f32) -> f32 {
        f32::from_bits(((whole as i32 + 127) << 23) as u32)
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Eight, Four};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Lanes, One};

    macro_rules! lanes {
        ($name:ident, $width:expr, $vector:ty, $narrower:ty,
         $splat:ident $load:ident $store:ident $add:ident $sub:ident $mul:ident $div:ident
         $sqrt:ident $min:ident $max:ident
         $to_whole:ident $whole:ident $add_whole:ident $shift:ident $cast:ident) => {
            pub(in crate::numerics) struct $name;

            impl Lanes for $name {
                const WIDTH: usize = $width;
                type Vector = $vector;
                type Narrower = $narrower;
                #[inline(always)]
                unsafe fn splat(value: f32) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $splat(value) }
                }
                #[inline(always)]
                unsafe fn load(from: *const f32) -> $vector {
                    // SAFETY: the caller has the instruction set, and a pointer valid for `WIDTH`
                    // numbers.
                    unsafe { $load(from) }
                }
                #[inline(always)]
                unsafe fn store(to: *mut f32, value: $vector) {
                    // SAFETY: the caller has the instruction set, and a pointer valid for `WIDTH`
                    // numbers.
                    unsafe { $store(to, value) }
                }
                #[inline(always)]
                unsafe fn add(a: $vector, b: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $add(a, b) }
                }
                #[inline(always)]
                unsafe fn sub(a: $vector, b: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $sub(a, b) }
                }
                #[inline(always)]
                unsafe fn mul(a: $vector, b: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $mul(a, b) }
                }
                #[inline(always)]
                unsafe fn div(a: $vector, b: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $div(a, b) }
                }
                #[inline(always)]
                unsafe fn sqrt(a: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $sqrt(a) }
                }
                #[inline(always)]
                unsafe fn min(a: $vector, b: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $min(a, b) }
                }
                #[inline(always)]
                unsafe fn max(a: $vector, b: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $max(a, b) }
                }
                #[inline(always)]
                unsafe fn power_of_two(whole: $vector) -> $vector {
                    // SAFETY: the caller has the instruction set.
                    unsafe { $cast($shift::<23>($add_whole($to_whole(whole), $whole(127)))) }
                }
            }
        };
    }

    lanes!(
        Four, 4, __m128, One,
        _mm_set1_ps _mm_loadu_ps _mm_storeu_ps _mm_add_ps _mm_sub_ps _mm_mul_ps _mm_div_ps
        _mm_sqrt_ps _mm_min_ps _mm_max_ps
        _mm_cvtps_epi32 _mm_set1_epi32 _mm_add_epi32 _mm_slli_epi32 _mm_castsi128_ps
    );
    lanes!(
        Eight, 8, __m256, Four,
        _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_add_ps _mm256_sub_ps _mm256_mul_ps
        _mm256_div_ps _mm256_sqrt_ps _mm256_min_ps _mm256_max_ps
        _mm256_cvtps_epi32 _mm256_set1_epi32 _mm256_add_epi32 _mm256_slli_epi32 _mm256_castsi256_ps
    );
}

/// Defines `$name`, which runs the generic `$body` with the lanes of [`Kernel::current`].
macro_rules! dispatch {
    ($name:ident, $body:ident, ($($arg:ident: $kind:ty),*)) => {
        /// # Safety
        /// The pointers are valid for what `$body` reads and writes.
        unsafe fn $name($($arg: $kind),*) {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                unsafe fn eight($($arg: $kind),*) {
                    // SAFETY: `eight` runs with AVX2 alone, and the pointers are the caller's.
                    unsafe { $body::<$crate::numerics::lanes::Eight>($($arg),*) }
                }
                match $crate::numerics::Kernel::current() {
                    // SAFETY: `Kernel::current` names only what this machine has, here AVX2, and
                    // the pointers are the caller's.
                    $crate::numerics::Kernel::Avx2 => return unsafe { eight($($arg),*) },
                    $crate::numerics::Kernel::Sse2 => {
                        // SAFETY: every x86-64 has SSE2, and the pointers are the caller's.
                        return unsafe { $body::<$crate::numerics::lanes::Four>($($arg),*) };
                    }
                    $crate::numerics::Kernel::Plain => {}
                }
            }
            // SAFETY: `One` needs no instruction set, and the pointers are the caller's.
            unsafe { $body::<$crate::numerics::lanes::One>($($arg),*) }
        }
    };
}
pub(super) use dispatch;
