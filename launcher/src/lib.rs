//! Turns a command line into processes, pictures and reports: the `photonstream` command.
//!
//! One executable holds all roles. `photonstream run` starts the simulator and each renderer as processes of their own
//! (of the same executable) and watches them; every other subcommand does one task. `cli` lists the subcommands,
//! `commands` has a file for each, `supervise` keeps child processes alive.
#![forbid(unsafe_code)]

mod assignment;
mod backend;
mod cli;
mod commands;
#[cfg(feature = "wgpu")]
mod device;
mod error;
mod exit;
mod follow;
mod log;
mod output;
mod owned;
mod pictures;
mod player;
mod progress;
mod requests;
mod signals;
mod span;
mod supervise;
mod taking;
mod window;

use clap::Parser;
use std::process::ExitCode;

/// Runs the command line of this process to its end.
pub fn main() -> ExitCode {
    let program = cli::Program::parse();
    log::start(&program.global);
    photonstream_scene::kept::use_user_cache();
    match commands::dispatch(program) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            log::report(&error);
            ExitCode::from(code)
        }
    }
}
