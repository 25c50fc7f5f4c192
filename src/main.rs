fn main() -> std::process::ExitCode {
    apprentice::cli::main()
}
