//! Turns the text of an OBJ file into positions, texture coordinates, normals, and faces by group and material.
//!
//! Read here and not by tobj: that checks the numbers of texture coordinates less strictly than those of positions.

use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Name of faces before the first group.
const NO_GROUP: &str = "unnamed_object";

/// What the statements of an OBJ file say.
#[derive(Debug, Default)]
pub(super) struct Statements {
    pub(super) positions: Vec<DVec3>,
    pub(super) uvs: Vec<DVec2>,
    pub(super) normals: Vec<DVec3>,
    /// By group and the name of the material, the empty one where none is named.
    pub(super) faces: BTreeMap<(String, String), Faces>,
    /// Material files, in the order they are named.
    pub(super) libraries: Vec<String>,
    /// Statements that are passed over, with their number.
    pub(super) unread: BTreeMap<String, usize>,
}

/// Polygons of one group and material.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) arities: Vec<u32>,
    /// The smoothing group of each polygon, 0 for none.
    pub(super) smoothing: Vec<u32>,
    /// Position, texture coordinates and normal of each corner; [`NONE`] where it has none.
    pub(super) corners: Vec<[u32; 3]>,
}

pub(super) const NONE: u32 = u32::MAX;

/// Reads the statements of a file.
///
/// # Errors
/// A sentence with the line that is wrong.
///
/// Source: Wavefront, *Advanced Visualizer Manual*, appendix B1: Object Files.
pub(super) fn read(bytes: &[u8]) -> Result<Statements, String> {
    let mut found = Statements::default();
    let (mut group, mut material, mut smoothing) = (NO_GROUP.to_owned(), String::new(), 0);
    let mut lines = bytes.split(|b| *b == b'\n').enumerate();
    while let Some((number, line)) = lines.next() {
        let at = |problem: String| format!("line {}: {problem}", number + 1);
        let mut line = String::from_utf8_lossy(line);
        // A backslash at the end joins lines.
        while line.trim_end().ends_with('\\') {
            let joined = line.trim_end().trim_end_matches('\\').to_owned() + " ";
            line = match lines.next() {
                Some((_, next)) => (joined + &String::from_utf8_lossy(next)).into(),
                None => joined.into(),
            };
        }
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match keyword {
            "" => {}
            comment if comment.starts_with('#') => {}
            "v" => {
                let [x, y, z] = numbers(rest).map_err(at)?;
                found.positions.push(DVec3::new(x, y, z));
            }
            "vt" => {
                // The second number may be missing, and a third is for volumes.
                let mut words = rest.split_whitespace();
                let u = number_of(words.next()).map_err(at)?;
                let v = words.next().map_or(Ok(0.0), |word| number_of(Some(word))).map_err(at)?;
                found.uvs.push(DVec2::new(u, v));
            }
            "vn" => {
                let [x, y, z] = numbers(rest).map_err(at)?;
                found.normals.push(DVec3::new(x, y, z));
            }
            // "off" is 0; some write "on" for one group of all.
            "s" => smoothing = if rest == "on" { 1 } else { rest.parse().unwrap_or(0) },
            "f" | "fo" => {
                let key = (group.clone(), material.clone());
                let counts = [found.positions.len(), found.uvs.len(), found.normals.len()];
                let faces = found.faces.entry(key).or_default();
                let mut arity = 0;
                for word in rest.split_whitespace().take_while(|word| !word.starts_with('#')) {
                    faces.corners.push(corner(word, counts).map_err(at)?);
                    arity += 1;
                }
                faces.arities.push(arity);
                faces.smoothing.push(smoothing);
            }
            "g" | "o" => group = if rest.is_empty() { NO_GROUP.into() } else { rest.to_owned() },
            "usemtl" => material = rest.to_owned(),
            "mtllib" => found.libraries.extend(library_names(rest)),
            // Points and lines have no surface.
            "p" | "l" | "vp" => {}
            other => *found.unread.entry(other.chars().take(20).collect()).or_default() += 1,
        }
    }
    Ok(found)
}

/// The names of a `mtllib` line: several, or one with blanks in it.
fn library_names(rest: &str) -> Vec<String> {
    let several: Vec<_> = rest.split_whitespace().collect();
    if several.len() > 1 && several.iter().all(|name| name.to_ascii_lowercase().ends_with(".mtl")) {
        return several.into_iter().map(str::to_owned).collect();
    }
    vec![rest.to_owned()]
}

fn numbers<const N: usize>(rest: &str) -> Result<[f64; N], String> {
    let mut words = rest.split_whitespace();
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = number_of(words.next())?;
    }
    Ok(numbers)
}

fn number_of(word: Option<&str>) -> Result<f64, String> {
    let word = word.ok_or("a number is missing")?;
    let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("found {:?}, expected a number", word.chars().take(40).collect::<String>()))
}

/// Position, texture coordinates and normal of a corner: `v`, `v/vt`, `v/vt/vn` or `v//vn`, counted from 1, or from the end
/// by negative numbers.
fn corner(word: &str, [positions, uvs, normals]: [usize; 3]) -> Result<[u32; 3], String> {
    let mut parts = word.split('/');
    let position = index(parts.next().unwrap_or_default(), positions, "position")?;
    let mut optional = |count, what| match parts.next() {
        None | Some("") => Ok(NONE),
        Some(part) => index(part, count, what),
    };
    let uv = optional(uvs, "texture coordinate")?;
    Ok([position, uv, optional(normals, "normal")?])
}

fn index(text: &str, count: usize, what: &str) -> Result<u32, String> {
    let short = || text.chars().take(40).collect::<String>();
    let number: i64 =
        text.parse().map_err(|_| format!("found {:?}, expected the number of a {what}", short()))?;
    let index = if number < 0 { count as i64 + number } else { number - 1 };
    let index = u32::try_from(index).ok().filter(|&i| (i as usize) < count && i != NONE);
    index.ok_or_else(|| format!("it names {what} {number}, but there are {count} so far, counted from 1"))
}
