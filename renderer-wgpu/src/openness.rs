//! Turns the G-buffer into ambient occlusion: the share of the hemisphere over each pixel that is open.

use crate::{
    Gpu,
    pipelines::{self, texture, whole},
    scope::Scope,
    shader,
    targets::{OPENNESS, Targets},
};

/// Reach of the occlusion, as a share of the scene's radius.
pub(crate) const REACH_SHARE: f32 = 0.15;
/// Samples per pixel; the smoothing joins those of 16 pixels.
pub(crate) const SAMPLES: u32 = 16;

/// The passes of ambient occlusion.
#[derive(Debug)]
pub(crate) struct Openness {
    sample: wgpu::RenderPipeline,
    smooth: wgpu::RenderPipeline,
}

impl Openness {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            sample: pipelines::covering(gpu, &shader::AO, "open", OPENNESS, &[]),
            smooth: pipelines::covering(gpu, &shader::AO_SMOOTH, "smooth_open", OPENNESS, &[]),
        }
    }

    pub(crate) fn encode(&self, scope: &mut Scope<'_>, targets: &mut Targets) {
        targets.openness(scope.gpu);
        let Some([noisy, smooth]) = &targets.openness else { return };
        let resources = [whole(scope.frame), texture(&targets.gbuffer.view)];
        let group = pipelines::bind(scope.gpu, &self.sample.get_bind_group_layout(0), &resources);
        let edge = scope.alone("ambient occlusion");
        scope.cover(edge, &self.sample, &group, &noisy.view);
        let resources = [whole(scope.frame), texture(&targets.gbuffer.view), texture(&noisy.view)];
        let group = pipelines::bind(scope.gpu, &self.smooth.get_bind_group_layout(0), &resources);
        let edge = scope.alone("occlusion smoothing");
        scope.cover(edge, &self.smooth, &group, &smooth.view);
    }
}
