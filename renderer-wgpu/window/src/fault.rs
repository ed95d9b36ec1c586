//! Turns a hidden option into one fault of device or surface, so that recovery is tested where no driver fails by itself.

use std::str::FromStr;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The device is destroyed.
    Device,
    /// The surface says that it is lost.
    Surface,
    /// The surface says that it no longer fits the window.
    Outdated,
    /// The surface gives no texture in time.
    Timeout,
    /// The system suspends the program and resumes it.
    Suspend,
}

/// One fault, at its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// After so many pictures.
    pub after: u64,
}

const KINDS: [(&str, FaultKind); 5] = [
    ("device", FaultKind::Device),
    ("surface", FaultKind::Surface),
    ("outdated", FaultKind::Outdated),
    ("timeout", FaultKind::Timeout),
    ("suspend", FaultKind::Suspend),
];

impl FromStr for Fault {
    type Err = String;

    /// Reads `KIND@PICTURES`, such as `device@3`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('@').and_then(|(kind, after)| {
            let (_, kind) = KINDS.into_iter().find(|(name, _)| *name == kind)?;
            Some(Self { kind, after: after.parse().ok()? })
        });
        let names = || KINDS.map(|(name, _)| name).join(", ");
        parsed.ok_or_else(|| format!("expected one of {} with @ and a number of pictures", names()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_and_others_refused() {
        for (name, kind) in KINDS {
            assert_eq!(format!("{name}@7").parse(), Ok(Fault { kind, after: 7 }));
        }
        for text in ["device", "device@", "device@-1", "fire@3", "@3"] {
            let error = text.parse::<Fault>().unwrap_err();
            assert!(error.contains("outdated"), "{text}: {error}");
        }
    }
}
