//! Turns geometry into the G-buffer, lights into direct irradiance, and both with the indirect light into a layer.

use crate::{
    Gpu,
    geometry::Geometry,
    layout::{Corner, TextureCorner},
    pipelines::{self, Drawing, texture, whole},
    scope::Scope,
    shader,
    shadow_maps::ShadowMaps,
    sky::SkyOnDevice,
    targets::{DEPTH, GBUFFER, HDR, Target, Targets},
    textures::Textures,
};
use glam::Vec3;
use photonstream_scene::Features;
use wgpu::TextureUsages;

/// What the direct pass is specialised for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DirectKind {
    pub(crate) delta_lights: bool,
    pub(crate) area_lights: bool,
    pub(crate) sky: bool,
    pub(crate) shadows: bool,
    /// Whether maps name triangles.
    pub(crate) named: bool,
}

impl DirectKind {
    pub(crate) fn of(features: &Features, shadows: bool, named: bool) -> Self {
        let delta_lights = features.point_lights + features.spot_lights + features.directional_lights > 0;
        Self { delta_lights, area_lights: features.area_lights > 0, sky: features.skies > 0, shadows, named }
    }
}

/// The passes that every picture has.
#[derive(Debug)]
pub(crate) struct Deferred {
    gbuffer: wgpu::RenderPipeline,
    /// The same for a scene with textures.
    textured: Option<wgpu::RenderPipeline>,
    direct: Option<(DirectKind, wgpu::RenderPipeline)>,
    /// With a sky, with textures, or without.
    composite: Option<([bool; 2], wgpu::RenderPipeline)>,
    /// Stands in for what a picture does not need.
    pub(crate) open: Target,
    nobody: Target,
}

/// What a composite reads beside the targets of its picture.
pub(crate) struct Shown<'a> {
    pub(crate) objects: &'a wgpu::Buffer,
    pub(crate) indirect: &'a wgpu::TextureView,
    pub(crate) openness: Option<&'a wgpu::TextureView>,
    pub(crate) owners: Option<&'a wgpu::TextureView>,
    pub(crate) colours: &'a wgpu::Buffer,
    pub(crate) tallies: &'a wgpu::Buffer,
    pub(crate) sky: &'a SkyOnDevice,
    /// Whether the scene has textures.
    pub(crate) textured: bool,
}

fn gbuffer_drawing() -> Drawing<'static> {
    Drawing {
        vertex: "corner",
        fragment: Some("surface"),
        format: Some(GBUFFER),
        corners: Some(Corner::layout()),
        depth: Some(depth_test(true, wgpu::CompareFunction::Greater)),
        ..Drawing::default()
    }
}

fn textured(gpu: &Gpu) -> wgpu::RenderPipeline {
    let corners = Some(TextureCorner::layout());
    let set = Drawing { second: true, texture_corners: corners, ..gbuffer_drawing() };
    pipelines::drawing(gpu, &shader::GBUFFER_TEXTURED, &set)
}

