//! Turns the remade tables into Markdown, one table for each of the paper's.

use super::{PaperTables, PictureRow, SceneRow};
use std::fmt::{Display, Formatter, Result};

impl Display for PaperTables {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let device = match (&self.adapter, &self.without_adapter) {
            (Some(adapter), _) => adapter.clone(),
            (None, why) => format!("no graphics device ({})", why.as_deref().unwrap_or("none was asked for")),
        };
        let (width, height) = self.error_size;
        writeln!(
            f,
            "{} cores of {}; {device}; {:.0} s\n",
            self.machine.cores, self.machine.cpu, self.seconds
        )?;
        writeln!(f, "### Table 1: scenes\n")?;
        writeln!(
            f,
            "| scene | polygons, paper | here | vertices, paper | here | the scene here |\n|---|---|---|---|---|---|"
        )?;
        for row in &self.scenes {
            let SceneRow { scene, paper_polygons, paper_vertices, triangles, vertices, differs, .. } = row;
            writeln!(
                f,
                "| {scene} | {paper_polygons} | {triangles} | {paper_vertices} | {vertices} | {differs} |"
            )?;
        }
        let mut sizes: Vec<_> = self.pictures.iter().map(|row| (row.width, row.height)).collect();
        sizes.dedup();
        sizes.sort();
        sizes.dedup();
        for (number, size) in (2..).zip(sizes) {
            let rows: Vec<_> = self.pictures.iter().filter(|row| (row.width, row.height) == size).collect();
            writeln!(f, "\n### Table {number}: pictures a second, {} x {} pixels\n", size.0, size.1)?;
            pictures(f, &rows)?;
        }
        let noise = self.scenes.iter().map(|row| row.reference_noise).fold(0.0, f64::max);
        writeln!(
            f,
            "\nErrors are relative RMSE of the full picture of {width} x {height} pixels against {} paths a pixel, whose own noise \
             of up to {:.1} % is in them: with kernel `paper` and without shadows of the lights, as it is timed, and with kernel \
             `patch` and visibility `octahedral`. The paper gives none.",
            self.reference_spp,
            noise * 100.0
        )?;
        self.skipped
            .iter()
            .try_for_each(|skipped| writeln!(f, "\nLeft out: {}: {}", skipped.scene, skipped.why))
    }
}

fn pictures(f: &mut Formatter<'_>, rows: &[&PictureRow]) -> Result {
    let ways: Vec<&str> =
        rows.first().map_or(Vec::new(), |row| row.per_s.iter().map(|(way, _)| way.as_str()).collect());
    write!(f, "| scene | VSLs | paper: deferred | whole geometry |")?;
    for (index, way) in ways.iter().enumerate() {
        write!(f, " {}{way} |", if index == 0 { "here: " } else { "" })?;
    }
    writeln!(f, " error, `paper` | error, `octahedral` |")?;
    writeln!(f, "|---|---|---|---|{}---|---|", "---|".repeat(ways.len()))?;
    for row in rows {
        let PictureRow { scene, vsls, paper_deferred_per_s, paper_whole_per_s, .. } = row;
        write!(f, "| {scene} | {vsls} | {paper_deferred_per_s} | {paper_whole_per_s} |")?;
        row.per_s.iter().try_for_each(|(_, per_s)| write!(f, " {per_s:.2} |"))?;
        let percent = |error: f64| format!("{:.1} %", error * 100.0);
        writeln!(f, " {} | {} |", percent(row.rel_rmse_paper), percent(row.rel_rmse_octahedral))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{Skipped, published::SCENES};
    use super::*;
    use crate::machine::Machine;

    #[test]
    fn each_table_is_one_of_markdown() {
        let picture = |width, height, per_s| PictureRow {
            scene: "Cornell Box",
            width,
            height,
            vsls: 10,
            paper_deferred_per_s: 140,
            paper_whole_per_s: 195,
            per_s: vec![("tiled".into(), per_s), ("forward".into(), 0.5)],
            rel_rmse_paper: 0.25,
            rel_rmse_octahedral: 0.05,
        };
        let tables = PaperTables {
            machine: Machine { cpu: "A".into(), cores: 2, commit: "c".into() },
            adapter: None,
            without_adapter: Some("none here".into()),
            seconds: 1.0,
            error_size: (16, 12),
            reference_spp: 64,
            scenes: vec![SceneRow {
                scene: "Cornell Box",
                paper_polygons: SCENES[0].polygons.0,
                paper_vertices: SCENES[0].polygons.1,
                triangles: 2006,
                vertices: 1022,
                differs: "ours",
                reference_noise: 0.01,
            }],
            pictures: vec![picture(800, 600, 12.345), picture(1280, 1024, 4.0)],
            skipped: vec![Skipped { scene: "Dragon", why: "no file".into() }],
        };
        let text = tables.to_string();
        for line in [
            "2 cores of A; no graphics device (none here); 1 s",
            "| Cornell Box | 2006 | 2006 | 1042 | 1022 | ours |",
            "### Table 2: pictures a second, 800 x 600 pixels",
            "| scene | VSLs | paper: deferred | whole geometry | here: tiled | forward | error, `paper` | error, `octahedral` |",
            "| Cornell Box | 10 | 140 | 195 | 12.35 | 0.50 | 25.0 % | 5.0 % |",
            "### Table 3: pictures a second, 1280 x 1024 pixels",
            "Left out: Dragon: no file",
        ] {
            assert!(text.lines().any(|found| found == line), "no {line:?} in\n{text}");
        }
        // As many columns in each row as in its head.
        let mut columns = 0;
        for line in text.lines() {
            let found = line.matches('|').count();
            assert!(found == 0 || columns == 0 || found == columns, "{line}");
            columns = found;
        }
    }
}
