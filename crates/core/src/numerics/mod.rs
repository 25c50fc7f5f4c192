//! Arithmetic that gives the same bits on every machine: fixed order of summation, separate
//! multiply and add, no function of the platform. Everything that learns is built on this room.

mod adam;
mod elementary;
mod floats;
mod gemm;
mod init;
mod lanes;
mod linear;
mod lstm;
mod mlp;
mod rng;
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
