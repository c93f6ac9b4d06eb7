//! The `avastra` command.

fn main() -> std::process::ExitCode {
    avastra::cli::main()
}
