//! Turns measurements into rows of a table, and rows into CSV and JSON.

use crate::{EvaluateError, hard_cases::Checked, machine::Machine, motion::MethodLine};
use photonstream_simulator::bench::EventFigures;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One measured point. Keys of CSV and JSON are the fields' names, which carry the units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The sweeps that it belongs to, separated by spaces.
    pub sweeps: String,
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene, 16 hexadecimal digits.
    pub scene_hash: String,
    /// Its config file.
    pub config: String,
    /// Commit that the program was built from.
    pub commit: String,
    /// Model of the processor.
    pub cpu: String,
    /// Threads that the processor runs at once.
    pub cores: usize,
    /// Threads in use.
    pub threads: usize,
    /// Seed of all samples.
    pub seed: u64,
    /// How light is transported.
    pub method: String,
    /// Virtual lights asked for.
    pub vsls: Option<u32>,
    /// Virtual lights that were placed.
    pub vsls_placed: Option<usize>,
    /// Slots of the path pool.
    pub pool_paths: Option<u32>,
    /// How flux falls off.
    pub kernel: Option<String>,
    /// Shadows of indirect light.
    pub visibility: Option<String>,
    /// Which sample a slot takes when it is traced again.
    pub sampling: Option<String>,
    /// Shadow rays per pixel and area light.
    pub light_samples: Option<u32>,
    /// How a graphics device sums lights.
    pub accumulation: Option<String>,
    /// Edge of its pattern of interleaved sampling.
    pub interleave: Option<u32>,
    /// The graphics device.
    pub adapter: Option<String>,
    /// Paths per pixel.
    pub spp: Option<u64>,
    /// Width of the picture.
    pub width_px: u32,
    /// Height of the picture.
    pub height_px: u32,
    /// Time to place the lights, once for a scene.
    pub place_ms: f64,
    /// Time to trace the light: a whole pool.
    pub light_ms: f64,
    /// Time to render the picture.
    pub picture_ms: f64,
    /// Light and picture.
    pub total_ms: f64,
    /// Runs of which the time is the median.
    pub runs: usize,
    /// Relative RMSE of the full picture.
    pub rel_rmse: f64,
    /// Relative RMSE of the indirect light.
    pub rel_rmse_indirect: f64,
    /// Relative MSE of the full picture.
    pub rel_mse: f64,
    /// Signed relative error of the mean of the full picture.
    pub bias: f64,
    /// The same of the indirect light.
    pub bias_indirect: f64,
    /// Mean of the largest 1 % of the errors of the full picture over its mean.
    pub worst_1pct: f64,
    /// Mean FLIP of the full picture as a display shows it.
    pub flip: f64,
    /// Paths per pixel of the reference.
    pub reference_spp: u64,
    /// Relative RMSE of the reference itself, from noise.
    pub reference_noise: f64,
    /// The same of its indirect light.
    pub reference_noise_indirect: f64,
    /// Whether the error of the full picture is less than √2 times the reference's noise: then it is mostly that.
    pub at_noise_floor: bool,
    /// What measures this row again.
    pub command: String,
}

/// Mean squared errors of indirect light over the squared mean of the reference, by what causes them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// Name of the scene.
    pub scene: String,
    /// How flux falls off.
    pub kernel: String,
    /// Shadows of indirect light.
    pub visibility: String,
    /// Virtual surface lights.
    pub vsls: u32,
    /// Slots of the path pool.
    pub pool_paths: u32,
    /// Virtual surface lights of the limit.
    pub many_vsls: u32,
    /// The whole error, noise of the reference taken off.
    pub total: f64,
    /// Noise of the streamed light.
    pub variance: f64,
    /// Missing or approximate shadows.
    pub visibility_part: f64,
    /// Too few lights.
    pub discretisation: f64,
    /// What many lights with true shadows still have: the kernel, and whatever else does not vanish.
    pub bias: f64,
    /// Products of the parts, which may be negative: the whole is the sum of all.
    pub mixed: f64,
    /// What a moved object leaves of the old light after `staleness_after_ms`; `None` where the scene has nothing to move.
    pub staleness: Option<f64>,
    /// Time since the object moved.
    pub staleness_after_ms: f64,
}

/// A step change of a running simulation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepChange {
    /// Name of the scene.
    pub scene: String,
    /// What it took.
    #[serde(flatten)]
    pub figures: EventFigures,
    /// What a full trace of the pool takes, ms: every change without selective tracing.
    pub full_trace_ms: f64,
}

