//! Turns the computer and the program at hand into what every result names: processor, cores, commit.

use serde::{Deserialize, Serialize};

/// On what something was measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor; `unknown` where the system does not tell.
    pub cpu: String,
    /// Threads it runs at once.
    pub cores: usize,
    /// Commit that the program was built from; `unknown` outside a repository.
    pub commit: String,
}

impl Machine {
    /// The one that this program runs on.
    pub fn here() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        Self {
            cpu: cpu_model(&info).unwrap_or("unknown").to_owned(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            commit: env!("PHOTONSTREAM_COMMIT").to_owned(),
        }
    }
}

fn cpu_model(info: &str) -> Option<&str> {
    let line = info.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(':').map(|(_, model)| model.trim()).filter(|model| !model.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_is_read_from_the_first_processor() {
        let info = "processor\t: 0\nmodel name\t: A 5000 @ 2 GHz\nmodel name\t: other\n";
        assert_eq!(cpu_model(info), Some("A 5000 @ 2 GHz"));
        assert_eq!(cpu_model("model name :\n"), None);
        assert_eq!(cpu_model(""), None);
    }
}
