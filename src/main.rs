//! The command line of truegrind: arguments, files and exit codes. All computation is in the library.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
