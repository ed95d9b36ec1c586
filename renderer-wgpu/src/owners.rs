//! Turns pixels into the virtual surface lights that own them, and lights into colours and discs.

use crate::{
    Gpu, Show,
    deferred::depth_test,
    geometry,
    pipelines::{self, Drawing, part, texture, whole},
    scope::{Edge, Scope},
    shader,
    targets::{GBUFFER, HDR, Targets},
    vsl_buffer::VslBuffer,
};
use core::f32::consts::{FRAC_1_PI, PI};
use glam::Vec3;
use photonstream_protocol::VslRecord;
use photonstream_renderer::{LayerKind, owner};
use wgpu::{BufferUsages, LoadOp};

/// Passes that show lights themselves.
#[derive(Debug)]
pub(crate) struct Owners {
    find: [wgpu::RenderPipeline; 2],
    discs: wgpu::RenderPipeline,
    /// A colour for each light, and the radius of its disc.
    pub(crate) colours: wgpu::Buffer,
}

impl Owners {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let find = [0.0, 1.0].map(|continues| {
            pipelines::covering(gpu, &shader::OWNER, "find", GBUFFER, &[("CONTINUES", continues)])
        });
        let set = Drawing {
            vertex: "quad",
            fragment: Some("disc"),
            format: Some(HDR),
            depth: Some(depth_test(false, wgpu::CompareFunction::GreaterEqual)),
            strip: true,
            ..Drawing::default()
        };
        Self {
            find,
            discs: pipelines::drawing(gpu, &shader::DISC, &set),
            colours: geometry::buffer(gpu, "colours of lights", 16, BufferUsages::STORAGE),
        }
    }

    /// Uploads the colours that `show` needs.
    pub(crate) fn update(&mut self, gpu: &Gpu, records: &[VslRecord], show: Show) {
        let colours: Vec<_> = records
            .iter()
            .enumerate()
            .map(|(i, r)| colour(i, r, show).extend(disc_radius(r)).to_array())
            .collect();
        let bytes = size_of_val(colours.as_slice()) as u64;
        if self.colours.size() < bytes {
            self.colours = geometry::buffer(gpu, "colours of lights", bytes, BufferUsages::STORAGE);
        }
        gpu.queue.write_buffer(&self.colours, 0, bytemuck::cast_slice(&colours));
    }

    /// Finds the owner of each pixel; the texture that holds it is number 0 of `targets.owners`.
    pub(crate) fn encode_owners(&self, scope: &mut Scope<'_>, targets: &mut Targets, lights: &VslBuffer) {
        targets.owners(scope.gpu);
        let Some(owners) = &targets.owners else { return };
        let batches = lights.batches();
        let span = scope.timer.span("owners");
        for batch in 0..batches {
            // The last write is to number 0.
            let to = ((batches - 1 - batch) % 2) as usize;
            let pipeline = &self.find[usize::from(batch > 0)];
            let (offset, bytes) = lights.batch(batch);
            let resources = [
                whole(scope.frame),
                texture(&targets.gbuffer.view),
                part(&lights.lights, offset, bytes),
                texture(&owners[1 - to].view),
                lights.numbers(batch),
            ];
            let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
            let edge = Edge { span, first: batch == 0, last: batch + 1 == batches };
            scope.cover(edge, pipeline, &group, &owners[to].view);
        }
    }

    /// Draws the lights as discs over the shown layer.
    pub(crate) fn encode_discs(&self, scope: &mut Scope<'_>, targets: &Targets, lights: &VslBuffer) {
        let span = scope.timer.span("discs");
        let batches = lights.batches();
        for batch in 0..batches {
            let (offset, bytes) = lights.batch(batch);
            let resources = [
                whole(scope.frame),
                part(&lights.lights, offset, bytes),
                whole(&self.colours),
                lights.numbers(batch),
            ];
            let group = pipelines::bind(scope.gpu, &self.discs.get_bind_group_layout(0), &resources);
            let edge = Edge { span, first: batch == 0, last: batch + 1 == batches };
            let target = Some((&targets.output.view, LoadOp::Load));
            let mut pass = scope.render_pass(edge, target, Some((&targets.depth.view, LoadOp::Load)));
            pass.set_pipeline(&self.discs);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..4, 0..lights.batch_numbers(batch).lights);
        }
    }
}

fn disc_radius(record: &VslRecord) -> f32 {
    finite((record.area.max(0.0) / PI).sqrt())
}

fn colour(index: usize, record: &VslRecord, show: Show) -> Vec3 {
    let radiosity = || {
        let flux = Vec3::from(record.flux).map(finite);
        if record.area > 0.0 { (flux / record.area).map(finite) } else { Vec3::ZERO }
    };
    match show {
        Show::Layer(LayerKind::Vsl) => owner::colour(index),
        Show::Layer(LayerKind::Flux) => radiosity(),
        // The radiance that a diffuse surface of this radiosity shows.
        Show::Discs => radiosity() * FRAC_1_PI,
        Show::Age => {
            let age = finite(record.mean_age_s).clamp(0.0, 1.0);
            Vec3::new(age, 1.0 - age, 0.0)
        }
        Show::Layer(_) | Show::Tiles => Vec3::ZERO,
    }
}

fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}
