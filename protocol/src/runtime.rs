//! Turns a channel's name into its private folder, and refuses folders and files that others could have written.

use std::fmt;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use rustix::fs::OFlags;
use rustix::process::geteuid;
use serde::{Deserialize, Serialize};

use crate::error::ProtocolError;

/// Environment variable that names the folder of all channels.
const ROOT_VARIABLE: &str = "PHOTONSTREAM_RUNTIME_DIR";
/// Greatest size of any small file here, in bytes.
const SMALL_FILE: u64 = 512;

/// A channel's name: 1 to 32 of `a-z`, `0-9` and `-`, not starting with `-`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ChannelName(String);

impl ChannelName {
    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for ChannelName {
    fn default() -> Self {
        Self("default".to_owned())
    }
}

impl fmt::Display for ChannelName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

impl FromStr for ChannelName {
    type Err = ProtocolError;

    fn from_str(text: &str) -> Result<Self, ProtocolError> {
        let allowed = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
        if (1..=32).contains(&text.len()) && text.bytes().all(allowed) && !text.starts_with('-') {
            Ok(Self(text.to_owned()))
        } else {
            Err(ProtocolError::InvalidName { found: text.to_owned() })
        }
    }
}

/// The folder that holds one folder per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Runtime {
    root: PathBuf,
}

impl Runtime {
    /// `$PHOTONSTREAM_RUNTIME_DIR`, else `$XDG_RUNTIME_DIR/photonstream`, else `photonstream-UID` under the
    /// system's temporary folder.
    pub fn from_env() -> Self {
        let absolute = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        if let Some(root) = absolute(ROOT_VARIABLE) {
            return Self { root };
        }
        if let Some(base) = absolute("XDG_RUNTIME_DIR").filter(|base| base.is_dir()) {
            return Self { root: base.join("photonstream") };
        }
        Self { root: std::env::temp_dir().join(format!("photonstream-{}", geteuid().as_raw())) }
    }

    /// A folder of the caller's choice, for tests and containers.
    pub fn at(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// The folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Names of all channels that have a folder, sorted; empty where the root does not exist.
    pub(crate) fn channel_names(&self) -> Result<Vec<ChannelName>, ProtocolError> {
        let entries = match std::fs::read_dir(&self.root) {
            Ok(entries) => entries,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(ProtocolError::io("list", &self.root, error)),
        };
        check_folder(&self.root, 0o022)?;
        let mut names: Vec<ChannelName> =
            entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok()).collect();
        names.sort();
        Ok(names)
    }

    /// An existing channel's folder, checked.
    pub(crate) fn open_channel(&self, channel: &ChannelName) -> Result<ChannelDir, ProtocolError> {
        let dir = ChannelDir { path: self.root.join(channel.as_str()), channel: channel.clone() };
        match check_folder(&self.root, 0o022).and_then(|()| check_folder(&dir.path, 0o077)) {
            Ok(()) => Ok(dir),
            Err(ProtocolError::Io { source, .. }) if source.kind() == ErrorKind::NotFound => {
                Err(dir.not_created("current"))
            }
            Err(error) => Err(error),
        }
    }

    /// A channel's folder, created where it is missing, checked.
    pub(crate) fn create_channel(&self, channel: &ChannelName) -> Result<ChannelDir, ProtocolError> {
        let dir = ChannelDir { path: self.root.join(channel.as_str()), channel: channel.clone() };
        let mut builder = DirBuilder::new();
        builder.recursive(true).mode(0o700);
        builder.create(&dir.path).map_err(|e| ProtocolError::io("create folder", &dir.path, e))?;
        check_folder(&self.root, 0o022)?;
        check_folder(&dir.path, 0o077)?;
        Ok(dir)
    }
}

/// Requires a real folder of ours without the forbidden permission bits.
fn check_folder(path: &Path, forbidden: u32) -> Result<(), ProtocolError> {
    let metadata = std::fs::symlink_metadata(path).map_err(|e| ProtocolError::io("look at", path, e))?;
    check_file(path, &metadata, metadata.is_dir(), "a folder", forbidden)
}

/// Requires the right type, our user as owner, and none of the forbidden permission bits.
pub(crate) fn check_file(
    path: &Path,
    metadata: &std::fs::Metadata,
    right_type: bool,
    expected_type: &str,
    forbidden: u32,
) -> Result<(), ProtocolError> {
    let insecure = |field, found, expected| {
        Err(ProtocolError::Insecure { path: path.to_owned(), field, found, expected })
    };
    if !right_type {
        let kind = metadata.file_type();
        let found = match () {
            () if kind.is_symlink() => "a symbolic link",
            () if kind.is_dir() => "a folder",
            () if kind.is_fifo() => "a FIFO",
            () if kind.is_file() => "a regular file",
            () => "a special file",
        };
        return insecure("type", found.to_owned(), expected_type.to_owned());
    }
    let user = geteuid().as_raw();
    if metadata.uid() != user {
        return insecure("owner", format!("user {}", metadata.uid()), format!("user {user}"));
    }
    if metadata.mode() & forbidden != 0 {
        let mode = metadata.mode() & 0o777;
        return insecure("mode", format!("{mode:04o}"), format!("{:04o}", mode & !forbidden));
    }
    Ok(())
}

