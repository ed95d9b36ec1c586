//! Turns a map's pages into a buffer of a Vulkan device; the only module of this crate with `unsafe`.
#![allow(unsafe_code)]
//! Why unsafe is needed, and why it is sound:
//! - wgpu's safe interface neither enables `VK_EXT_external_memory_host` nor imports pages. Both go through its `hal`, whose
//!   functions are unsafe because the caller has to keep Vulkan's rules.
//! - The pages are those of a subscriber's map: page-aligned, as long as imported, and alive until the device's buffer is
//!   gone, for the buffer's end owns a share of the map.
//! - Nothing of the pages is ever referenced from here, and the buffer is never mapped by wgpu. The device only reads it
//!   (`COPY_SRC`, `STORAGE` read by shaders): the map is read-only.
//! - Another process writes the pages while the device may read them. For the device that is memory whose content is not
//!   known, not undefined behaviour of this process: it copies plain bytes, and what was torn is dropped by the sequence
//!   that `MappedSegment::holds` reads again.

use crate::{Gpu, GpuError};
use ash::{ext::external_memory_host, vk};
use photonstream_protocol::MappedSegment;
use wgpu::hal::api::Vulkan;

const PAGES: vk::ExternalMemoryHandleTypeFlags = vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT;

/// A device of `adapter` with the extension, or why not.
pub(super) fn request(adapter: &wgpu::Adapter) -> Result<(wgpu::Device, wgpu::Queue), String> {
    let descriptor = crate::gpu::descriptor(adapter);
    let open = {
        // SAFETY: the adapter behind the guard is only asked, and used to open a device; nothing of it is destroyed.
        let hal = unsafe { adapter.as_hal::<Vulkan>() }.ok_or("segments are imported by Vulkan alone")?;
        if !hal.physical_device_capabilities().supports_extension(external_memory_host::NAME) {
            return Err("it lacks VK_EXT_external_memory_host".into());
        }
        let (features, limits) = (descriptor.required_features, &descriptor.required_limits);
        let enable: Box<wgpu::hal::vulkan::CreateDeviceCallback<'_>> =
            Box::new(|arguments| arguments.extensions.push(external_memory_host::NAME));
        // SAFETY: features and limits are those that the adapter offers; the callback adds one extension, which the adapter
        // has, and removes nothing.
        unsafe { hal.open_with_callback(features, limits, &descriptor.memory_hints, Some(enable)) }
            .map_err(|error| error.to_string())?
    };
    // SAFETY: `open` was just opened from this adapter, with the features of the same descriptor.
    unsafe { adapter.create_device_from_hal::<Vulkan>(open, &descriptor) }.map_err(|error| error.to_string())
}

/// The pages of `segment` as a buffer to copy and read from.
pub(super) fn import(gpu: &Gpu, segment: &MappedSegment) -> Result<wgpu::Buffer, GpuError> {
    let bytes = segment.bytes();
    let buffer = {
        // SAFETY: the device behind the guard is used while the guard lives, and not destroyed.
        let hal = unsafe { gpu.device.as_hal::<Vulkan>() }.ok_or_else(|| lacks(gpu, "Vulkan"))?;
        if !hal.enabled_device_extensions().contains(&external_memory_host::NAME) {
            return Err(lacks(gpu, "VK_EXT_external_memory_host (open the device with it)"));
        }
        check_alignment(gpu, &hal, segment)?;
        let device = hal.raw_device().clone();
        let raw = Raw {
            buffer: create_buffer(&device, bytes)?,
            memory: vk::DeviceMemory::null(),
            device,
            _pages: segment.clone(),
        };
        let raw = bind(gpu, &hal, raw, segment)?;
        let handle = raw.buffer;
        // SAFETY: the handle is a buffer of this device that lives until wgpu has no more use for it: then wgpu drops the
        // closure, and `raw` with it. wgpu is told no usage by which it would map the buffer.
        unsafe { wgpu::hal::vulkan::Buffer::from_raw_externally_owned(handle, Box::new(move || drop(raw))) }
    };
    let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::STORAGE;
    let label = Some("imported segment");
    let descriptor = wgpu::BufferDescriptor { label, size: bytes, usage, mapped_at_creation: false };
    // SAFETY: the buffer was made on this device, with this size, which is not zero, and these usages; its pages hold what
    // the publisher has written, so they are initialised.
    Ok(unsafe { gpu.device.create_buffer_from_hal::<Vulkan>(buffer, &descriptor) })
}

/// A buffer over pages of the CPU, and a share of the map that they belong to.
struct Raw {
    device: ash::Device,
    buffer: vk::Buffer,
    /// Null until pages are bound.
    memory: vk::DeviceMemory,
    /// Dropped after the buffer and its memory are gone.
    _pages: MappedSegment,
}

