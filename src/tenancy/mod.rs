//! One lab as a state machine: who may come in, how much it may take, who was erased, and which
//! stretches of its people's streams are sealed for evidence. Pure, as `session` is for a person.

mod admissions;
mod clock;
mod decide;
mod order;
mod registry;
#[cfg(test)]
mod tests;

pub use self::admissions::{Admissions, Admitted};
pub use self::clock::Clock;
pub use self::decide::{Refusal, decide};
pub use self::order::{Order, erasure_statement};
pub use self::registry::{Disagreement, Key, Registry, Retired, Segment, Standing};
pub use crate::events::{Quotas, Role};
