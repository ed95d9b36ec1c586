//! Turns a PLY file into a mesh: positions and polygons, in text or binary of either byte order.

use super::{
    Frame, Group, MAX_TRIANGLES,
    ply_strips::{self, Strips},
    polygons::push_polygon,
    unit,
};
use crate::primitives::Mesh;
use glam::DVec3;
use ply_rs_bw::{
    parser::{ParseError, Parser, Reader},
    ply::{
        ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
        ScalarType,
    },
};
use std::io::BufRead;

/// Reads the faces and triangle strips of a PLY file. Properties other than `x`, `y`, `z`, `nx`, `ny`, `nz` and
/// `vertex_indices` (or `vertex_index`) are passed over.
///
/// What is allocated is bounded by the length of `bytes`, whatever counts they name.
///
/// # Errors
/// A sentence on what is wrong with them.
///
/// Source: G. Turk, *The PLY Polygon File Format*, 1994.
pub(crate) fn read_ply(bytes: &[u8], frame: Frame) -> Result<Mesh, String> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(|e| not_valid(&e))?;
    let rest = reader.into_inner();
    check_counts(&header, rest.len())?;
    for (name, property) in [("vertex", "x"), ("vertex", "y"), ("vertex", "z")] {
        let element = header.elements.get(name).ok_or("it has no element \"vertex\"")?;
        match element.properties.get(property).map(|p| &p.data_type) {
            Some(PropertyType::Scalar(_)) => {}
            _ => return Err(format!("element \"vertex\" has no number \"{property}\"")),
        }
    }
    let has_corners = |element: &ElementDef| {
        let properties = &mut element.properties.iter();
        properties.any(|(name, p)| is_corner_list(name) && matches!(p.data_type, PropertyType::List(..)))
    };
    if !["face", "tristrips"].iter().filter_map(|name| header.elements.get(*name)).any(has_corners) {
        return Err("it has no element \"face\" or \"tristrips\" with a list \"vertex_indices\"".into());
    }
    let has_normals = header
        .elements
        .get("vertex")
        .is_some_and(|vertex| NORMALS.iter().all(|n| vertex.properties.contains_key(*n)));
    let mut payload = Payload { rest, encoding: header.encoding };
    let mut mesh = Group::default();
    let (mut corners, mut arities) = (Vec::new(), Vec::new());
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => payload.each(element, |vertex: Vertex| {
                mesh.mesh.vertices.push(frame.apply(vertex.position));
                if has_normals {
                    mesh.mesh.normals.push(unit(frame.turn(vertex.normal)));
                }
                Ok(())
            })?,
            "face" => payload.each(element, |face: Face| {
                let face = face.0?;
                arities.push(face.len());
                corners.extend(face);
                Ok(())
            })?,
            "tristrips" => payload.each(element, |strips: Strips| {
                for triangle in ply_strips::triangles(&strips.0?)? {
                    arities.push(3);
                    corners.extend(triangle);
                }
                Ok(())
            })?,
            _ => payload.each(element, |_: Skipped| Ok(()))?,
        }
    }
    let mut rest = corners.as_slice();
    let vertices = mesh.mesh.vertices.len();
    for (number, arity) in arities.into_iter().enumerate() {
        let (polygon, others) = rest.split_at(arity);
        rest = others;
        if let Some(bad) = polygon.iter().find(|&&i| i as usize >= vertices) {
            return Err(format!(
                "face {number} names vertex {bad}, but there are {vertices}, counted from 0"
            ));
        }
        push_polygon(&mut mesh, polygon);
        if mesh.mesh.triangles.len() > MAX_TRIANGLES {
            return Err(format!("it has more than {MAX_TRIANGLES} triangles"));
        }
    }
    if mesh.mesh.triangles.is_empty() {
        return Err("it has no face of three corners or more".into());
    }
    Ok(mesh.mesh)
}

