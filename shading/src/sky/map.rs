//! Turns an equirectangular picture of radiances into a sky of texels that are drawn by radiance times solid angle.
//!
//! Source: Pharr, Jakob & Humphreys, PBRT 4th ed., §A.5.6 and §12.5 (piecewise-constant 2D distributions); deviates: radiance
//! is constant in a texel, so that the density is exactly proportional to it.

use super::{SkySample, relative};
use crate::sampling::sin_cos_turn;
use core::f32::consts::{PI, TAU};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// A picture of the whole sphere, relative to its mean; copies share it.
#[derive(Clone, Debug)]
pub struct SkyMap {
    width: u32,
    height: u32,
    /// Relative radiance of each texel, row by row, and the share of its row that ends with it.
    texels: Arc<[[f32; 4]]>,
    /// The share of the whole that ends with each row.
    rows: Arc<[f32]>,
}

impl PartialEq for SkyMap {
    fn eq(&self, other: &Self) -> bool {
        let is_shared = Arc::ptr_eq(&self.texels, &other.texels);
        (self.width, self.height) == (other.width, other.height) && (is_shared || self.texels == other.texels)
    }
}

impl SkyMap {
    /// Mean radiance over the sphere.
    pub(super) fn mean(width: u32, height: u32, texels: &[[f32; 3]]) -> DVec3 {
        assert!(!texels.is_empty() && texels.len() as u64 == u64::from(width) * u64::from(height), "texels");
        let rows = (0..height).zip(texels.chunks_exact(width as usize));
        rows.map(|(row, texels)| {
            let sum: DVec3 = texels.iter().map(|&t| Vec3::from(t).as_dvec3()).sum();
            sum * (share(row, height) / f64::from(width))
        })
        .sum()
    }

    pub(super) fn new(width: u32, height: u32, texels: &[[f32; 3]], mean: DVec3, channels: f32) -> Self {
        let mut out = Vec::with_capacity(texels.len());
        let mut rows = Vec::with_capacity(height as usize);
        let mut total = 0.0;
        for (row, texels) in (0..height).zip(texels.chunks_exact(width as usize)) {
            let relative = |t: [f32; 3]| relative(Vec3::from(t).as_dvec3(), mean);
            let importance = |t: Vec3| f64::from(t.element_sum() / channels);
            let sum: f64 = texels.iter().map(|&t| importance(relative(t))).sum();
            let mut running = 0.0;
            for &texel in texels {
                let texel = relative(texel);
                running += importance(texel);
                let end = if sum > 0.0 { (running / sum) as f32 } else { 1.0 };
                out.push([texel.x, texel.y, texel.z, end]);
            }
            total += sum / f64::from(width) * share(row, height);
            rows.push(total);
        }
        // The mean importance is 1 but for rounding.
        let rows = rows.into_iter().map(|end| (end / total) as f32).collect();
        Self { width, height, texels: out.into(), rows }
    }

    /// Texels around.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Texels from zenith to nadir.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Relative radiance of each texel, row by row, and the share of its row's importance that ends with it.
    pub fn texels(&self) -> &[[f32; 4]] {
        &self.texels
    }

    /// The share of all importance that ends with each row.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    fn texel(&self, column: u32, row: u32) -> Vec3 {
        let [r, g, b, _] = self.texels[row as usize * self.width as usize + column as usize];
        Vec3::new(r, g, b)
    }

    #[inline]
    pub(super) fn relative(&self, wi: Vec3, turn: f32) -> Vec3 {
        let around = 0.5 + wi.x.atan2(-wi.z) / TAU + turn;
        let down = wi.x.hypot(wi.z).atan2(wi.y) / PI;
        let column = ((around - around.floor()) * self.width as f32) as u32;
        let row = (down * self.height as f32) as u32;
        self.texel(column.min(self.width - 1), row.min(self.height - 1))
    }

    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], turn: f32) -> SkySample {
        let row = self.rows.partition_point(|&end| end <= u[0]).min(self.height as usize - 1);
        let texels = &self.texels[row * self.width as usize..][..self.width as usize];
        let column = texels.partition_point(|texel| texel[3] <= u[1]).min(self.width as usize - 1);
        let row_before = if row == 0 { 0.0 } else { self.rows[row - 1] };
        let column_before = if column == 0 { 0.0 } else { texels[column - 1][3] };
        let within_row = within(u[0], row_before, self.rows[row]);
        let within_column = within(u[1], column_before, texels[column][3]);
        // Counted from the nearer pole, whose versines f32 tells apart.
        let is_upper = 2 * row < self.height as usize;
        let from_pole = if is_upper { row } else { self.height as usize - 1 - row };
        let half_versine = |edge: f32| {
            let (sin, _) = sin_cos_turn(edge / (4.0 * self.height as f32));
            sin * sin
        };
        let (first, last) = (half_versine(from_pole as f32), half_versine(from_pole as f32 + 1.0));
        let half = first + (last - first) * within_row;
        let y = if is_upper { 1.0 - 2.0 * half } else { 2.0 * half - 1.0 };
        let radius = 2.0 * (half * (1.0 - half)).max(0.0).sqrt();
        let around = (column as f32 + within_column) / self.width as f32;
        let azimuth = around - 0.5 - turn;
        let (sin, cos) = sin_cos_turn(azimuth - azimuth.floor());
        let wi = Vec3::new(radius * sin, y, -radius * cos);
        SkySample { wi, relative: self.texel(column as u32, row as u32) }
    }
}

/// Where `u` lies between two shares, from 0 to 1.
#[inline]
fn within(u: f32, from: f32, to: f32) -> f32 {
    if to > from { ((u - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 }
}

/// Solid angle of a row over 4π.
fn share(row: u32, height: u32) -> f64 {
    let half_versine =
        |edge: u32| (f64::from(edge) * 0.5 * std::f64::consts::PI / f64::from(height)).sin().powi(2);
    half_versine(row + 1) - half_versine(row)
}
