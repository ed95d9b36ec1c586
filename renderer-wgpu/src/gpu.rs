//! Turns the machine's adapters into one device that has what the renderer needs, or into the reasons why none has.

use crate::GpuError;
use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

/// Which adapter to take.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AdapterChoice {
    /// Part of the adapter's name, upper and lower case alike; `None`: the most capable one.
    pub name: Option<String>,
    /// Software rasterisers only: the same picture on every machine.
    pub software: bool,
}

/// A device, its queue, and what is known of it.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// What made the adapter, and makes surfaces for it.
    pub instance: wgpu::Instance,
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, driver and kind of the adapter.
    pub info: wgpu::AdapterInfo,
    /// Adapters that were passed over, and why, one sentence each.
    pub passed_over: Vec<String>,
    /// The first error that no scope caught, or the loss of the device.
    failure: Arc<Mutex<Option<GpuError>>>,
}

/// Features without which there is no picture.
const REQUIRED: wgpu::Features = wgpu::Features::empty();

/// Features that are used where they are there: blending of f32 targets for `forward` and `splat`, times of passes.
const OPTIONAL: wgpu::Features = wgpu::Features::FLOAT32_BLENDABLE.union(wgpu::Features::TIMESTAMP_QUERY);

/// Bytes of a block of uniforms: what every device has.
pub const UNIFORM_BLOCK_BYTES: u32 = 64 << 10;

/// Longest wait for the device; software rasterisers take seconds for large pictures.
const WAIT_LIMIT: Duration = Duration::from_secs(600);

impl Gpu {
    /// A device without a window.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] with what was found and why it does not do.
    pub fn headless(choice: &AdapterChoice) -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.flags = instance_flags();
        Self::open(wgpu::Instance::new(descriptor), None, choice, request)
    }

    /// The same, with a device that `request` makes of an adapter, or its reason why it does not.
    #[cfg(all(feature = "import", unix))]
    pub(crate) fn headless_by(
        choice: &AdapterChoice,
        request: impl Fn(&wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), String>,
    ) -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.flags = instance_flags();
        Self::open(wgpu::Instance::new(descriptor), None, choice, request)
    }

    /// A device of `instance` that can show pictures on `surface`.
    ///
    /// # Errors
    /// As [`Gpu::headless`].
    pub fn for_surface(
        instance: wgpu::Instance,
        surface: &wgpu::Surface<'_>,
        choice: &AdapterChoice,
    ) -> Result<Self, GpuError> {
        Self::open(instance, Some(surface), choice, request)
    }

    fn open(
        instance: wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        choice: &AdapterChoice,
        request: impl Fn(&wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), String>,
    ) -> Result<Self, GpuError> {
        // GL is left out: it reads no depth textures and has no float targets here.
        let backends = wgpu::Backends::PRIMARY;
        let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
        adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        let mut passed_over = Vec::new();
        for adapter in adapters {
            let info = adapter.get_info();
            let result = match unsuitable(&adapter, &info, surface, choice) {
                Some(reason) => Err(reason),
                None => request(&adapter),
            };
            match result {
                Ok((device, queue)) => {
                    let failure = watch(&device);
                    return Ok(Self { instance, adapter, device, queue, info, passed_over, failure });
                }
                Err(reason) => passed_over.push(format!("{} ({:?}): {reason}", info.name, info.backend)),
            }
        }
        Err(GpuError::NoAdapter { reasons: passed_over })
    }

    /// Whether this is a software rasteriser.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Name of the adapter with its driver, for reports.
    pub fn name(&self) -> String {
        let info = &self.info;
        match (info.driver.as_str(), info.driver_info.as_str()) {
            ("", "") => info.name.clone(),
            (driver, "") => format!("{}, {driver}", info.name),
            (_, version) => format!("{}, {version}", info.name),
        }
    }

    /// Waits until the device has done all that was submitted.
    ///
    /// # Errors
    /// [`GpuError::TimedOut`], [`GpuError::Lost`], or what went wrong before.
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited =
            self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(WAIT_LIMIT) });
        self.check()?;
        waited.map(|_| ()).map_err(|_| GpuError::TimedOut { seconds: WAIT_LIMIT.as_secs() })
    }

    /// The error that the device has reported since it was opened, if any. A lost device stays lost.
    ///
    /// # Errors
    /// [`GpuError::Lost`], [`GpuError::Device`].
    pub fn check(&self) -> Result<(), GpuError> {
        let failure = self.failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        failure.clone().map_or(Ok(()), Err)
    }
}

/// The release default, and what the environment asks for: debug builds would otherwise turn on validation layers,
/// whose old versions complain about every shader.
pub fn instance_flags() -> wgpu::InstanceFlags {
    wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL.with_env()
}

fn unsuitable(
    adapter: &wgpu::Adapter,
    info: &wgpu::AdapterInfo,
    surface: Option<&wgpu::Surface<'_>>,
    choice: &AdapterChoice,
) -> Option<String> {
    if let Some(name) = &choice.name
        && !info.name.to_lowercase().contains(&name.to_lowercase())
    {
        return Some(format!("its name does not contain \"{name}\""));
    }
    if choice.software && info.device_type != wgpu::DeviceType::Cpu {
        return Some("not a software rasteriser".into());
    }
    let missing = REQUIRED - adapter.features();
    if !missing.is_empty() {
        return Some(format!("it lacks {missing:?}"));
    }
    let limits = adapter.limits();
    let needed = [
        (
            "max_uniform_buffer_binding_size",
            limits.max_uniform_buffer_binding_size,
            u64::from(UNIFORM_BLOCK_BYTES),
        ),
        ("max_storage_buffers_per_shader_stage", limits.max_storage_buffers_per_shader_stage.into(), 7),
        ("max_compute_invocations_per_workgroup", limits.max_compute_invocations_per_workgroup.into(), 64),
        ("max_color_attachment_bytes_per_sample", limits.max_color_attachment_bytes_per_sample.into(), 32),
    ];
    for (name, found, expected) in needed {
        if found < expected {
            return Some(format!("{name} is {found}, expected {expected} or more"));
        }
    }
    for format in [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::Rgba32Uint] {
        let usages = adapter.get_texture_format_features(format).allowed_usages;
        if !usages.contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
            return Some(format!("it cannot render to {format:?}"));
        }
    }
    match surface {
        Some(surface) if !adapter.is_surface_supported(surface) => Some("it cannot show this window".into()),
        _ => None,
    }
}

fn request(adapter: &wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), String> {
    pollster::block_on(adapter.request_device(&descriptor(adapter))).map_err(|error| error.to_string())
}

/// What is asked of a device of `adapter`: all optional features that it has, and all its limits.
pub(crate) fn descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("photonstream"),
        required_features: REQUIRED | (OPTIONAL & adapter.features()),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    }
}

/// Keeps the first failure of `device` that nobody caught, instead of a panic.
fn watch(device: &wgpu::Device) -> Arc<Mutex<Option<GpuError>>> {
    let failure = Arc::new(Mutex::new(None));
    let keep = |failure: &Mutex<Option<GpuError>>, error: GpuError| {
        let mut first = failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        tracing::error!("{error}");
        first.get_or_insert(error);
    };
    let kept = Arc::clone(&failure);
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        keep(&kept, GpuError::Device { reason: error.to_string() });
    }));
    let kept = Arc::clone(&failure);
    device.set_device_lost_callback(move |reason, message| {
        if reason != wgpu::DeviceLostReason::Destroyed {
            keep(&kept, GpuError::Lost { reason: message });
        }
    });
    failure
}
