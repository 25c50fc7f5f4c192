use super::{Features, Show, Words};

/// A complete world: what a service needs. Every type with [`Words`], [`Features`] and [`Show`]
/// (and so with [`World`](super::World)) is one; nothing more has to be written.
///
/// Ask for this only where all four are used. A function that only runs programs asks for
/// [`World`](super::World).
pub trait Domain: Words + Features + Show {}

impl<D: Words + Features + Show> Domain for D {}