/// What was left out, and why.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Skipped {
    /// What.
    pub what: String,
    /// Why.
    pub why: String,
}

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// On what.
    pub machine: Machine,
    /// Whether everything that was asked for is in it.
    pub complete: bool,
    /// What measures all of it again.
    pub command: String,
    /// The graphics device, if there is one.
    pub adapter: Option<String>,
    /// Seconds it took.
    pub seconds: f64,
    /// All points of all scenes.
    pub rows: Vec<Row>,
    /// What causes the errors.
    pub splits: Vec<Split>,
    /// How fast light follows changes.
    pub changes: Vec<StepChange>,
    /// The simulator's methods, a line each.
    pub methods: Vec<MethodLine>,
    /// Hard cases that were run here.
    pub hard_cases: Vec<Checked>,
    /// What was left out.
    pub skipped: Vec<Skipped>,
}

impl Results {
    /// Nothing yet; `command` is what measures it.
    pub fn new(machine: Machine, command: String) -> Self {
        Self {
            machine,
            complete: false,
            command,
            adapter: None,
            seconds: 0.0,
            rows: Vec::new(),
            splits: Vec::new(),
            changes: Vec::new(),
            methods: Vec::new(),
            hard_cases: Vec::new(),
            skipped: Vec::new(),
        }
    }

    /// Writes `results.csv` (the rows) and `results.json` (everything) into `folder`.
    ///
    /// # Errors
    /// [`EvaluateError::Write`].
    pub fn write(&self, folder: &Path) -> Result<(), EvaluateError> {
        let path = folder.join("results.csv");
        std::fs::write(&path, csv(&self.rows)?).map_err(|e| EvaluateError::write(&path, e))?;
        let path = folder.join("results.json");
        let json = serde_json::to_vec_pretty(self).map_err(|e| EvaluateError::write(&path, e))?;
        std::fs::write(&path, json).map_err(|e| EvaluateError::write(&path, e))
    }
}

/// Rows as CSV, a line of names first.
///
/// # Errors
/// [`EvaluateError::Draw`] if a row cannot be serialised.
pub fn csv(rows: &[Row]) -> Result<Vec<u8>, EvaluateError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(|e| EvaluateError::draw("results.csv", e))?;
    }
    writer.into_inner().map_err(|e| EvaluateError::draw("results.csv", e))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn row(method: &str, total_ms: f64, rel_rmse: f64) -> Row {
        Row {
            sweeps: "time".into(),
            scene: "A \"quoted\", <scene>".into(),
            scene_hash: "00ff".into(),
            config: "a,b.toml".into(),
            commit: "abc".into(),
            cpu: "cpu".into(),
            cores: 2,
            threads: 2,
            seed: 1,
            method: method.into(),
            vsls: Some(100),
            vsls_placed: Some(99),
            pool_paths: Some(4096),
            kernel: Some("disc".into()),
            visibility: Some("rays".into()),
            sampling: None,
            light_samples: Some(16),
            accumulation: None,
            interleave: None,
            adapter: None,
            spp: None,
            width_px: 8,
            height_px: 6,
            place_ms: 1.0,
            light_ms: 0.25 * total_ms,
            picture_ms: 0.75 * total_ms,
            total_ms,
            runs: 1,
            rel_rmse,
            rel_rmse_indirect: 2.0 * rel_rmse,
            rel_mse: rel_rmse * rel_rmse,
            bias: -0.01,
            bias_indirect: 0.02,
            worst_1pct: 0.5,
            flip: 0.1,
            reference_spp: 64,
            reference_noise: 0.01,
            reference_noise_indirect: 0.02,
            at_noise_floor: false,
            command: "photonstream evaluate 'a,b.toml'".into(),
        }
    }

    #[test]
    fn csv_and_json_have_the_same_rows() {
        let folder = tempfile::tempdir().unwrap();
        let mut results = Results::new(Machine::here(), "photonstream evaluate a.toml".into());
        results.rows = vec![row("photon-streaming", 12.5, 0.1), row("path-tracing", 1e4, 0.375)];
        results.rows[1].vsls = None;
        results.write(folder.path()).unwrap();
        let mut reader = csv::Reader::from_path(folder.path().join("results.csv")).unwrap();
        let from_csv: Vec<Row> = reader.deserialize().map(Result::unwrap).collect();
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("results.json")).unwrap()).unwrap();
        let from_json: Vec<Row> = serde_json::from_value(json["rows"].clone()).unwrap();
        assert_eq!(from_csv, results.rows);
        assert_eq!(from_json, results.rows);
        assert_eq!(json["complete"], false);
    }
}
