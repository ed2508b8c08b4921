//! The command line; everything it does is in [`rumple::cli`].

fn main() -> std::process::ExitCode {
    rumple::kinetics::serve_if_asked();
    rumple::cli::main()
}
