//! Shared by integration tests.

pub mod toy;