/// Content of the pointer file `current`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Current {
    pub(crate) abi: u64,
    pub(crate) segment: String,
    pub(crate) epoch: u64,
    pub(crate) bytes: u64,
    pub(crate) pid: u32,
    pub(crate) start_time: u64,
}

/// A channel's private folder.
#[derive(Debug, Clone)]
pub(crate) struct ChannelDir {
    pub(crate) path: PathBuf,
    pub(crate) channel: ChannelName,
}

impl ChannelDir {
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    pub(crate) fn not_created(&self, name: &str) -> ProtocolError {
        ProtocolError::NotCreated { channel: self.channel.to_string(), path: self.file(name) }
    }

    /// The segment readers should use.
    pub(crate) fn current(&self) -> Result<Current, ProtocolError> {
        let text = self.read_small("current")?.ok_or_else(|| self.not_created("current"))?;
        toml::from_str(&text).map_err(|error| {
            let field = self.file("current").display().to_string();
            ProtocolError::corrupt(
                field,
                error.message(),
                "TOML with abi, segment, epoch, bytes, pid, start_time",
            )
        })
    }

    /// Text of a small file of ours; `None` where there is none.
    pub(crate) fn read_small(&self, name: &str) -> Result<Option<String>, ProtocolError> {
        let path = self.file(name);
        let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
        let file = match OpenOptions::new().read(true).custom_flags(flags).open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => {
                if let Ok(metadata) = std::fs::symlink_metadata(&path) {
                    check_file(&path, &metadata, metadata.is_file(), "a regular file", 0o077)?;
                }
                return Err(ProtocolError::io("open", path, error));
            }
        };
        let metadata = file.metadata().map_err(|e| ProtocolError::io("look at", &path, e))?;
        check_file(&path, &metadata, metadata.is_file(), "a regular file", 0o077)?;
        if metadata.len() > SMALL_FILE {
            let expected = format!("at most {SMALL_FILE}");
            return Err(ProtocolError::corrupt(
                format!("{} length", path.display()),
                metadata.len(),
                expected,
            ));
        }
        let mut bytes = Vec::new();
        file.take(SMALL_FILE).read_to_end(&mut bytes).map_err(|e| ProtocolError::io("read", &path, e))?;
        Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
    }

    /// Replaces a small file in one step.
    pub(crate) fn replace_small(&self, name: &str, text: &str) -> Result<(), ProtocolError> {
        let path = self.file(name);
        let new = self.file(&format!("{name}.new"));
        let written = create_private(&new).and_then(|mut file| {
            file.set_len(0)?;
            file.write_all(text.as_bytes())
        });
        written
            .and_then(|()| std::fs::rename(&new, &path))
            .map_err(|error| ProtocolError::io("write", path, error))
    }

    /// Removes a file; one that is missing is fine.
    pub(crate) fn remove(&self, name: &str) -> Result<bool, ProtocolError> {
        match std::fs::remove_file(self.file(name)) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
            Err(error) => Err(ProtocolError::io("remove", self.file(name), error)),
        }
    }
}

/// Opens a file for reading and writing, created 0600 where it is missing; follows no symbolic link.
pub(crate) fn create_private(path: &Path) -> std::io::Result<File> {
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
    OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .custom_flags(flags)
        .open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_checked() {
        let longest = "a".repeat(32);
        for good in ["default", "a", "0-b", &longest] {
            assert_eq!(good.parse::<ChannelName>().unwrap().to_string(), good);
        }
        let too_long = "a".repeat(33);
        for bad in ["", "-a", "A", "a b", "../x", "a/b", "ä", "a.b", &too_long] {
            assert!(matches!(bad.parse::<ChannelName>(), Err(ProtocolError::InvalidName { .. })), "{bad}");
        }
    }

    #[test]
    fn folders_others_could_write_are_refused() {
        use std::os::unix::fs::PermissionsExt;
        let root = tempfile::tempdir().unwrap();
        let runtime = Runtime::at(root.path().join("run"));
        let name = ChannelName::default();
        assert!(matches!(runtime.open_channel(&name), Err(ProtocolError::NotCreated { .. })));
        let dir = runtime.create_channel(&name).unwrap();
        std::fs::set_permissions(&dir.path, PermissionsExt::from_mode(0o750)).unwrap();
        assert!(matches!(runtime.open_channel(&name), Err(ProtocolError::Insecure { field: "mode", .. })));
        std::fs::remove_dir(&dir.path).unwrap();
        std::os::unix::fs::symlink(root.path(), &dir.path).unwrap();
        assert!(matches!(runtime.open_channel(&name), Err(ProtocolError::Insecure { field: "type", .. })));
        assert!(matches!(runtime.create_channel(&name), Err(ProtocolError::Insecure { field: "type", .. })));
    }
}
