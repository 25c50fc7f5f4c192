//! Hands on where `libsodium-sys-stable` built its library: build scripts learn that, libraries do not.

fn main() {
    for (from, to) in [("DEP_SODIUM_INCLUDE", "SODIUM_INCLUDE"), ("DEP_SODIUM_LIB", "SODIUM_LIB")] {
        println!("cargo:rerun-if-env-changed={from}");
        let place = std::env::var(from).unwrap_or_else(|_| {
            panic!("libsodium-sys-stable gives no {from}; is its version right?")
        });
        println!("cargo:rustc-env={to}={place}");
    }
}
