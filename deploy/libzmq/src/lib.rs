//! `zmq` builds its own libzmq, but asks for it without libsodium, and then CURVE is missing. Cargo
//! takes this package instead of the registry's `zeromq-src` (`[patch.crates-io]` in the workspace);
//! it builds the same sources with the libsodium that `libsodium-sys-stable` compiles. Nothing but
//! Rust, a C++ compiler and make is needed.

pub use upstream::LibLocation;

/// What `zmq-sys` calls in its build script.
#[derive(Debug, Clone, Default)]
pub struct Build(upstream::Build);

impl Build {
    pub fn new() -> Build {
        Build::default()
    }

    /// Takes ours when the caller has none.
    pub fn with_libsodium(&mut self, given: Option<LibLocation>) -> &mut Build {
        let ours = || LibLocation::new(env!("SODIUM_LIB"), env!("SODIUM_INCLUDE"));
        self.0.with_libsodium(Some(given.unwrap_or_else(ours)));
        self
    }

    pub fn build(&mut self) {
        self.0.build();
    }
}
