//! Turns a parsed command line into the one task it asks for; each subcommand has a file here.

pub(crate) mod bench;
pub(crate) mod channels;
pub(crate) mod check;
pub(crate) mod clean;
pub(crate) mod compare;
pub(crate) mod config;
pub(crate) mod default_run;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod inspect;
pub(crate) mod place;
pub(crate) mod record;
pub(crate) mod reference;
pub(crate) mod render;
pub(crate) mod renderer;
pub(crate) mod replay;
pub(crate) mod run;
pub(crate) mod set;
pub(crate) mod simulate;
#[cfg(feature = "window")]
pub(crate) mod view;

use crate::{
    cli::{Command, Program},
    error::LauncherError,
};

/// Does what the command line asks for.
///
/// # Errors
/// Whatever kept it from being done.
pub(crate) fn dispatch(program: Program) -> Result<(), LauncherError> {
    let global = &program.global;
    match program.command {
        None => default_run::run(global),
        Some(Command::Run(args)) => run::run(&args, global),
        Some(Command::Simulate(args)) => simulate::run(&args, global),
        #[cfg(feature = "window")]
        Some(Command::View(args)) => view::run(&args, global),
        Some(Command::Render(args)) => render::run(&args, global),
        Some(Command::Reference(args)) => reference::run(&args, global),
        Some(Command::Compare(args)) => compare::run(&args, global),
        Some(Command::Export(args)) => export::run(&args, global),
        Some(Command::Evaluate(args)) => evaluate::run(&args, global),
        Some(Command::Inspect(args)) => inspect::run(&args, global),
        Some(Command::Record(args)) => record::run(&args, global),
        Some(Command::Replay(args)) => replay::run(&args, global),
        Some(Command::Set(args)) => set::run(&args, global),
        Some(Command::Config(args)) => config::run(&args, global),
        Some(Command::Place(args)) => place::run(&args, global),
        Some(Command::Check(args)) => check::run(&args, global),
        Some(Command::Channels(args)) => channels::run(&args, global),
        Some(Command::Clean(args)) => clean::run(&args, global),
        Some(Command::Bench(args)) => bench::run(&args, global),
        Some(Command::Renderer(args)) => renderer::run(&args, global),
        Some(Command::Exec(args)) => renderer::exec(&args),
    }
}
