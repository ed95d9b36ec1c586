//! Turns what a picture needs into the gathering pipeline that is specialised for it.

use crate::{
    Accumulation, Gpu,
    deferred::depth_test,
    layout::Corner,
    pipelines::{self, Drawing},
    shader,
    targets::HDR,
};

/// What lights are shadowed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Maps {
    /// Nothing.
    None,
    /// The distance maps that were published with them.
    Published,
    /// Shadow maps that are drawn here.
    Drawn,
}

/// A variant of a gathering pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    pub(super) accumulation: Accumulation,
    pub(super) ranged: bool,
    pub(super) continues: bool,
    pub(super) interleaved: bool,
    pub(super) patches: bool,
    pub(super) maps: Maps,
}

/// The pipeline of a variant.
pub(super) fn pipeline(gpu: &Gpu, variant: Variant) -> wgpu::RenderPipeline {
    let ranged = ("RANGED", f64::from(variant.ranged));
    let patches = ("PATCHES", f64::from(variant.patches));
    let mapped = ("MAPPED", f64::from(variant.maps != Maps::None));
    let source = |published, drawn| if variant.maps == Maps::Drawn { drawn } else { published };
    let additive = Drawing { fragment: Some("add"), format: Some(HDR), additive: true, ..Drawing::default() };
    match variant.accumulation {
        Accumulation::Tiled => {
            let constants = [ranged, patches, mapped, ("CONTINUES", f64::from(variant.continues))];
            let entry = if variant.interleaved { "gather_interleaved" } else { "gather" };
            let set = Drawing {
                vertex: "cover",
                fragment: Some(entry),
                constants: &constants,
                second: variant.interleaved,
                additive: false,
                ..additive
            };
            pipelines::drawing(gpu, source(&shader::TILED, &shader::TILED_DRAWN), &set)
        }
        Accumulation::Splat => {
            let constants = [ranged, patches, mapped];
            // The far sides, once each, wherever the eye is.
            let set = Drawing {
                vertex: "sphere",
                constants: &constants,
                cull: Some(wgpu::Face::Front),
                ..additive
            };
            pipelines::drawing(gpu, source(&shader::SPLAT, &shader::SPLAT_DRAWN), &set)
        }
        Accumulation::Forward => {
            let constants = [ranged, patches, mapped];
            let set = Drawing {
                vertex: "corner",
                constants: &constants,
                corners: Some(Corner::layout()),
                // The same triangles in the same place as in the G-buffer have the same depth.
                depth: Some(depth_test(false, wgpu::CompareFunction::Equal)),
                ..additive
            };
            pipelines::drawing(gpu, source(&shader::FORWARD, &shader::FORWARD_DRAWN), &set)
        }
    }
}
