//! Turns a `[[vpl]]` table into the values that make it up and a hash of them, and a placed VPL into such a table.

use glam::{DVec3, Vec3};
use toml_edit::{Array, Item, Table, TableLike, Value, value};

/// Position and normal of a `[[vpl]]` in the coordinates of the config; the normal of any length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Site {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
}

impl Site {
    /// Where the table says; `None` where it does not.
    pub(super) fn of(table: &dyn TableLike) -> Option<Self> {
        Some(Self { position: vector(table.get("position_m")?)?, normal: vector(table.get("normal")?)? })
    }

    /// Line of the list of what was written.
    pub(super) fn line(&self, hash: &str) -> String {
        let Self { position: p, normal: n } = self;
        format!("{hash} {} {} {} {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z)
    }

    /// Reads such a line.
    pub(super) fn of_line(line: &str) -> Option<(String, Self)> {
        let mut words = line.split_ascii_whitespace();
        let hash = words.next()?.to_owned();
        let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
        let [px, py, pz, nx, ny, nz] = numbers[..] else { return None };
        Some((hash, Self { position: DVec3::new(px, py, pz), normal: DVec3::new(nx, ny, nz) }))
    }
}

/// The key that holds the hash.
pub(super) const HASH: &str = "placed";

/// The hash that the table says was that of its values.
pub(super) fn written_hash(table: &dyn TableLike) -> Option<&str> {
    table.get(HASH)?.as_str()
}

/// The hash of the values that a table has: of all its keys but the hash, whatever their order and the way numbers are
/// written.
pub(super) fn hash(table: &dyn TableLike) -> String {
    let mut keys: Vec<(&str, &Item)> = table.iter().filter(|(key, _)| *key != HASH).collect();
    keys.sort_by_key(|(key, _)| *key);
    let mut hasher = blake3::Hasher::new();
    for (key, item) in keys {
        hasher.update(key.as_bytes());
        match vector(item) {
            // Adding 0 makes one of the two zeros.
            Some(numbers) => numbers.to_array().iter().for_each(|x| {
                hasher.update(&(x + 0.0).to_le_bytes());
            }),
            None => {
                hasher
                    .update(item.as_str().map_or_else(|| item.to_string(), str::to_owned).trim().as_bytes());
            }
        }
        hasher.update(b"\n");
    }
    hasher.finalize().to_hex()[..16].to_owned()
}

/// Three numbers, or one that stands for three.
fn vector(item: &Item) -> Option<DVec3> {
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|x| x as f64));
    let value = item.as_value()?;
    if let Some(one) = number(value) {
        return Some(DVec3::splat(one));
    }
    let numbers: Vec<f64> = value.as_array()?.iter().map_while(number).collect();
    let [x, y, z] = numbers[..] else { return None };
    Some(DVec3::new(x, y, z))
}

/// What is written of a placed VPL.
pub(super) struct Entry<'a> {
    /// In the coordinates of the config, m.
    pub(super) position: DVec3,
    pub(super) normal: Vec3,
    pub(super) albedo: Vec3,
    /// As a multiple of the unit of areas.
    pub(super) weight: Option<f64>,
    /// The object that takes it along.
    pub(super) object: Option<&'a str>,
    /// What it lies on, for people, as a line of TOML.
    pub(super) comment: String,
}

impl Entry<'_> {
    /// The table, with hash and comment; positions have `decimals` decimals.
    pub(super) fn table(&self, decimals: usize) -> Table {
        let mut table = Table::new();
        table.insert("position_m", numbers(self.position, decimals));
        table.insert("normal", numbers(self.normal.as_dvec3(), 3));
        table.insert("albedo", numbers(self.albedo.as_dvec3(), 3));
        if let Some(weight) = self.weight {
            // Three figures.
            let decimals = (2 - weight.abs().log10().floor().clamp(-12.0, 12.0) as i32).clamp(0, 12);
            table.insert("weight", value(rounded(weight, decimals as usize)));
        }
        if let Some(object) = self.object {
            table.insert("object", value(object));
        }
        let hash = hash(&table);
        table.insert(HASH, value(hash));
        table.decor_mut().set_prefix(format!("\n{}\n", self.comment));
        table
    }
}

fn numbers(values: DVec3, decimals: usize) -> Item {
    value(values.to_array().into_iter().map(|x| rounded(x, decimals)).collect::<Array>())
}

/// The number of so many decimals that is nearest; no negative zero.
fn rounded(x: f64, decimals: usize) -> f64 {
    format!("{x:.decimals$}").parse::<f64>().unwrap_or(x) + 0.0
}
