//! Shared by integration tests; each uses the parts it needs.
#![allow(dead_code)]

pub mod diary;
pub mod ran;
pub mod toy;
