//! Which card is taken.

use wgpu::{AdapterInfo, Backends, DeviceType, Limits};

use crate::failure::GpuError;
use crate::quiet::quietly;

/// Threads of a workgroup, as the shaders have it.
const LANES: u32 = 256;
/// Buffers that the shaders bind.
const BUFFERS: u32 = 8;
/// Memory that a workgroup shares \[bytes\]: a histogram of 60 × 60 counts.
const SHARED: u32 = 16_000;

/// A card, or software that plays one where that will do.
pub(crate) fn choose(software_will_do: bool) -> Result<wgpu::Adapter, GpuError> {
    // OpenGL is left out: it has too few buffers.
    let backends = Backends::VULKAN | Backends::METAL | Backends::DX12;
    let adapters = quietly(|| {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        pollster::block_on(instance.enumerate_adapters(backends))
    });
    let chosen = adapters
        .into_iter()
        .min_by_key(|adapter| rank(adapter.get_info().device_type))
        .ok_or_else(|| {
            GpuError::NoAdapter("no driver for Vulkan, Metal or Direct3D 12 offers one".to_owned())
        })?;
    let info = chosen.get_info();
    let name = described(&info);
    if info.device_type == DeviceType::Cpu {
        if !software_will_do {
            return Err(GpuError::OnlySoftware(name));
        }
        log::warn!(
            "no graphics card found; using the software emulation {name}, which is slower than --compute cpu"
        );
    }
    match lacking(&chosen.limits()) {
        Some(what) => Err(GpuError::TooSmall { name, what }),
        None => Ok(chosen),
    }
}

/// The rank of a kind; the lowest is chosen, the first of equals.
fn rank(kind: DeviceType) -> u8 {
    match kind {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// The card and its API: `NVIDIA H200 (Vulkan)`.
pub(crate) fn described(info: &AdapterInfo) -> String {
    format!("{} ({:?})", info.name, info.backend)
}

/// A requirement of the shaders that a card does not meet.
fn lacking(limits: &Limits) -> Option<String> {
    let needed = [
        ("threads in a workgroup", LANES, limits.max_compute_invocations_per_workgroup),
        ("buffers in a shader", BUFFERS, limits.max_storage_buffers_per_shader_stage),
        ("bytes of workgroup memory", SHARED, limits.max_compute_workgroup_storage_size),
    ];
    let missing = needed.into_iter().find(|(_, needed, there)| there < needed);
    missing.map(|(what, needed, there)| format!("{needed} {what} needed, {there} available"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hardware_comes_before_software_and_a_small_card_says_what_it_lacks() {
        assert!(rank(DeviceType::DiscreteGpu) < rank(DeviceType::IntegratedGpu));
        assert!(rank(DeviceType::IntegratedGpu) < rank(DeviceType::Cpu));
        assert_eq!(lacking(&Limits::default()), None);
        let small = Limits { max_storage_buffers_per_shader_stage: 4, ..Limits::default() };
        assert_eq!(lacking(&small).as_deref(), Some("8 buffers in a shader needed, 4 available"));
    }
}
