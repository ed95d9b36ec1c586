//! Turns what a process is for into the command that starts it.

use super::sequence::Sequence;
use crate::{backend::BUILT_IN_RENDERERS, error::LauncherError, owned::OWNED};
use std::{
    ffi::OsString,
    os::unix::process::CommandExt,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// What a process is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Publishes light.
    Simulator,
    /// Makes pictures of it.
    Renderer,
}

/// A process to be started, as often as need be.
#[derive(Clone, Debug)]
pub(crate) struct Role {
    /// What it is called in messages.
    pub(crate) name: String,
    /// What it is for.
    pub(crate) kind: Kind,
    /// The plug-in's file; `None`: this executable.
    pub(crate) plug_in: Option<PathBuf>,
    /// Its arguments, with the subcommand for this executable.
    pub(crate) arguments: Vec<OsString>,
    /// Its pictures, if it can go on with those of an earlier process.
    pub(crate) sequence: Option<Sequence>,
    /// What takes its place where no graphics device can draw.
    pub(crate) stand_in: Option<Box<Role>>,
}

impl Role {
    /// The command that starts it with `more` arguments than its own, and with pipes for all that it says.
    pub(super) fn command(&self, more: &[OsString]) -> Result<Command, LauncherError> {
        let own = std::env::current_exe().map_err(|e| LauncherError::io("find", "this executable", e))?;
        let mut command = Command::new(own);
        if let Some(program) = &self.plug_in {
            // By way of this executable, which sees to it that the plug-in ends with the launcher.
            command.args(["exec", "--parent"]).arg(std::process::id().to_string()).arg("--").arg(program);
        }
        command
            .args(&self.arguments)
            .args(more)
            .env(OWNED, "1")
            // A group of its own: Ctrl-C reaches the launcher alone, which then ends the others in order.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        Ok(command)
    }
}

/// The plug-in `photonstream-renderer-NAME`: beside this executable, else on the PATH.
pub(crate) fn find_plug_in(name: &str) -> Result<PathBuf, LauncherError> {
    let file = format!("photonstream-renderer-{name}");
    let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    let beside = std::env::current_exe().ok().and_then(|exe| exe.parent().map(Path::to_owned));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = beside.into_iter().chain(std::env::split_paths(&path)).collect();
    let found =
        folders.iter().map(|folder| folder.join(&file)).find(|candidate| plain && is_program(candidate));
    found.ok_or_else(|| {
        let mut looked: Vec<String> = Vec::new();
        for folder in &folders {
            let folder = folder.display().to_string();
            if !folder.is_empty() && !looked.contains(&folder) {
                looked.push(folder);
            }
        }
        LauncherError::UnknownRenderer {
            name: name.to_owned(),
            built_in: BUILT_IN_RENDERERS.join(", "),
            file,
            looked: looked.join(", "),
        }
    })
}

fn is_program(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    path.metadata().is_ok_and(|m| m.is_file() && m.permissions().mode() & 0o111 != 0)
}
