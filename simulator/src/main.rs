//! The simulator as a program of its own: `photonstream-simulator CONFIG`.
#![forbid(unsafe_code)]

use clap::Parser;
use photonstream_simulator::cli;
use std::process::ExitCode;

/// Streams photons through a scene and publishes its virtual surface lights over shared memory.
#[derive(Parser)]
#[command(name = "photonstream-simulator", version, about)]
struct Program {
    #[command(flatten)]
    args: cli::Args,
}

fn main() -> ExitCode {
    let program = Program::parse();
    tracing_subscriber::fmt().with_writer(std::io::stderr).init();
    photonstream_scene::kept::use_user_cache();
    match cli::run(&program.args) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}
