//! `examples/embed.rs` runs and shows one-shot teaching to whoever embeds the service.

#[path = "../examples/embed.rs"]
mod embed;

#[test]
fn the_example_runs_from_start_to_stop() {
    embed::main().unwrap();
}