fn not_valid(error: &ParseError) -> String {
    let text: Vec<_> = error.to_string().split_whitespace().map(str::to_owned).collect();
    // A binary line may be long.
    let text: String = text.join(" ").chars().filter(|c| !c.is_control()).take(300).collect();
    format!("not a valid PLY file: {text}")
}

pub(super) fn is_corner_list(name: &str) -> bool {
    name == "vertex_indices" || name == "vertex_index"
}

/// Refuses counts that `rest` bytes cannot hold: an element has at least a byte for each number of text, and its size in
/// binary.
fn check_counts(header: &Header, rest: usize) -> Result<(), String> {
    let mut needed = 0usize;
    for element in header.elements.values() {
        let ElementDef { name, count, properties } = element;
        let sizes = properties.values().map(|property| match (&property.data_type, header.encoding) {
            // A digit and a blank or an end of line.
            (_, Encoding::Ascii) => 2,
            (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _), _) => size(scalar),
        });
        let size: usize = sizes.sum();
        if size == 0 && *count > 0 {
            return Err(format!("element \"{name}\" has no properties"));
        }
        // The last end of line may be missing.
        needed = needed.saturating_add(count.saturating_mul(size));
        if needed > rest.saturating_add(1) {
            return Err(format!(
                "it promises {count} of element \"{name}\", which take at least {needed} bytes; found {rest} after the header"
            ));
        }
    }
    Ok(())
}

fn size(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// What follows the header.
struct Payload<'b> {
    rest: &'b [u8],
    encoding: Encoding,
}

impl Payload<'_> {
    /// Reads all elements of one kind, one at a time.
    fn each<E: PropertyAccess>(
        &mut self,
        element: &ElementDef,
        mut take: impl FnMut(E) -> Result<(), String>,
    ) -> Result<(), String> {
        let parser = Parser::<E>::new();
        let mut line = String::new();
        for number in 0..element.count {
            let read = match self.encoding {
                Encoding::Ascii => {
                    line.clear();
                    match self.rest.read_line(&mut line) {
                        Ok(0) => return Err(self.at(element, number, "the file ends")),
                        Err(_) => return Err(self.at(element, number, "not text")),
                        Ok(_) => parser.read_ascii_element(&line, element),
                    }
                }
                Encoding::BinaryBigEndian => parser.read_big_endian_element(&mut self.rest, element),
                Encoding::BinaryLittleEndian => parser.read_little_endian_element(&mut self.rest, element),
            };
            let read = read.map_err(|e| self.at(element, number, &not_valid(&e)))?;
            take(read).map_err(|problem| self.at(element, number, &problem))?;
        }
        Ok(())
    }

    fn at(&self, element: &ElementDef, number: usize, problem: &str) -> String {
        format!("element \"{}\" {number} of {}: {problem}", element.name, element.count)
    }
}

/// The properties of a vertex's normal.
const NORMALS: [&str; 3] = ["nx", "ny", "nz"];

/// A position and a normal, in the file's own coordinates.
struct Vertex {
    position: DVec3,
    normal: DVec3,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: DVec3::ZERO, normal: DVec3::ZERO }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let value = match property {
            Property::Char(v) => f64::from(v),
            Property::UChar(v) => f64::from(v),
            Property::Short(v) => f64::from(v),
            Property::UShort(v) => f64::from(v),
            Property::Int(v) => f64::from(v),
            Property::UInt(v) => f64::from(v),
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::Ignored,
        };
        match name {
            "x" => self.position.x = value,
            "y" => self.position.y = value,
            "z" => self.position.z = value,
            "nx" => self.normal.x = value,
            "ny" => self.normal.y = value,
            "nz" => self.normal.z = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// The corners of a polygon.
struct Face(Result<Vec<u32>, String>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Ok(Vec::new()))
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !is_corner_list(name) {
            return PropertyAccessResult::Ignored;
        }
        let corners = property.to_u32_list();
        self.0 = corners.ok_or_else(|| "corners have to be whole numbers from 0".to_owned());
        PropertyAccessResult::Set
    }
}

/// An element of no use here.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
