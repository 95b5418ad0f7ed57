//! The command line of truegrind. All work is in the library; here arguments, files and the exit code.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
