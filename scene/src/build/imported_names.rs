//! Turns names that a scene file has for parts of an import into the parts that they mean, and what it says of these.

use super::{check_name, materials::Materials};
use crate::{
    config::{Field, PartOverride},
    error::{SceneError, nearest},
    import::{Import, LeftOut},
    scene::Sides,
};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// A group of a file, or a node, and a material.
type Pair = (String, String);

/// What is otherwise than in the file, of one object.
#[derive(Default)]
pub(super) struct Otherwise {
    /// Its name.
    pub(super) rename: Option<String>,
    /// A material of the scene file.
    pub(super) material: Option<String>,
    pub(super) sides: Option<Sides>,
    /// W m⁻² sr⁻¹.
    pub(super) radiance: Option<DVec3>,
}

/// The tables of an import that change single parts.
pub(super) struct Tables<'c, 'f> {
    pub(super) materials: Option<&'c BTreeMap<String, String>>,
    pub(super) parts: Option<&'c BTreeMap<String, PartOverride>>,
    /// That of the import.
    pub(super) field: Field<'f>,
}

impl Tables<'_, '_> {
    /// What these say of each object that the import called `name` makes: key by key that of the pair, else of the material,
    /// else of the group.
    ///
    /// # Errors
    /// If a name means nothing, a value is not valid, a material is given twice, or a new name means several objects or is
    /// that of something else.
    pub(super) fn read(
        &self,
        name: &str,
        import: &Import,
        excluded: &BTreeSet<Pair>,
        known: &Materials,
    ) -> Result<BTreeMap<Pair, Otherwise>, SceneError> {
        let no_nodes = BTreeMap::new();
        let field = self.field.key("materials");
        for (part, material) in self.materials.into_iter().flatten() {
            known.check(material, &field.key(part))?;
            named(import, &no_nodes, std::slice::from_ref(part), &field)?;
        }
        let field = self.field.key("parts");
        let mut renamed = BTreeMap::new();
        for (part, table) in self.parts.into_iter().flatten() {
            let of_part = field.key(part);
            let mut meant = named(import, &no_nodes, std::slice::from_ref(part), &field)?;
            if let Some(material) = &table.material {
                let of_material = of_part.key("material");
                known.check(material, &of_material)?;
                if let Some(other) = self.materials.and_then(|materials| materials.get(part)) {
                    let remedy = "leave one of them out";
                    return Err(of_material.invalid(
                        format!("\"{material}\", and \"{other}\" in `materials`"),
                        "one material",
                        remedy,
                    ));
                }
            }
            if let Some(radiance) = table.radiance_w_m2_sr {
                of_part.key("radiance_w_m2_sr").power(radiance)?;
            }
            if let Some(new) = &table.rename {
                let of_name = of_part.key("rename");
                check_name(new, &of_name)?;
                meant.retain(|pair| !excluded.contains(pair));
                renamed.insert(one(name, part, meant, &of_name)?, (new, of_name));
            }
        }
        check_new_names(name, import, excluded, &renamed)?;
        let kept = import.groups.keys().filter(|pair| !excluded.contains(*pair));
        Ok(kept.map(|pair| (pair.clone(), self.of(pair, &renamed))).collect())
    }

