//! Known driver faults.

/// First major version of Mesa's software rasteriser without the faults of [`driver_warning`]. Version 22.3.6 (Debian 12) has all of
/// them; the versions between are untested.
const FIRST_SOUND_MESA: u32 = 24;

/// Maximum number of loop steps of an invocation, over all its loops, on a driver with [`faulty_software`]. The loops then end early,
/// and the invocation continues after them.
pub const FAULTY_LOOP_STEPS: u32 = 65_535;

/// Mesa's major version if the adapter is its software rasteriser.
pub fn software_mesa(adapter: &wgpu::AdapterInfo) -> Option<u32> {
    mesa_of_software(adapter.device_type, &adapter.driver_info)
}

/// True if the adapter is a software rasteriser with the faults that [`driver_warning`] names.
pub fn faulty_software(adapter: &wgpu::AdapterInfo) -> bool {
    software_mesa(adapter).is_some_and(|mesa| mesa < FIRST_SOUND_MESA)
}

/// A sentence for users about the faults of the adapter's driver and the remedy; `None` for a driver without known faults.
pub fn driver_warning(adapter: &wgpu::AdapterInfo) -> Option<String> {
    faulty_software(adapter).then(|| {
        format!(
            "{} is an old software driver: it is slow, has no ray query and no usable anisotropic filtering, ends loops after \
             {FAULTY_LOOP_STEPS} steps (with thousands of lights per pixel, images are too dark; deep images \
             are built in a single pass, with holes), and crashes on deep-image shadows and on indirect light with an \
             environment image, which are refused; install Mesa 25 or later (Debian 12 has it in bookworm-backports)",
            adapter.driver_info
        )
    })
}

fn mesa_of_software(device_type: wgpu::DeviceType, driver: &str) -> Option<u32> {
    let software = device_type == wgpu::DeviceType::Cpu;
    driver.strip_prefix("Mesa ").filter(|_| software)?.split('.').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use wgpu::DeviceType;

    use super::*;

    #[test]
    fn only_mesas_software_rasteriser_has_a_version() {
        for (device_type, driver, mesa) in [
            (DeviceType::Cpu, "Mesa 22.3.6 (LLVM 15.0.6)", Some(22)),
            (DeviceType::Cpu, "Mesa 25.0.7-2 (LLVM 15.0.6)", Some(25)),
            (DeviceType::Cpu, "SwiftShader", None),
            (DeviceType::DiscreteGpu, "Mesa 22.3.6", None),
            (DeviceType::DiscreteGpu, "555.42", None),
        ] {
            assert_eq!(mesa_of_software(device_type, driver), mesa, "{driver}");
        }
    }

    #[test]
    fn only_old_software_drivers_get_a_warning() {
        let adapter = |device_type, driver: &str| wgpu::AdapterInfo {
            driver_info: driver.to_owned(),
            ..wgpu::AdapterInfo::new(device_type, wgpu::Backend::Vulkan)
        };
        let warning = driver_warning(&adapter(DeviceType::Cpu, "Mesa 23.3.1")).expect("a warning");
        for word in
            ["Mesa 23.3.1", "slow", "ray query", "anisotropic", "65535", "deep images", "environment", "Mesa 25"]
        {
            assert!(warning.contains(word), "{word:?} is not in {warning}");
        }
        assert!(!warning.contains('\n'), "one line");
        for (device_type, driver) in [(DeviceType::Cpu, "Mesa 24.0.0"), (DeviceType::IntegratedGpu, "Mesa 22.3.6")] {
            assert_eq!(driver_warning(&adapter(device_type, driver)), None);
        }
    }
}
