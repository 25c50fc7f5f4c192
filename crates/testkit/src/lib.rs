//! What the tests share: a toy world, one person's diary, labs with keys, data directories of former
//! releases, and the program as people start it.

pub mod chance;
pub mod diary;
pub mod dice;
pub mod front;
pub mod lab;
pub mod paths;
pub mod python;
pub mod ran;
pub mod recorded;
pub mod released;
pub mod samples;
pub mod toy;
pub mod tree;
pub mod value;
