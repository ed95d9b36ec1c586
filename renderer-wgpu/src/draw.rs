//! Turns a view into commands for the device: the order of a picture's passes, each done only if something it depends on
//! has changed.

use crate::{
    Gpu, GpuError, PassTime, Renderer, Shadows, Show, View,
    deferred::{DirectKind, Shown as ShownInputs},
    frame::{can_see, frame_uniform},
    gather::{Gathering, Maps},
    openness::Openness,
    rays::{RayInputs, Rays, Traced},
    renderer::OnDevice,
    scope::Scope,
    shadow_views::LightTable,
    stages::Stage,
    targets::Targets,
    textures::Textures,
    vsl_shadow_maps::Surroundings,
};
use glam::Vec3;
use photonstream_renderer::Watch;
use photonstream_scene::Visibility;
use photonstream_shading::Kernel;

/// What a call of [`Renderer::draw`] did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Whether anything was drawn; `false` where the last picture is still right.
    pub redrawn: bool,
    /// Time of each pass, where [`Renderer::set_timed`] asked for it and the device can tell.
    pub passes: Vec<PassTime>,
    /// Objects that the camera may see, if the G-buffer was drawn.
    pub objects_drawn: u32,
    /// Shadow rays to lights.
    pub light_rays: u64,
    /// Shadow rays to virtual surface lights.
    pub vsl_rays: u64,
    /// Shadow maps of virtual surface lights that were drawn.
    pub vsl_maps: u32,
    /// Whether the caller stopped it: the picture is not complete.
    pub stopped: bool,
}

impl Renderer {
    /// Draws `view`, or what of it changed since the last one.
    ///
    /// # Errors
    /// [`GpuError`]: an option out of range or not possible on this device, too large a picture, a failed device.
    pub fn draw(&mut self, view: &View) -> Result<Drawn, GpuError> {
        self.draw_watched(view, Watch::default())
    }

