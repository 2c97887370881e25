//! Which graphics adapter draws the window.

use std::sync::Arc;

use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};

/// How the window's adapter and device are chosen, of those that these backends have.
///
/// Every limit is the adapter's own: what OpenGL or an old card cannot do is found out by asking it.
pub(super) fn configuration(backends: wgpu::Backends) -> WgpuConfiguration {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.instance_descriptor.backends &= backends;
    let preference = setup.power_preference;
    setup.native_adapter_selector = Some(Arc::new(move |adapters, surface| {
        let can_show = |adapter: &&wgpu::Adapter| {
            surface.is_none_or(|surface| adapter.is_surface_supported(surface))
        };
        let chosen = adapters
            .iter()
            .filter(can_show)
            .min_by_key(|adapter| rank(&adapter.get_info(), preference))
            .ok_or_else(|| match adapters {
                [] => "none was found".to_owned(),
                _ => "none of those found can draw on this display".to_owned(),
            })?;
        if let Some(words) = remark(&chosen.get_info()) {
            log::warn!("{words}");
        }
        Ok(chosen.clone())
    }));
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("posescope"),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    });
    WgpuConfiguration { wgpu_setup: WgpuSetup::CreateNew(setup), ..WgpuConfiguration::default() }
}

/// The lowest is taken, of equals the first: hardware before software, then anything before OpenGL,
/// then the kind of card that is preferred.
fn rank(info: &wgpu::AdapterInfo, preference: wgpu::PowerPreference) -> (bool, bool, u8) {
    let kinds = match preference {
        wgpu::PowerPreference::LowPower => {
            [wgpu::DeviceType::IntegratedGpu, wgpu::DeviceType::DiscreteGpu]
        }
        wgpu::PowerPreference::HighPerformance | wgpu::PowerPreference::None => {
            [wgpu::DeviceType::DiscreteGpu, wgpu::DeviceType::IntegratedGpu]
        }
    };
    let kind =
        (0..).zip(kinds).find_map(|(place, kind)| (info.device_type == kind).then_some(place));
    (
        info.device_type == wgpu::DeviceType::Cpu,
        info.backend == wgpu::Backend::Gl,
        kind.unwrap_or(2),
    )
}

/// What to say of an adapter that is not the best there could be.
fn remark(info: &wgpu::AdapterInfo) -> Option<String> {
    (info.backend == wgpu::Backend::Gl).then(|| {
        format!(
            "no Vulkan driver for this display: the window is drawn with OpenGL ({}), which may be \
             slower",
            info.name
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::{Backend, DeviceType, PowerPreference};

    #[test]
    fn hardware_comes_first_then_vulkan_then_opengl() {
        let adapters = [
            (DeviceType::Cpu, Backend::Gl),
            (DeviceType::Cpu, Backend::Vulkan),
            (DeviceType::Other, Backend::Gl),
            (DeviceType::IntegratedGpu, Backend::Vulkan),
            (DeviceType::DiscreteGpu, Backend::Gl),
            (DeviceType::VirtualGpu, Backend::Vulkan),
            (DeviceType::DiscreteGpu, Backend::Vulkan),
        ];
        let order = |preference| {
            let mut infos: Vec<_> =
                adapters.map(|(kind, backend)| wgpu::AdapterInfo::new(kind, backend)).into();
            infos.sort_by_key(|info| rank(info, preference));
            infos.iter().map(|info| (info.device_type, info.backend)).collect::<Vec<_>>()
        };
        let fast = order(PowerPreference::HighPerformance);
        let [dedicated, built_in] = [DeviceType::DiscreteGpu, DeviceType::IntegratedGpu];
        assert_eq!(fast[0], (dedicated, Backend::Vulkan));
        assert_eq!(fast[1], (built_in, Backend::Vulkan));
        assert_eq!(fast[2], (DeviceType::VirtualGpu, Backend::Vulkan));
        assert_eq!(fast[3], (dedicated, Backend::Gl));
        assert_eq!(fast[5], (DeviceType::Cpu, Backend::Vulkan));
        assert_eq!(fast[6], (DeviceType::Cpu, Backend::Gl));
        let thrifty = order(PowerPreference::LowPower);
        assert_eq!(thrifty[0], (built_in, Backend::Vulkan));
    }

    #[test]
    fn only_opengl_is_worth_a_remark() {
        let info = |backend| wgpu::AdapterInfo::new(DeviceType::Cpu, backend);
        assert_eq!(remark(&info(Backend::Vulkan)), None);
        let said = remark(&info(Backend::Gl)).expect("is said");
        assert!(said.contains("OpenGL") && !said.contains('\n'), "{said}");
    }
}
