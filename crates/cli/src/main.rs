fn main() -> std::process::ExitCode {
    apprentice_cli::main()
}
