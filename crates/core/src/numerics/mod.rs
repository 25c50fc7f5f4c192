//! Arithmetic that gives the same bits on every machine: a fixed order of summation, separate
//! multiply and add, and no function of the platform. Everything that learns uses it.
//!
//! The kernels run on vector instructions, which need `unsafe`. A kernel is written once over
//! `Lanes` and called through `dispatch!`, which picks the widest instructions that this machine
//! has.

#[allow(unsafe_code, reason = "its kernel runs on vector instructions")]
mod adam;
#[allow(unsafe_code, reason = "its kernels run on vector instructions")]
mod elementary;
mod floats;
#[allow(unsafe_code, reason = "its kernel runs on vector instructions")]
mod gemm;
mod init;
#[allow(unsafe_code, reason = "vector instructions are unsafe functions")]
mod lanes;
mod linear;
mod lstm;
mod mlp;
mod rng;
#[allow(unsafe_code, reason = "its kernels run on vector instructions")]
mod vector;
mod version;

pub use adam::{Adam, AdamSettings};
pub use elementary::{
    bce, bce_with_logit, cos, exp, exp_all, ln, sigmoid, sigmoid_all, sin, softmax, tanh, tanh_all,
};
pub use floats::Floats;
pub use gemm::{Shape, Sink, gemm, gemm_oracle, gemm_transposed_a, transpose};
pub use init::{fill_normal, fill_uniform, glorot};
pub use lanes::Kernel;
pub use linear::{Linear, LinearScratch, relu, relu_backward};
pub use lstm::{lstm_cell, lstm_cell_backward};
pub use mlp::{Mlp, MlpGradients, MlpTrace};
pub use rng::Rng;
pub use vector::{cosine, distance, dot, norm, normalise, sum};
pub use version::NumericsVersion;
