//! `examples/embed.rs` runs, and shows one-shot teaching to developers who embed the service.

#[path = "../../examples/embed.rs"]
mod example;

#[test]
fn the_example_runs_from_start_to_stop() {
    example::main().unwrap();
}
