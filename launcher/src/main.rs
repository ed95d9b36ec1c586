//! Turns the command line into a run of `photonstream`.

use std::process::ExitCode;

fn main() -> ExitCode {
    photonstream::main()
}
