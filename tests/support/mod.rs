//! Shared by integration tests; each uses the parts it needs.
#![allow(dead_code)]

pub mod diary;
pub mod front;
pub mod ran;
pub mod toy;