    fn of(&self, pair: &Pair, renamed: &BTreeMap<Pair, (&String, Field<'_>)>) -> Otherwise {
        let (group, material) = pair;
        let names = [&format!("{group}/{material}"), material, group];
        let tables = || names.into_iter().filter_map(|name| self.parts?.get(name));
        let own_material = |name: &String| {
            let in_part = || self.parts?.get(name)?.material.as_ref();
            self.materials.and_then(|materials| materials.get(name)).or_else(in_part)
        };
        Otherwise {
            rename: renamed.get(pair).map(|(new, _)| (*new).clone()),
            material: names.into_iter().find_map(own_material).cloned(),
            sides: tables().find_map(|table| table.sides),
            radiance: tables().find_map(|table| table.radiance_w_m2_sr).map(|radiance| radiance.to_dvec3()),
        }
    }
}

/// The name of an object that has none of its own.
pub(super) fn full(import: &str, (group, material): &Pair) -> String {
    format!("{import}/{group}/{material}")
}

/// The one of the objects that are `meant` by `part`.
fn one(import: &str, part: &str, meant: BTreeSet<Pair>, field: &Field<'_>) -> Result<Pair, SceneError> {
    let names: Vec<String> = meant.iter().map(|pair| format!("\"{}\"", full(import, pair))).collect();
    let mut meant = meant.into_iter();
    match (meant.next(), meant.next()) {
        (Some(pair), None) => Ok(pair),
        (None, _) => Err(field.invalid(
            format!("\"{part}\", of which nothing is left"),
            "the name of an object",
            "do not exclude it, or do not rename it",
        )),
        _ => Err(field.invalid(
            format!("{} objects called \"{part}\": {}", names.len(), names.join(", ")),
            "a part that is one object",
            "name a group or node and a material with \"/\" between them",
        )),
    }
}

/// Checks that new names are those of one object each, and begin no other object's or light's.
fn check_new_names(
    import_name: &str,
    import: &Import,
    excluded: &BTreeSet<Pair>,
    renamed: &BTreeMap<Pair, (&String, Field<'_>)>,
) -> Result<(), SceneError> {
    let others = import.groups.keys().filter(|pair| !excluded.contains(*pair)).map(|pair| {
        let own = || full(import_name, pair);
        let now = renamed.get(pair).map_or_else(own, |(new, _)| format!("{import_name}/{new}"));
        (Some(pair), now)
    });
    let lights = import.lights.iter().map(|light| (None, format!("{import_name}/{}", light.node)));
    let others: Vec<(Option<&Pair>, String)> = others.chain(lights).collect();
    for (pair, (new, field)) in renamed {
        let name = format!("{import_name}/{new}");
        let is_taken = |other: &str| {
            other.strip_prefix(&name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if let Some((other, taken)) = others.iter().find(|(other, n)| *other != Some(pair) && is_taken(n)) {
            let kind = if other.is_some() { "object" } else { "light" };
            let is_renamed = |other: &Pair| renamed.contains_key(other).then(|| full(import_name, other));
            let was = other.and_then(is_renamed).map(|was| format!(", which was \"{was}\""));
            return Err(field.invalid(
                format!(
                    "\"{new}\" for \"{}\" beside the {kind} \"{taken}\"{}",
                    full(import_name, pair),
                    was.unwrap_or_default()
                ),
                "a name that no other object or light of the import has or begins with",
                "choose another",
            ));
        }
    }
    Ok(())
}

/// The pairs of group and material that `names` name; `nodes` may be named besides.
pub(super) fn named(
    import: &Import,
    nodes: &BTreeMap<String, LeftOut>,
    names: &[String],
    field: &Field<'_>,
) -> Result<BTreeSet<Pair>, SceneError> {
    let mut found = BTreeSet::new();
    for name in names {
        let mut known: BTreeSet<String> = nodes.keys().cloned().collect();
        let mut matched = nodes.get(name) == Some(&LeftOut(true));
        for pair in import.groups.keys() {
            let (group, material) = pair;
            if name == group || name == material || *name == format!("{group}/{material}") {
                matched = true;
                found.insert(pair.clone());
            } else {
                known.extend([group.clone(), material.clone()]);
            }
        }
        if !matched {
            return Err(SceneError::UnknownName {
                place: field.place(),
                kind: if import.nodes.is_empty() {
                    "group or material of the file"
                } else if nodes.is_empty() {
                    "node with a mesh, or material, of the file"
                } else {
                    "node or material of the file"
                },
                found: name.clone(),
                nearest: nearest(name, known.iter().map(String::as_str)),
                known: known.into_iter().collect(),
            });
        }
    }
    Ok(found)
}
