//! Turns a scene, a published frame and a view into a picture on the device; only what changed is done again.

use crate::{
    Gpu, GpuError, PassTime, Shadows, Show, View,
    deferred::{Deferred, DirectKind, Shown as ShownInputs},
    frame::{can_see, frame_uniform},
    gather::{Gather, Gathering},
    geometry::{self, Geometry},
    layout::FrameUniform,
    openness::Openness,
    owners::Owners,
    present::Present,
    rays::{RayInputs, Rays, Traced},
    scope::Scope,
    shadow_maps::ShadowMaps,
    shadow_views::LightTable,
    stages::{Done, Stage, Versions},
    targets::Targets,
    timer::Timer,
    vsl_buffer::{Upload, VslBuffer},
};
use glam::Vec3;
use photonstream_protocol::VslFrame;
use photonstream_renderer::Watch;
use photonstream_scene::{Features, Scene, SceneLight, Visibility};
use photonstream_shading::light::Bounds;

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
    /// Whether the caller stopped it: the picture is not complete.
    pub stopped: bool,
}

/// A renderer on one device, for one picture at a time.
#[derive(Debug)]
pub struct Renderer {
    pub(crate) gpu: Gpu,
    frame_buffer: wgpu::Buffer,
    pub(crate) frame: FrameUniform,
    pub(crate) present: Option<Present>,
    scene: Option<OnDevice>,
    maps: ShadowMaps,
    vsls: VslBuffer,
    deferred: Deferred,
    gather: Gather,
    openness: Option<Openness>,
    rays: Option<Rays>,
    owners: Owners,
    pub(crate) targets: Option<Targets>,
    timer: Timer,
    timed: bool,
    versions: Versions,
    done: Done,
    submissions: u64,
}

/// What is known of the scene that is on the device.
#[derive(Debug)]
pub(crate) struct OnDevice {
    geometry: Geometry,
    pub(crate) lights: Vec<SceneLight>,
    pub(crate) bounds: Bounds,
    pub(crate) features: Features,
    pub(crate) albedo_max: f32,
    pub(crate) magnitude: f32,
}

impl Renderer {
    /// A renderer on `gpu`, without a scene.
    ///
    /// # Errors
    /// [`GpuError::Device`] if a shader is refused.
    pub fn new(gpu: Gpu) -> Result<Self, GpuError> {
        let frame_bytes = size_of::<FrameUniform>() as u64;
        let frame_buffer = geometry::buffer(&gpu, "frame", frame_bytes, wgpu::BufferUsages::UNIFORM);
        let renderer = Self {
            frame_buffer,
            frame: FrameUniform::default(),
            present: None,
            scene: None,
            maps: ShadowMaps::new(&gpu),
            vsls: VslBuffer::new(&gpu),
            deferred: Deferred::new(&gpu),
            gather: Gather::new(&gpu),
            openness: None,
            rays: None,
            owners: Owners::new(&gpu),
            targets: None,
            timer: Timer::new(&gpu),
            timed: false,
            versions: Versions::default(),
            done: Done::default(),
            submissions: 0,
            gpu,
        };
        renderer.gpu.check()?;
        Ok(renderer)
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Whether [`Renderer::draw`] waits for the device and tells the time of each pass.
    pub fn set_timed(&mut self, timed: bool) {
        self.timed = timed;
    }

    /// Number of times that work was given to the device.
    pub fn submissions(&self) -> u64 {
        self.submissions
    }

    /// Number of lights without shadows, because a scene may have 256 shadow maps.
    pub fn unshadowed_lights(&self) -> u32 {
        self.maps.unshadowed()
    }

    /// Takes over `scene`: uploads what differs from the last one.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn set_scene(&mut self, scene: &Scene) -> Result<(), GpuError> {
        let albedo =
            |o: &photonstream_scene::Object| scene.materials[o.material.0 as usize].albedo.max_element();
        let (lo, hi) = scene.bvh.bounds();
        let magnitude = lo.abs().max(hi.abs()).max_element();
        let albedo_max = scene.objects.iter().map(albedo).fold(0.0, f32::max);
        let magnitude = if magnitude.is_finite() { magnitude } else { 0.0 };
        let (geometry, changed) = match self.scene.take() {
            None => (Geometry::new(&self.gpu, scene)?, geometry::Changed { shape: true, materials: true }),
            Some(mut last) => {
                let changed = last.geometry.update(&self.gpu, scene)?;
                if last.lights != scene.lights {
                    self.versions.lights += 1;
                }
                (last.geometry, changed)
            }
        };
        self.versions.shape += u64::from(changed.shape);
        self.versions.materials += u64::from(changed.materials);
        self.scene = Some(OnDevice {
            geometry,
            lights: scene.lights.clone(),
            bounds: scene.bounds,
            features: scene.features.clone(),
            albedo_max,
            magnitude,
        });
        Ok(())
    }

