//! Gathers what every pass of a picture needs: the device, the commands so far, the clock, the frame's numbers.

use crate::{
    Gpu,
    timer::{Span, Timer},
};

/// The commands of one picture while they are being written.
pub(crate) struct Scope<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) encoder: wgpu::CommandEncoder,
    pub(crate) timer: &'a mut Timer,
    /// The frame uniform.
    pub(crate) frame: &'a wgpu::Buffer,
}

/// Whether a pass begins or ends its span of time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) span: Span,
    pub(crate) first: bool,
    pub(crate) last: bool,
}

impl Scope<'_> {
    /// A span that one pass alone fills.
    pub(crate) fn alone(&mut self, name: &'static str) -> Edge {
        Edge { span: self.timer.span(name), first: true, last: true }
    }

    /// A pass that draws one fragment for each pixel of `target`, with one bind group.
    pub(crate) fn cover(
        &mut self,
        edge: Edge,
        pipeline: &wgpu::RenderPipeline,
        group: &wgpu::BindGroup,
        target: &wgpu::TextureView,
    ) {
        let mut pass =
            self.render_pass(edge, Some((target, wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT))), None);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// The same with a second target.
    pub(crate) fn cover_both(
        &mut self,
        edge: Edge,
        pipeline: &wgpu::RenderPipeline,
        group: &wgpu::BindGroup,
        targets: [&wgpu::TextureView; 2],
    ) {
        let colours = targets.map(|view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })
        });
        let mut pass = self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &colours,
            timestamp_writes: self.timer.render_writes(edge.span, edge.first, edge.last),
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// A pass that draws to `target`, tested against `depth` where given.
    pub(crate) fn render_pass(
        &mut self,
        edge: Edge,
        target: Option<(&wgpu::TextureView, wgpu::LoadOp<wgpu::Color>)>,
        depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
    ) -> wgpu::RenderPass<'_> {
        self.render_pass_to(edge, target.as_slice(), depth)
    }

    /// The same with any number of targets.
    pub(crate) fn render_pass_to(
        &mut self,
        edge: Edge,
        targets: &[(&wgpu::TextureView, wgpu::LoadOp<wgpu::Color>)],
        depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
    ) -> wgpu::RenderPass<'_> {
        let colour = |&(view, load): &(_, _)| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        };
        let colours: Vec<_> = targets.iter().map(|target| Some(colour(target))).collect();
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &colours,
            depth_stencil_attachment: depth.map(|(view, load)| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: self.timer.render_writes(edge.span, edge.first, edge.last),
            ..Default::default()
        })
    }

    /// A pass of one dispatch.
    pub(crate) fn compute(
        &mut self,
        edge: Edge,
        pipeline: &wgpu::ComputePipeline,
        groups: &[&wgpu::BindGroup],
        (x, y): (u32, u32),
    ) {
        let mut pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: None,
            timestamp_writes: self.timer.compute_writes(edge.span, edge.first, edge.last),
        });
        pass.set_pipeline(pipeline);
        for (index, group) in groups.iter().enumerate() {
            pass.set_bind_group(index as u32, *group, &[]);
        }
        pass.dispatch_workgroups(x, y, 1);
    }
}
