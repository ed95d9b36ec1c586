//! Turns a place on a triangle into the reflectance there: the material's albedo times its texture.

use crate::scene::{Object, Scene};
use glam::{Vec2, Vec3};
use photonstream_shading::texture;

/// How finely a texture is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detail {
    /// As finely as it is.
    Finest,
    /// As the light transport does: texels as wide as half the edge of the area that a virtual surface light has on
    /// average, so that a light that few photons hit has the mean of what it covers. Source: METHODS of paper A, §0.4.
    Transport,
    /// Through a window of this width on the surface, m.
    Width(f32),
}

impl Scene {
    /// The reflectance at (u, v) of a triangle, linear RGB in [0, 1].
    #[inline]
    pub fn albedo_at(&self, triangle: u32, uv: [f32; 2], detail: Detail) -> Vec3 {
        let id = self.geometry.object_of[triangle as usize];
        let object = &self.objects[id.0 as usize];
        let material = &self.materials[object.material.0 as usize];
        if material.texture.is_none() {
            return material.albedo;
        }
        self.textured_albedo(object, triangle, uv, detail)
    }

    fn textured_albedo(&self, object: &Object, triangle: u32, [u, v]: [f32; 2], detail: Detail) -> Vec3 {
        let material = &self.materials[object.material.0 as usize];
        let (Some(texture), Some(uvs)) = (&material.texture, self.geometry.uv_triangle(triangle)) else {
            return material.albedo;
        };
        let place = interpolated(uvs, u, v);
        let colour = match detail {
            Detail::Finest => texture.bilinear(place, 0),
            Detail::Transport => texture.bilinear(place, object.transport_level),
            Detail::Width(width_m) => {
                let (width, height) = (texture.layout.width, texture.layout.height);
                let density = texture::density(self.geometry.triangle(triangle), uvs, width, height);
                texture.sample(place, texture::level_of_width(density, width_m))
            }
        };
        material.albedo * colour.truncate()
    }

    /// The largest reflectance that anything in the scene can have.
    pub fn albedo_max(&self) -> f32 {
        let of = |object: &Object| self.materials[object.material.0 as usize].albedo.max_element();
        self.objects.iter().map(of).fold(0.0, f32::max)
    }

    /// The area of all sides that reflect, m².
    pub fn reflecting_area_m2(&self) -> f64 {
        let of = |object: &Object| {
            let corners = object.triangles.clone().map(|t| self.geometry.triangle(t));
            let area: f64 = corners.map(|[a, b, c]| 0.5 * f64::from((b - a).cross(c - a).length())).sum();
            area * object.sides.iter().count() as f64
        };
        self.objects.iter().map(of).sum()
    }

    /// Whether any object has a texture.
    pub fn is_textured(&self) -> bool {
        self.objects.iter().any(|o| self.materials[o.material.0 as usize].texture.is_some())
    }
}

/// The texture coordinates at the barycentric coordinates (u, v).
#[inline]
pub(crate) fn interpolated([a, b, c]: [Vec2; 3], u: f32, v: f32) -> Vec2 {
    a + (b - a) * u + (c - a) * v
}

/// Sets the level at which the transport looks at the textures of each object, for lights of `vsl_area_m2` on average.
///
/// A whole number, and one for all of an object: it does not follow the number of lights while the simulation runs, so
/// that no path has to be traced again for it.
pub(crate) fn choose_levels(scene: &mut Scene, vsl_area_m2: f32) {
    let width_m = 0.5 * vsl_area_m2.sqrt();
    let Scene { objects, materials, geometry, .. } = scene;
    for object in objects {
        let Some(texture) = &materials[object.material.0 as usize].texture else { continue };
        let (mut texels, mut area) = (0.0f64, 0.0f64);
        for triangle in object.triangles.clone() {
            let Some(uvs) = geometry.uv_triangle(triangle) else { break };
            let corners = geometry.triangle(triangle);
            let [a, b, c] = corners;
            let area_here = 0.5 * f64::from((b - a).cross(c - a).length());
            let (width, height) = (texture.layout.width, texture.layout.height);
            let density = f64::from(texture::density(corners, uvs, width, height));
            area += area_here;
            texels += area_here * density * density;
        }
        let density = if area > 0.0 { (texels / area).sqrt() as f32 } else { 0.0 };
        let level = texture::level_of_width(density, width_m).floor() as u32;
        object.transport_level = level.min(texture.layout.levels - 1);
    }
}