impl Deferred {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let open = Target::new(gpu, "open", [1, 1], crate::targets::OPENNESS, usage);
        let size = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
        let row = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4), rows_per_image: None };
        gpu.queue.write_texture(open.texture.as_image_copy(), bytemuck::bytes_of(&1f32), row, size);
        Self {
            gbuffer: pipelines::drawing(gpu, &shader::GBUFFER, &gbuffer_drawing()),
            textured: None,
            direct: None,
            composite: None,
            open,
            nobody: Target::new(gpu, "nobody", [1, 1], GBUFFER, usage),
        }
    }

    /// Draws what the camera sees into the G-buffer; the number of objects that it may see.
    pub(crate) fn encode_gbuffer(
        &mut self,
        scope: &mut Scope<'_>,
        targets: &mut Targets,
        (geometry, textures): (&Geometry, Option<&Textures>),
        sees: impl Fn(Vec3, f32) -> bool,
    ) -> u32 {
        if let Some(textures) = textures {
            return self.encode_textured(scope, targets, (geometry, textures), sees);
        }
        let group = pipelines::bind(scope.gpu, &self.gbuffer.get_bind_group_layout(0), &[whole(scope.frame)]);
        let edge = scope.alone("G-buffer");
        let nothing = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let far = wgpu::LoadOp::Clear(0.0);
        let mut pass =
            scope.render_pass(edge, Some((&targets.gbuffer.view, nothing)), Some((&targets.depth.view, far)));
        pass.set_pipeline(&self.gbuffer);
        pass.set_bind_group(0, &group, &[]);
        geometry.draw(&mut pass, 0..1, sees)
    }

    fn encode_textured(
        &mut self,
        scope: &mut Scope<'_>,
        targets: &mut Targets,
        (geometry, textures): (&Geometry, &Textures),
        sees: impl Fn(Vec3, f32) -> bool,
    ) -> u32 {
        targets.prepare_texel(scope.gpu);
        let pipeline = self.textured.get_or_insert_with(|| textured(scope.gpu));
        let resources = [whole(scope.frame), whole(&textures.texels), whole(&textures.layouts)];
        let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
        let edge = scope.alone("G-buffer");
        let nothing = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let views: Vec<_> = [Some(&targets.gbuffer), targets.texel.as_ref()]
            .into_iter()
            .flatten()
            .map(|t| (&t.view, nothing))
            .collect();
        let far = wgpu::LoadOp::Clear(0.0);
        let mut pass = scope.render_pass_to(edge, &views, Some((&targets.depth.view, far)));
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_vertex_buffer(1, textures.corners.slice(..));
        geometry.draw(&mut pass, 0..1, sees)
    }

    /// Irradiance straight from the lights, with shadow maps or without shadows.
    pub(crate) fn encode_direct(
        &mut self,
        scope: &mut Scope<'_>,
        targets: &Targets,
        maps: &ShadowMaps,
        geometry: &Geometry,
        kind: DirectKind,
    ) {
        if self.direct.as_ref().is_none_or(|(k, _)| *k != kind) {
            let constants = [
                ("DELTA_LIGHTS", f64::from(kind.delta_lights)),
                ("AREA_LIGHTS", f64::from(kind.area_lights)),
                ("SKY", f64::from(kind.sky)),
                ("SHADOWS", f64::from(kind.shadows)),
                ("NAMED_MAPS", f64::from(kind.named)),
            ];
            self.direct =
                Some((kind, pipelines::covering(scope.gpu, &shader::DIRECT, "arrive", HDR, &constants)));
        }
        let Some((_, pipeline)) = &self.direct else { return };
        let resources = [
            whole(scope.frame),
            texture(&targets.gbuffer.view),
            whole(&maps.lights),
            whole(&maps.views),
            texture(&maps.maps),
            Some(wgpu::BindingResource::Sampler(&maps.sampler)),
            texture(&maps.names),
            if geometry.is_readable(scope.gpu) { whole(&geometry.corners) } else { whole(&maps.lights) },
            Some(wgpu::BindingResource::Sampler(&maps.nearest)),
        ];
        let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
        let edge = scope.alone("direct light");
        scope.cover(edge, pipeline, &group, &targets.direct.view);
    }

    /// The layer that the frame uniform asks for.
    pub(crate) fn encode_composite(&mut self, scope: &mut Scope<'_>, targets: &Targets, shown: &Shown<'_>) {
        let texel = targets.texel.as_ref().filter(|_| shown.textured);
        let kind = [shown.sky.is_there(), texel.is_some()];
        if self.composite.as_ref().is_none_or(|(k, _)| *k != kind) {
            let constants = [("SKY", f64::from(kind[0]))];
            let entry = if texel.is_some() { "layer_textured" } else { "layer" };
            let pipeline = pipelines::covering(scope.gpu, &shader::COMPOSITE, entry, HDR, &constants);
            self.composite = Some((kind, pipeline));
        }
        let Some((_, pipeline)) = &self.composite else { return };
        let resources = [
            whole(scope.frame),
            texture(&targets.gbuffer.view),
            whole(shown.objects),
            texture(&targets.direct.view),
            texture(shown.indirect),
            texture(shown.openness.unwrap_or(&self.open.view)),
            texture(shown.owners.unwrap_or(&self.nobody.view)),
            whole(shown.colours),
            whole(shown.tallies),
            whole(&shown.sky.numbers),
            texture(&shown.sky.map),
            texel.and_then(|texel| texture(&texel.view)),
        ];
        let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
        let edge = scope.alone("composite");
        scope.cover(edge, pipeline, &group, &targets.output.view);
    }
}

/// A test against reversed depth.
pub(crate) fn depth_test(write: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}
