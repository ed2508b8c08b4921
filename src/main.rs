//! The command line; everything it does is in [`rumple::cli`].

fn main() -> std::process::ExitCode {
    rumple::cli::main()
}