    /// Takes over the lights of `frame`: uploads the records that changed since the last one.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn set_frame(&mut self, frame: &VslFrame) -> Result<Upload, GpuError> {
        let upload = self.vsls.update(&self.gpu, frame)?;
        self.versions.vsls += u64::from(upload.complete || upload.records > 0);
        Ok(upload)
    }

    /// Takes over the records of an imported segment, which never were in this process's memory.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    #[cfg(all(feature = "import", unix))]
    pub fn set_imported(&mut self, segment: &crate::ImportedSegment) -> Result<(), GpuError> {
        self.vsls.take(&self.gpu, segment.records(), segment.count())?;
        self.versions.vsls += 1;
        Ok(())
    }

    /// Gives the device at once what [`Renderer::set_frame`] left for the next picture.
    pub fn flush(&mut self) {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.vsls.flush(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.submissions += 1;
    }

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
        self.gpu.check()?;
        let result = self.draw_changes(view, watch);
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
            self.targets = Some(Targets::new(&self.gpu, size)?);
            self.gather.resize(&self.gpu, size)?;
        }
        let Some(targets) = &mut self.targets else { return Ok(Drawn::default()) };
        if !self.done.is_stale(Stage::Output, view, self.versions) {
            return Ok(Drawn::default());
        }
        let frame = frame_uniform(view, scene, self.vsls.count);
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
        let (done, versions) = (&mut self.done, self.versions);
        let mut drawn = Drawn { redrawn: true, ..Drawn::default() };
        let aspect = view.width as f32 / view.height as f32;
        let sees = |centre: Vec3, radius: f32| can_see(&view.camera, aspect, centre, radius);
        if done.is_stale(Stage::GBuffer, view, versions) {
            drawn.objects_drawn = self.deferred.encode_gbuffer(&mut scope, targets, &scene.geometry, sees);
        }
        if view.needs_direct() && done.is_stale(Stage::Direct, view, versions) {
            let with_maps = view.shadows == Shadows::Maps;
            let table = LightTable::new(&scene.lights, scene.bounds, view.light_samples, with_maps);
            let (new_views, _) = self.maps.update(&self.gpu, table);
            if with_maps && (new_views || done.is_stale(Stage::GBuffer, view, versions)) {
                self.maps.encode(scope.gpu, &mut scope.encoder, &scene.geometry, scope.timer);
            }
            if view.shadows == Shadows::Rays {
                let rays = prepared(&mut self.rays, &self.gpu, &scene.geometry)?;
                let inputs = RayInputs {
                    frame: scope.frame,
                    gbuffer: &targets.gbuffer.view,
                    size,
                    lights: &self.maps.lights,
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
                let kind = DirectKind::of(&scene.features, with_maps);
                self.deferred.encode_direct(&mut scope, targets, &self.maps, kind);
            }
        }
        let lights_needed = view.needs_indirect() || view.needs_owner() || view.show == Show::Discs;
        if lights_needed && done.is_stale(Stage::Unpack, view, versions) {
            self.vsls.encode(scope.gpu, &mut scope.encoder, scope.frame);
            done.set(Stage::Unpack, view, versions);
        }
        if view.needs_indirect() && done.is_stale(Stage::Indirect, view, versions) {
            let ranged = view.epsilon > 0.0;
            let by_rays = view.visibility == Visibility::Rays;
            if by_rays && !drawn.stopped {
                if ranged {
                    self.gather.encode_loss(&mut scope, targets, &scene.geometry, &self.vsls);
                }
                let rays = prepared(&mut self.rays, &self.gpu, &scene.geometry)?;
                let inputs = RayInputs {
                    frame: scope.frame,
                    gbuffer: &targets.gbuffer.view,
                    size,
                    lights: &self.vsls.lights,
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
                let gathering = Gathering { accumulation, ranged, interleave };
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
        };
        self.deferred.encode_composite(&mut scope, targets, &shown);
        if view.show == Show::Discs {
            self.owners.encode_discs(&mut scope, targets, &self.vsls);
        }
        scope.timer.encode(&mut scope.encoder);
        self.gpu.queue.submit([scope.encoder.finish()]);
        self.submissions += 1;
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

    /// A distance in m that no two points of the scene and the eye exceed by much.
    pub(crate) fn extent(&self) -> f32 {
        let scene = self.scene.as_ref().map_or(1.0, |s| {
            s.bounds.radius + (s.bounds.centre - Vec3::from(self.frame.camera.position)).length()
        });
        scene.max(f32::MIN_POSITIVE)
    }

    /// What skipped lights would have added at most, summed over all pixels, in W m⁻² sr⁻¹; waits for the device.
    pub(crate) fn skipped(&self) -> Result<f64, GpuError> {
        self.gather.skipped(&self.gpu)
    }

    /// Standard error of the indirect light of the last picture as rel. RMSE, where shadow rays went to some of the
    /// virtual surface lights only: 0 where they went to all, `None` where there were no rays or one for each pixel.
    ///
    /// # Errors
    /// A failed device.
    pub fn noise(&self) -> Result<Option<f64>, GpuError> {
        self.rays.as_ref().map_or(Ok(None), |rays| rays.noise(&self.gpu))
    }

    /// Number of published records that are not shown because a value is not finite, negative or beyond all reason;
    /// waits for the device.
    ///
    /// # Errors
    /// A failed device.
    pub fn refused_records(&self) -> Result<u32, GpuError> {
        self.vsls.refused(&self.gpu)
    }
}

impl Drawn {
    fn take(&mut self, traced: Traced, name: &'static str) {
        self.passes.push(PassTime { name, ms: traced.ms });
        self.stopped |= traced.stopped;
    }
}

/// The shadow rays of the scene on the device.
fn prepared<'a>(
    rays: &'a mut Option<Rays>,
    gpu: &Gpu,
    geometry: &Geometry,
) -> Result<&'a mut Rays, GpuError> {
    let rays = rays.get_or_insert_with(|| Rays::new(gpu));
    rays.set_geometry(gpu, &geometry.source)?;
    Ok(rays)
}
