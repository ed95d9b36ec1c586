//! Turns a scene, a published frame and a view into a picture on the device; only what changed is done again.

use crate::{
    Gpu, GpuError,
    deferred::Deferred,
    gather::Gather,
    geometry::{self, Geometry},
    layout::FrameUniform,
    openness::Openness,
    owners::Owners,
    present::Present,
    rays::Rays,
    shadow_maps::ShadowMaps,
    sky::SkyOnDevice,
    stages::{Done, Versions},
    targets::Targets,
    textures::Textures,
    timer::Timer,
    vsl_buffer::{Upload, VslBuffer},
};
use glam::Vec3;
use photonstream_protocol::VslFrame;
use photonstream_scene::{Features, Scene, SceneLight};
use photonstream_shading::light::Bounds;

/// A renderer on one device, for one picture at a time.
#[derive(Debug)]
pub struct Renderer {
    pub(crate) gpu: Gpu,
    pub(crate) frame_buffer: wgpu::Buffer,
    pub(crate) frame: FrameUniform,
    pub(crate) present: Option<Present>,
    pub(crate) scene: Option<OnDevice>,
    pub(crate) maps: ShadowMaps,
    pub(crate) sky: SkyOnDevice,
    pub(crate) vsls: VslBuffer,
    pub(crate) deferred: Deferred,
    pub(crate) gather: Gather,
    pub(crate) openness: Option<Openness>,
    pub(crate) rays: Option<Rays>,
    pub(crate) owners: Owners,
    pub(crate) targets: Option<Targets>,
    pub(crate) timer: Timer,
    pub(crate) timed: bool,
    pub(crate) versions: Versions,
    pub(crate) done: Done,
    pub(crate) submissions: u64,
}

/// What is known of the scene that is on the device.
#[derive(Debug)]
pub(crate) struct OnDevice {
    pub(crate) geometry: Geometry,
    pub(crate) textures: Option<Textures>,
    pub(crate) lights: Vec<SceneLight>,
    pub(crate) bounds: Bounds,
    /// Lowest and highest corner of the box around the scene; both the origin in an empty one.
    pub(crate) extent: [Vec3; 2],
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
            sky: SkyOnDevice::new(&gpu),
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

    /// Number of virtual surface lights that shone in the last picture with [`Visibility::ShadowMaps`] and had no shadow
    /// map, because there are 1 024, or as many as the device has layers.
    ///
    /// [`Visibility::ShadowMaps`]: photonstream_scene::Visibility::ShadowMaps
    pub fn unshadowed_vsls(&self) -> u32 {
        self.vsls.shadow_maps.without()
    }

    /// Takes over `scene`: uploads what differs from the last one.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn set_scene(&mut self, scene: &Scene) -> Result<(), GpuError> {
        let (lo, hi) = scene.bvh.bounds();
        let magnitude = lo.abs().max(hi.abs()).max_element();
        let magnitude = if magnitude.is_finite() { magnitude } else { 0.0 };
        self.sky.update(&self.gpu, &scene.lights)?;
        let (geometry, last_textures, changed) = match self.scene.take() {
            None => {
                (Geometry::new(&self.gpu, scene)?, None, geometry::Changed { shape: true, materials: true })
            }
            Some(mut last) => {
                let changed = last.geometry.update(&self.gpu, scene)?;
                if last.lights != scene.lights {
                    self.versions.lights += 1;
                }
                (last.geometry, last.textures, changed)
            }
        };
        let (textures, are_new) = Textures::update(&self.gpu, scene, last_textures);
        let changed = geometry::Changed { shape: changed.shape || are_new, ..changed };
        self.versions.shape += u64::from(changed.shape);
        self.versions.materials += u64::from(changed.materials);
        self.scene = Some(OnDevice {
            geometry,
            textures,
            lights: scene.lights.clone(),
            bounds: scene.bounds,
            extent: if lo.is_finite() && hi.is_finite() { [lo, hi] } else { [Vec3::ZERO; 2] },
            features: scene.features.clone(),
            albedo_max: scene.albedo_max(),
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
        self.versions.vsls +=
            u64::from(upload.complete || upload.records > 0 || upload.patches > 0 || upload.distances > 0);
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
        self.vsls.delivered();
        self.submissions += 1;
    }

    /// A distance in m that no two points of the scene and the eye exceed by much.
    pub(crate) fn extent(&self) -> f32 {
        let scene = self.scene.as_ref().map_or(1.0, |s| {
            s.bounds.radius + (s.bounds.centre - Vec3::from(self.frame.camera.position)).length()
        });
        scene.max(f32::MIN_POSITIVE)
    }

    /// What skipped lights would have added at most, summed over all pixels, in W m⁻² sr⁻¹, or with stochastic culling the
    /// greatest variance in units of ε²; waits for the device.
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
