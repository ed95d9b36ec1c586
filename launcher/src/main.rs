//! Turns the command line into a run of `photonstream`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    photonstream::main()
}
