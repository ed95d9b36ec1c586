//! Turns the command line into a subcommand and the options that all of them share.

use crate::commands::*;
use clap::{ArgAction, Args, Parser, Subcommand};

/// Dynamic global illumination, simulated once and shown anywhere
///
/// A simulator process streams photons through a scene and publishes the light that leaves its surfaces; any number of
/// renderer processes make pictures of it. Without a command the built-in Cornell box is simulated and shown in a
/// window; without a display or a graphics adapter its picture is written to out/.
#[derive(Parser)]
#[command(name = "photonstream", version, after_help = AFTER_HELP, after_long_help = AFTER_HELP)]
pub(crate) struct Program {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    /// For all commands.
    #[command(flatten)]
    pub(crate) global: Global,
}

/// Examples and exit codes.
pub(crate) const AFTER_HELP: &str = "\
Examples:
  photonstream                                       the built-in scene in a window, or a picture in out/
  photonstream render room.toml --out room.png       a picture of a scene
  photonstream run model.glb                         a model without a scene file: glTF, OBJ or PLY
  photonstream run room.toml --frames 20 --out film  pictures while the light settles
  photonstream check room.toml                       is the scene valid, and what will be modelled?

Environment:
  PHOTONSTREAM_SCENES  folder in which scene files' models are looked for
  PHOTONSTREAM_CACHE   folder for references and for what large models need, or \"off\"
                       [default: $XDG_CACHE_HOME/photonstream or ~/.cache/photonstream]

Exit codes:
  0    done
  1    failed: a file, shared memory, a picture
  2    the command line makes no sense
  3    the scene is not valid or cannot be read
  4    the channel is in use, or does not exist
  5    a process that was started failed for good
  6    no graphics device can draw it
  130  interrupted by a signal before the end";

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub(crate) struct Global {
    /// Say more on stderr (twice: much more); RUST_LOG overrides
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub(crate) verbose: u8,
    /// Say less on stderr (twice: errors only)
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub(crate) quiet: u8,
    /// Write the result as one JSON object on stdout
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// The subcommands.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Simulate a scene and render it, each in a process of its own, watched and restarted
    Run(run::Args),
    /// Simulate a scene and publish its light until ended
    Simulate(simulate::Args),
    /// Make one picture of a scene, or of a running simulation
    Render(render::Args),
    /// Show a running simulation in a window
    #[cfg(feature = "window")]
    View(view::Args),
    /// Path-trace the true picture of a scene
    Reference(reference::Args),
    /// Say how far a picture is from another
    Compare(compare::Args),
    /// Measure speed against error of scenes, and make a page of it
    Evaluate(evaluate::Args),
    /// Write a scene for another renderer: Mitsuba 3
    Export(export::Args),
    /// Show what a running simulation does
    Inspect(inspect::Args),
    /// Change a running simulation: lights, objects, materials, time
    Set(set::Args),
    /// Record the frames of a running simulation
    Record(record::Args),
    /// Publish the frames of a recording again
    Replay(replay::Args),
    /// Write the scene file that a model without one is shown with, to be edited
    Config(config::Args),
    /// Place static virtual point lights in a scene, and write it as a scene file to be edited
    Place(place::Args),
    /// Validate a scene and say what will be modelled, and why
    Check(check::Args),
    /// List what is running, and what a crash left
    Channels(channels::Args),
    /// Remove what a crash left; running simulations are not touched
    Clean(clean::Args),
    /// Measure how fast a scene is simulated
    Bench(bench::Args),
    /// Attach a renderer to a channel: what `run` starts
    #[command(hide = true)]
    Renderer(renderer::Args),
    /// Become a plug-in that ends with the launcher: what `run` starts
    #[command(hide = true)]
    Exec(renderer::ExecArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Program::command().debug_assert();
    }
}
