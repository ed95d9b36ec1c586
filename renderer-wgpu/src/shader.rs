//! Turns WGSL files and the constants printed from Rust into shader modules.

use crate::layout;
use photonstream_shading::wgsl;

/// One shader module: its name and the files that it is made of, in order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub(crate) name: &'static str,
    pub(crate) parts: &'static [&'static str],
}

const FRAME: &str = include_str!("../wgsl/frame.wgsl");
const PROJECTION: &str = include_str!("../wgsl/projection.wgsl");
const CORNER: &str = include_str!("../wgsl/corner.wgsl");
const VSL: &str = include_str!("../wgsl/vsl.wgsl");
const VSL_PATCH: &str = include_str!("../wgsl/vsl_patch.wgsl");
const VSL_MAP: &str = include_str!("../wgsl/vsl_map.wgsl");
const VSL_MAP_PUBLISHED: &str = include_str!("../wgsl/vsl_map_published.wgsl");
const VSL_MAP_DRAWN: &str = include_str!("../wgsl/vsl_map_drawn.wgsl");
const VSL_QUARTER: &str = include_str!("../wgsl/vsl_quarter.wgsl");
const SHADOW: &str = include_str!("../wgsl/shadow.wgsl");

const SHADOW_BEAM: &str = include_str!("../wgsl/shadow_beam.wgsl");
const SHADOW_NAMED: &str = include_str!("../wgsl/shadow_named.wgsl");

const RAYS_TRIANGLE: &str = include_str!("../wgsl/rays_triangle.wgsl");
const RAYS_WALK: &str = include_str!("../wgsl/rays_walk.wgsl");
const RAYS_SOLID: &str = include_str!("../wgsl/rays_solid.wgsl");
const RAYS_HOLES: &str = include_str!("../wgsl/rays_holes.wgsl");
const RAYS_PIXEL: &str = include_str!("../wgsl/rays_pixel.wgsl");

macro_rules! sources {
    ($($constant:ident = $file:literal [$($part:expr),*];)*) => {
        $(pub(crate) const $constant: Source = Source {
            name: $file,
            parts: &[$($part,)* include_str!(concat!("../wgsl/", $file, ".wgsl"))],
        };)*

        /// Every module of the renderer.
        #[cfg(test)]
        pub(crate) const ALL: &[Source] = &[$($constant,)*];
    };
}

sources! {
    GBUFFER = "gbuffer" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SURFACE, FRAME, PROJECTION, CORNER];
    GBUFFER_TEXTURED = "gbuffer_textured" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SURFACE, wgsl::WRAP, wgsl::TEXTURE, FRAME, PROJECTION, CORNER
    ];
    SHADOW_MAP = "shadow_map" [];
    SHADOW_MAP_HOLES = "shadow_map_holes" [wgsl::WRAP, wgsl::TEXTURE];
    DIRECT = "direct" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SOBOL, wgsl::LIGHT, FRAME, SHADOW, SHADOW_BEAM, SHADOW_NAMED];
    UNPACK = "unpack" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, wgsl::CULLING, FRAME, VSL];
    CULL = "cull" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, wgsl::CULLING, FRAME, VSL];
    VSL_SHADOW_MAP = "vsl_shadow_map" [VSL_QUARTER];
    VSL_SHADOW_MAP_HOLES = "vsl_shadow_map_holes" [wgsl::WRAP, wgsl::TEXTURE, VSL_QUARTER];
    TILED = "tiled" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::BASIS, wgsl::DISTANCE_MAP, wgsl::DISTANCE_TEXELS, FRAME, VSL, VSL_PATCH, VSL_MAP, VSL_MAP_PUBLISHED
    ];
    TILED_DRAWN = "tiled" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::BASIS, wgsl::DISTANCE_MAP, FRAME, VSL, VSL_PATCH, VSL_MAP, VSL_MAP_DRAWN
    ];
    SPLAT = "splat" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::BASIS, wgsl::DISTANCE_MAP, wgsl::DISTANCE_TEXELS, FRAME, PROJECTION, VSL, VSL_PATCH, VSL_MAP, VSL_MAP_PUBLISHED
    ];
    SPLAT_DRAWN = "splat" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::BASIS, wgsl::DISTANCE_MAP, FRAME, PROJECTION, VSL, VSL_PATCH, VSL_MAP, VSL_MAP_DRAWN
    ];
    FORWARD = "forward" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SURFACE, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::BASIS, wgsl::DISTANCE_MAP, wgsl::DISTANCE_TEXELS, FRAME, PROJECTION, CORNER, VSL, VSL_PATCH, VSL_MAP, VSL_MAP_PUBLISHED
    ];
    FORWARD_DRAWN = "forward" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SURFACE, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::BASIS, wgsl::DISTANCE_MAP, FRAME, PROJECTION, CORNER, VSL, VSL_PATCH, VSL_MAP, VSL_MAP_DRAWN
    ];
    INTERLEAVE = "interleave" [wgsl::CAMERA, wgsl::OCTAHEDRAL, FRAME];
    AO = "ao" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SOBOL, FRAME, PROJECTION];
    AO_SMOOTH = "ao_smooth" [wgsl::CAMERA, wgsl::OCTAHEDRAL, FRAME];
    OWNER = "owner" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, FRAME, VSL];
    COMPOSITE = "composite" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::BASIS, wgsl::SKY, FRAME];
    DISC = "disc" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::KERNEL, FRAME, PROJECTION, VSL];
    RAYS_DIRECT = "rays_direct" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SOBOL, wgsl::LIGHT, wgsl::BASIS, wgsl::SKY, FRAME, RAYS_TRIANGLE, RAYS_SOLID, RAYS_WALK, RAYS_PIXEL
    ];
    RAYS_DIRECT_HOLES = "rays_direct" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SOBOL, wgsl::LIGHT, wgsl::BASIS, wgsl::SKY, wgsl::WRAP, FRAME, RAYS_TRIANGLE, RAYS_HOLES, RAYS_WALK, RAYS_PIXEL
    ];
    RAYS_INDIRECT = "rays_indirect" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SOBOL, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, FRAME, VSL, VSL_PATCH, RAYS_TRIANGLE, RAYS_SOLID, RAYS_WALK, RAYS_PIXEL
    ];
    RAYS_INDIRECT_HOLES = "rays_indirect" [
        wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::SOBOL, wgsl::KERNEL, wgsl::PATCH, wgsl::CULLING, wgsl::WRAP, FRAME, VSL, VSL_PATCH, RAYS_TRIANGLE, RAYS_HOLES, RAYS_WALK, RAYS_PIXEL
    ];
    RAYS_NOISE = "rays_noise" [wgsl::CAMERA, wgsl::OCTAHEDRAL, FRAME, RAYS_TRIANGLE, RAYS_SOLID, RAYS_WALK, RAYS_PIXEL];
    PRESENT = "present" [wgsl::CAMERA, wgsl::OCTAHEDRAL, wgsl::TONE, FRAME];
}

