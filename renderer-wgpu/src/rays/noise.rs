//! Turns the difference of two independent sets of samples into the standard error of a picture's indirect light.

use crate::{Gpu, GpuError};
use wgpu::BufferUsages;

/// Sums of the samples since the last restart.
#[derive(Debug)]
pub(super) struct Noise {
    pub(super) pipeline: wgpu::ComputePipeline,
    rows: Option<wgpu::Buffer>,
    height: u32,
    budget: u32,
    /// Pictures summed in `rows`.
    samples: u32,
}

impl Noise {
    pub(super) fn new(pipeline: wgpu::ComputePipeline) -> Self {
        Self { pipeline, rows: None, height: 0, budget: 0, samples: 0 }
    }

    pub(super) fn restart(&mut self) {
        self.samples = 0;
    }

    /// Counts one more picture; one of another size or budget begins anew.
    pub(super) fn prepare(&mut self, gpu: &Gpu, height: u32, budget: u32) {
        if self.samples == 0 || self.height != height || self.budget != budget || self.rows.is_none() {
            // New buffers are zero.
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
            self.rows =
                Some(super::bindings::buffer(gpu, "errors by rows", u64::from(height.max(1)) * 16, usage));
            (self.height, self.budget, self.samples) = (height, budget, 0);
        }
        self.samples += 1;
    }

    pub(super) fn group(
        &self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        frame: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let rows = self.rows.as_ref().expect("invariant: prepare makes the buffer");
        super::bindings::bind(gpu, layout, [(0, frame.as_entire_binding()), (4, rows.as_entire_binding())])
    }

    pub(super) fn read(&self, gpu: &Gpu) -> Result<Option<f64>, GpuError> {
        let (Some(rows), 1..) = (&self.rows, self.samples) else { return Ok(None) };
        if self.budget < 2 {
            return Ok((self.budget == 0).then_some(0.0));
        }
        let mut sums = [0.0f64; 3];
        for row in crate::readback::buffer::<[f32; 4]>(gpu, rows)? {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += f64::from(value);
            }
        }
        let [variance, irradiance, pixels] = sums;
        if pixels == 0.0 || irradiance <= 0.0 {
            return Ok(Some(0.0));
        }
        // Sums over S pictures: the variance of their mean is 1/S² of the sum of variances; `pixels` counts S-fold.
        let samples = f64::from(self.samples);
        let mean_square = variance / (pixels * samples);
        Ok(Some(mean_square.sqrt() / (irradiance / pixels)))
    }
}