impl Drop for Raw {
    fn drop(&mut self) {
        // SAFETY: the buffer was created by this device, is destroyed here alone, and the device has no more use for it:
        // either it never had, or wgpu has waited for what used it. The device is alive, for wgpu drops its buffers first.
        unsafe { self.device.destroy_buffer(self.buffer, None) };
        // SAFETY: as above; null is allowed. Freeing imported memory leaves the pages as they are.
        unsafe { self.device.free_memory(self.memory, None) };
    }
}

fn create_buffer(device: &ash::Device, bytes: u64) -> Result<vk::Buffer, GpuError> {
    let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(PAGES);
    let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::STORAGE_BUFFER;
    let info = vk::BufferCreateInfo::default().size(bytes).usage(usage).push_next(&mut external);
    // SAFETY: the structure and its chain are complete, live to the end of the call, and the size is not zero.
    unsafe { device.create_buffer(&info, None) }.map_err(|error| driver("create a buffer", error))
}

fn bind(
    gpu: &Gpu,
    hal: &wgpu::hal::vulkan::Device,
    mut raw: Raw,
    segment: &MappedSegment,
) -> Result<Raw, GpuError> {
    let address = segment.address().cast_mut().cast();
    let extension = external_memory_host::Device::new(hal.shared_instance().raw_instance(), &raw.device);
    let query = extension.fp().get_memory_host_pointer_properties_ext;
    let mut pages = vk::MemoryHostPointerPropertiesEXT::default();
    // SAFETY: the extension is enabled on this device, so the function is loaded; the address is that of a live map, and the
    // result is written to a structure of the right type.
    let result = unsafe { query(raw.device.handle(), PAGES, address, &mut pages) };
    result.result().map_err(|error| driver("look at the segment's pages", error))?;
    // SAFETY: the buffer is one of this device.
    let needs = unsafe { raw.device.get_buffer_memory_requirements(raw.buffer) };
    let types = pages.memory_type_bits & needs.memory_type_bits;
    if types == 0 || needs.size > segment.bytes() {
        return Err(lacks(gpu, "a kind of memory that takes the segment's pages"));
    }
    let mut import = vk::ImportMemoryHostPointerInfoEXT::default().handle_type(PAGES).host_pointer(address);
    let info = vk::MemoryAllocateInfo::default()
        .allocation_size(segment.bytes())
        .memory_type_index(types.trailing_zeros())
        .push_next(&mut import);
    // SAFETY: address and size are aligned as the device asks (`check_alignment`), the pages are alive as long as `raw`, and
    // the memory type is one that the driver named for them.
    raw.memory = unsafe { raw.device.allocate_memory(&info, None) }
        .map_err(|error| driver("import the segment's pages", error))?;
    // SAFETY: buffer and memory are of this device, neither is bound yet, the type suits the buffer and its size fits.
    unsafe { raw.device.bind_buffer_memory(raw.buffer, raw.memory, 0) }
        .map_err(|error| driver("bind the segment's pages", error))?;
    Ok(raw)
}

fn check_alignment(
    gpu: &Gpu,
    hal: &wgpu::hal::vulkan::Device,
    segment: &MappedSegment,
) -> Result<(), GpuError> {
    if hal.shared_instance().instance_api_version() < vk::API_VERSION_1_1 {
        return Err(lacks(gpu, "Vulkan 1.1"));
    }
    let mut host = vk::PhysicalDeviceExternalMemoryHostPropertiesEXT::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut host);
    let instance = hal.shared_instance().raw_instance();
    // SAFETY: the physical device belongs to this instance, which is of Vulkan 1.1 or later, so the function is there; the
    // chain holds a structure of an extension that the device has.
    unsafe { instance.get_physical_device_properties2(hal.raw_physical_device(), &mut properties) };
    let alignment = host.min_imported_host_pointer_alignment.max(1);
    let aligned = |value: u64| value.is_multiple_of(alignment);
    if aligned(segment.address().addr() as u64) && aligned(segment.bytes()) {
        return Ok(());
    }
    Err(lacks(gpu, &format!("import of pages of less than {alignment} bytes")))
}

fn lacks(gpu: &Gpu, what: &str) -> GpuError {
    GpuError::Unsupported {
        option: "import".into(),
        adapter: gpu.name(),
        lacks: what.into(),
        remedy: "upload the records instead",
    }
}

fn driver(what: &str, error: vk::Result) -> GpuError {
    GpuError::Device { reason: format!("could not {what}: {error}") }
}