impl Source {
    /// The whole text.
    pub(crate) fn text(&self) -> String {
        let mut text = wgsl::constants();
        text.push_str(&layout::constants());
        text.push_str(&crate::rays::constants());
        for part in self.parts {
            text.push_str(part);
            text.push('\n');
        }
        text
    }

    /// The module on `device`.
    pub(crate) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.text().into()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::naga;

    fn parse(source: &Source) -> naga::Module {
        let text = source.text();
        naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|error| panic!("{}: {}", source.name, error.emit_to_string(&text)))
    }

    /// Every module is valid with the base capabilities, without any device.
    #[test]
    fn every_module_is_valid() {
        for source in ALL {
            let module = parse(source);
            let mut validator = naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::default(),
            );
            if let Err(error) = validator.validate(&module) {
                panic!("{}: {}", source.name, error.emit_to_string(&source.text()));
            }
            assert!(!module.entry_points.is_empty(), "{}", source.name);
        }
    }

    /// Structures have the same names, offsets and sizes in Rust as in every module that has them, and each is in one.
    #[test]
    fn structures_are_the_same_on_both_sides() {
        let mut seen = std::collections::HashSet::new();
        for source in ALL {
            let module = parse(source);
            let mut layouter = naga::proc::Layouter::default();
            layouter.update(module.to_ctx()).unwrap();
            for (handle, ty) in module.types.iter() {
                let (Some(name), naga::TypeInner::Struct { members, span }) = (&ty.name, &ty.inner) else {
                    continue;
                };
                let Some(&(shared, size, fields)) = layout::SHARED.iter().find(|(n, ..)| n == name) else {
                    continue;
                };
                seen.insert(shared);
                // Uniforms end on a multiple of 16 bytes; Rust says so by its own fields.
                assert_eq!(*span as usize, size, "{}: {name}", source.name);
                assert_eq!(layouter[handle].size as usize, size);
                let found: Vec<_> = members
                    .iter()
                    .map(|m| {
                        let size = layouter[m.ty].size as usize;
                        (m.name.clone().unwrap(), m.offset as usize, size)
                    })
                    .collect();
                let expected: Vec<_> = fields.iter().map(|&(n, o, s)| (n.to_owned(), o, s)).collect();
                assert_eq!(found, expected, "{}: {name}", source.name);
            }
        }
        assert_eq!(seen.len(), layout::SHARED.len(), "{seen:?}");
    }

    /// The published record, which is read as it is.
    #[test]
    fn records_are_read_where_they_are_written() {
        use photonstream_protocol::VslRecord;
        let module = parse(&UNPACK);
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Record")).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("a structure") };
        assert_eq!(*span as usize, size_of::<VslRecord>());
        let found: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
        let expected: Vec<_> = VslRecord::FIELDS.iter().map(|f| (f.name, f.offset)).collect();
        assert_eq!(found, expected);
    }
}