    /// [`Renderer::draw`], which `watch` can stop between two dispatches of shadow rays.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_watched(&mut self, view: &View, watch: Watch<'_>) -> Result<Drawn, GpuError> {
        view.validate()?;
        if view.kernel == Kernel::Patch && self.vsls.lacks_patches {
            return Err(GpuError::Unsupported {
                option: "kernel patch".into(),
                adapter: self.gpu.name(),
                lacks: "polygons: an imported segment brings the lights alone".into(),
                remedy: "choose --kernel disc, or upload the frame",
            });
        }
        self.gpu.check()?;
        let scope = self.gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let result = self.draw_changes(view, watch);
        let result = match pollster::block_on(scope.pop()) {
            None => result,
            Some(error) => Err(GpuError::OutOfMemory {
                what: format!("a picture of {}x{}", view.width, view.height),
                reason: error.to_string(),
            }),
        };
        if result.as_ref().map_or(true, |drawn| drawn.stopped) {
            self.done.forget();
        }
        result
    }

    fn draw_changes(&mut self, view: &View, watch: Watch<'_>) -> Result<Drawn, GpuError> {
        let Some(scene) = &self.scene else { return Ok(Drawn::default()) };
        let size = [view.width, view.height];
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            self.targets = None;
            self.done.forget();
            let targets = Targets::new(&self.gpu, size)?;
            self.gather.resize(&self.gpu, size)?;
            self.targets = Some(targets);
        }
        let Some(targets) = &mut self.targets else { return Ok(Drawn::default()) };
        if !self.done.is_stale(Stage::Output, view, self.versions) {
            return Ok(Drawn::default());
        }
        let frame = frame_uniform(view, scene, self.vsls.count, self.vsls.maps.edge);
        if frame != self.frame {
            self.gpu.queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&frame));
            self.frame = frame;
        }
        self.timer.restart();
        let mut scope = Scope {
            gpu: &self.gpu,
            encoder: self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default()),
            timer: &mut self.timer,
            frame: &self.frame_buffer,
        };
        let holes = scene.textures.as_ref().filter(|textures| textures.holes().is_some());
        let (done, versions) = (&mut self.done, self.versions);
        let mut drawn = Drawn { redrawn: true, ..Drawn::default() };
        let aspect = view.width as f32 / view.height as f32;
        let sees = |centre: Vec3, radius: f32| can_see(&view.camera, aspect, centre, radius);
        if done.is_stale(Stage::GBuffer, view, versions) {
            drawn.objects_drawn = self.deferred.encode_gbuffer(
                &mut scope,
                targets,
                (&scene.geometry, scene.textures.as_ref()),
                sees,
            );
        }
        if view.needs_direct() && done.is_stale(Stage::Direct, view, versions) {
            let with_maps = view.shadows == Shadows::Maps;
            let table = LightTable::new(
                &scene.lights,
                (scene.bounds, scene.extent),
                view.light_samples,
                view.shadows,
                // Triangles with holes are not told by their names alone.
                scene.geometry.is_readable(&self.gpu) && holes.is_none(),
                view.sample,
            );
            let (new_views, _) = self.maps.update(&self.gpu, table);
            if with_maps && (new_views || done.is_stale(Stage::Maps, view, versions)) {
                self.maps.encode(scope.gpu, &mut scope.encoder, (&scene.geometry, holes), scope.timer);
                done.set(Stage::Maps, view, versions);
            }
            if view.shadows == Shadows::Rays {
                let rays = prepared(&mut self.rays, &self.gpu, scene)?;
                let inputs = RayInputs {
                    frame: scope.frame,
                    gbuffer: &targets.gbuffer.view,
                    size,
                    lights: &self.maps.lights,
                    patches: &self.maps.lights,
                    sky: &self.sky,
                    count: scene.lights.len() as u32,
                    sample: view.sample,
                    output: &targets.direct.view,
                    watch,
                };
                let traced =
                    rays.encode_direct(scope.gpu, &mut scope.encoder, &inputs, view.light_samples)?;
                drawn.light_rays = traced.rays;
                drawn.take(traced, "direct light, rays");
            } else {
                let kind = DirectKind::of(&scene.features, with_maps, self.maps.is_named());
                self.deferred.encode_direct(&mut scope, targets, &self.maps, &scene.geometry, kind);
            }
        }
        let lights_needed = view.needs_indirect() || view.needs_owner() || view.show == Show::Discs;
        if lights_needed && done.is_stale(Stage::Unpack, view, versions) {
            self.vsls.encode(&mut scope);
            done.set(Stage::Unpack, view, versions);
        }
        if view.needs_indirect() && done.is_stale(Stage::Indirect, view, versions) {
            let ranged = view.epsilon > 0.0;
            let by_rays = view.by_rays();
            if by_rays && !drawn.stopped {
                if ranged {
                    self.gather.encode_loss(&mut scope, targets, &scene.geometry, &self.vsls);
                }
                let rays = prepared(&mut self.rays, &self.gpu, scene)?;
                let inputs = RayInputs {
                    frame: scope.frame,
                    gbuffer: &targets.gbuffer.view,
                    size,
                    lights: &self.vsls.lights,
                    patches: &self.vsls.patches,
                    sky: &self.sky,
                    count: self.vsls.count,
                    sample: view.sample,
                    output: &targets.indirect.view,
                    watch,
                };
                if view.sample == 0 {
                    rays.restart_noise();
                }
                let traced =
                    rays.encode_indirect(scope.gpu, &mut scope.encoder, &inputs, view.rays_per_pixel)?;
                drawn.vsl_rays = traced.rays;
                drawn.take(traced, "indirect light, rays");
            } else if !by_rays {
                let (accumulation, interleave) = (view.accumulation, view.interleave);
                let listed = ranged || view.show == Show::Tiles;
                let maps = match view.visibility {
                    Visibility::Octahedral if self.vsls.maps.edge > 0 => Maps::Published,
                    Visibility::ShadowMaps if view.draws_maps() => Maps::Drawn,
                    _ => Maps::None,
                };
                if maps == Maps::Drawn {
                    let surroundings = Surroundings::new(versions.shape, scene.bounds, scene.magnitude);
                    let solids = (&scene.geometry, holes);
                    drawn.vsl_maps =
                        self.vsls.draw_shadow_maps(&mut scope, view.shadow_map_px, surroundings, solids)?;
                }
                let gathering = Gathering {
                    accumulation,
                    ranged,
                    interleave,
                    listed,
                    patches: view.kernel == Kernel::Patch,
                    maps,
                };
                self.gather.encode(&mut scope, targets, &scene.geometry, &self.vsls, gathering, sees)?;
            }
            done.set(Stage::Indirect, view, versions);
        }
        let occluded = view.needs_indirect() && view.visibility == Visibility::Ao;
        if occluded && done.is_stale(Stage::Openness, view, versions) {
            self.openness.get_or_insert_with(|| Openness::new(&self.gpu)).encode(&mut scope, targets);
            done.set(Stage::Openness, view, versions);
        }
        if (view.needs_owner() || view.show == Show::Discs) && done.is_stale(Stage::Owners, view, versions) {
            self.owners.update(&self.gpu, self.vsls.mirror(&self.gpu)?, view.show);
            if view.needs_owner() {
                self.owners.encode_owners(&mut scope, targets, &self.vsls);
            }
            done.set(Stage::Owners, view, versions);
        }
        let shown = ShownInputs {
            objects: &scene.geometry.objects,
            indirect: &targets.indirect.view,
            openness: targets.openness.as_ref().filter(|_| occluded).map(|t| &t[1].view),
            owners: targets.owners.as_ref().map(|t| &t[0].view),
            colours: &self.owners.colours,
            tallies: &self.gather.tallies,
            textured: scene.textures.is_some(),
            sky: &self.sky,
        };
        self.deferred.encode_composite(&mut scope, targets, &shown);
        if view.show == Show::Discs {
            self.owners.encode_discs(&mut scope, targets, &self.vsls);
        }
        scope.timer.encode(&mut scope.encoder);
        self.gpu.queue.submit([scope.encoder.finish()]);
        self.submissions += 1;
        self.vsls.delivered();
        done.set(Stage::GBuffer, view, versions);
        if view.needs_direct() {
            done.set(Stage::Direct, view, versions);
        }
        done.set(Stage::Output, view, versions);
        if self.timed {
            drawn.passes.extend(self.timer.read(&self.gpu)?);
        }
        self.gpu.check()?;
        Ok(drawn)
    }
}

impl Drawn {
    fn take(&mut self, traced: Traced, name: &'static str) {
        self.passes.push(PassTime { name, ms: traced.ms });
        self.stopped |= traced.stopped;
    }
}

/// The shadow rays of the scene on the device.
fn prepared<'a>(rays: &'a mut Option<Rays>, gpu: &Gpu, scene: &OnDevice) -> Result<&'a mut Rays, GpuError> {
    let holes = scene.textures.as_ref().and_then(Textures::holes);
    let geometry = &scene.geometry.source;
    match rays {
        Some(rays) => {
            rays.set_geometry(gpu, geometry, holes)?;
            Ok(rays)
        }
        None => Ok(rays.insert(Rays::new(gpu, geometry, holes)?)),
    }
}
