//! Hostile bytes: bytes that no honest program writes, given to every decoder, in this process and
//! through a real socket. Each case gives a typed error or a value, never a panic, and takes a
//! bounded amount of memory. `cargo xtask fuzz --cases N --seed S` runs any number of cases.

mod memory;
mod mutate;
mod process;
mod socket;
mod targets;

use apprentice_testkit::chance::{number, seed};

#[global_allocator]
static MEMORY: memory::Counting = memory::Counting;

#[test]
fn no_bytes_make_a_decoder_panic_or_take_more_memory_than_they_are_worth() {
    let cases = number("APPRENTICE_CASES", 1_000_000);
    let only = std::env::var("APPRENTICE_TARGET").ok();
    process::run(cases, seed(), only.as_deref());
}

#[test]
fn ten_thousand_hostile_messages_leave_the_service_serving() {
    socket::run(number("APPRENTICE_MESSAGES", 10_000) as usize, seed());
}
