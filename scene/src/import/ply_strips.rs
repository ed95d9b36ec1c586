//! Turns the triangle strips of a PLY file into triangles.

use super::ply::is_corner_list;
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

/// Ends one strip and begins the next.
const RESTART: i64 = -1;

/// The corners of strips, one after another, or what is wrong with them.
pub(super) struct Strips(pub(super) Result<Vec<i64>, String>);

impl PropertyAccess for Strips {
    fn new() -> Self {
        Self(Ok(Vec::new()))
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !is_corner_list(name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = match property {
            Property::ListChar(list) => Ok(list.into_iter().map(i64::from).collect()),
            Property::ListUChar(list) => Ok(list.into_iter().map(i64::from).collect()),
            Property::ListShort(list) => Ok(list.into_iter().map(i64::from).collect()),
            Property::ListUShort(list) => Ok(list.into_iter().map(i64::from).collect()),
            Property::ListInt(list) => Ok(list.into_iter().map(i64::from).collect()),
            Property::ListUInt(list) => Ok(list.into_iter().map(i64::from).collect()),
            _ => Err("corners have to be whole numbers".to_owned()),
        };
        PropertyAccessResult::Set
    }
}

/// The triangles of `corners`: each corner makes one with the two before it, every second one turned so that all look the
/// same way. Triangles with a corner twice only turn the strip, and are left out.
///
/// # Errors
/// If a corner is no number of a vertex.
///
/// Source: the Stanford 3D Scanning Repository's `tristrips`.
pub(super) fn triangles(corners: &[i64]) -> Result<Vec<[u32; 3]>, String> {
    let mut found = Vec::new();
    for strip in corners.split(|corner| *corner == RESTART) {
        for (number, three) in strip.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1 + number % 2], three[2 - number % 2]];
            if a == b || b == c || c == a {
                continue;
            }
            let corner = |i: i64| {
                u32::try_from(i).map_err(|_| format!("found corner {i}, expected a number from 0, or -1"))
            };
            found.push([corner(a)?, corner(b)?, corner(c)?]);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn strips_turn_begin_again_and_may_be_empty() {
        let found = triangles(&[0, 1, 2, 3, 3, 4, -1, 5, 6, -1, -1, 7, 8, 9, 10]).unwrap();
        // The one with 3 twice counts as a turn.
        assert_eq!(found, [[0, 1, 2], [1, 3, 2], [7, 8, 9], [8, 10, 9]]);
        assert!(triangles(&[]).unwrap().is_empty());
        assert!(triangles(&[0, 1, -2]).unwrap_err().contains("found corner -2"));
    }
}
