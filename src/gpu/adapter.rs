//! Finding adapters and choosing one.

use super::shaders;
use crate::error::{Error, Result};

/// One adapter of this machine and whether it can be used.
#[derive(Debug)]
pub struct AdapterReport {
    /// Name of the adapter.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Graphics interface, as `Vulkan`.
    pub backend: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    #[doc(hidden)]
    pub limits: wgpu::Limits,
    /// Invocations of the smallest and of the largest subgroup; 0 and 0 without subgroup
    /// operations.
    pub subgroup: (u32, u32),
    /// Why it cannot be used, if so.
    pub unusable: Option<String>,
    pub(super) adapter: wgpu::Adapter,
}

/// All adapters, best first: real GPUs before software, discrete before integrated, usable before
/// others.
#[must_use]
pub fn adapters() -> Vec<AdapterReport> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    // Indirect arguments are written by our own kernels and bounded there; wgpu's checks would cost
    // a kernel each.
    descriptor.flags = wgpu::InstanceFlags::default() - wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
    let instance = wgpu::Instance::new(descriptor);
    let found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let mut reports: Vec<_> = found.into_iter().map(report).collect();
    reports.sort_by_key(|r| (r.unusable.is_some(), rank(r.kind)));
    reports
}

/// The adapter of that name or index, or the best one.
///
/// # Errors
/// [`Error::Device`] if there is none; the message says what to install or which adapters there
/// are.
pub fn choose(wanted: Option<&str>) -> Result<AdapterReport> {
    let mut all = adapters();
    if all.is_empty() {
        return Err(Error::Device(NO_ADAPTER.to_string()));
    }
    let index = match wanted {
        None => Some(0),
        Some(w) => find(&all, w),
    };
    let Some(index) = index else {
        let names: Vec<_> = all.iter().enumerate().map(|(i, a)| format!("{i} {:?}", a.name)).collect();
        let wanted = wanted.unwrap_or_default();
        return Err(Error::Device(format!(
            "no adapter is called '{wanted}'; this machine has the adapters {}",
            names.join(", ")
        )));
    };
    let chosen = all.swap_remove(index);
    match &chosen.unusable {
        Some(why) => Err(Error::Device(format!("adapter {} cannot be used: {why}", chosen.name))),
        None => Ok(chosen),
    }
}

/// Advice where [`adapters`] finds none.
pub const NO_ADAPTER: &str = "no Vulkan, Metal or Direct3D 12 adapter was found; install a driver, or software Vulkan: \
    Debian and Ubuntu `apt install libvulkan1 mesa-vulkan-drivers`, Fedora `dnf install vulkan-loader \
    mesa-vulkan-drivers`, Windows: the graphics driver of the GPU's maker, macOS: 10.15 or later (Metal is built in)";

/// Position of the adapter with that index, or whose name contains the text, whatever the case.
fn find(all: &[AdapterReport], wanted: &str) -> Option<usize> {
    if let Ok(index) = wanted.parse::<usize>() {
        return (index < all.len()).then_some(index);
    }
    all.iter().position(|a| a.name.to_lowercase().contains(&wanted.to_lowercase()))
}

fn rank(kind: &str) -> usize {
    ["discrete", "integrated", "virtual", "software"].iter().position(|k| *k == kind).unwrap_or(4)
}

fn report(adapter: wgpu::Adapter) -> AdapterReport {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete",
        wgpu::DeviceType::IntegratedGpu => "integrated",
        wgpu::DeviceType::VirtualGpu => "virtual",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "other",
    };
    let unusable = missing(&limits, &shaders::needs());
    let subgroup = match adapter.features().contains(wgpu::Features::SUBGROUP) {
        true => (info.subgroup_min_size, info.subgroup_max_size),
        false => (0, 0),
    };
    let unusable = unusable.or_else(|| no_subgroups(subgroup.0));
    let driver = format!("{} {}", info.driver, info.driver_info).trim().to_string();
    let backend = format!("{:?}", info.backend);
    AdapterReport { name: info.name, driver, backend, kind, limits, subgroup, unusable, adapter }
}

/// The limit that some kernel reaches and that is too low, if one is.
fn missing(has: &wgpu::Limits, needs: &wgpu::Limits) -> Option<String> {
    let each = |l: &wgpu::Limits| {
        [
            ("storage buffers per shader stage", l.max_storage_buffers_per_shader_stage),
            ("uniform buffers per shader stage", l.max_uniform_buffers_per_shader_stage),
            ("sampled textures per shader stage", l.max_sampled_textures_per_shader_stage),
            ("bind groups", l.max_bind_groups),
            ("invocations per workgroup", l.max_compute_invocations_per_workgroup),
        ]
    };
    let all = each(has).into_iter().zip(each(needs));
    let mut lacking = all.filter(|((_, has), (_, needed))| has < needed);
    lacking.next().map(|((what, has), (_, needed))| format!("it has {has} {what}, {needed} are needed"))
}

/// Invocations that share what they load; the smallest subgroup that the kernels work with.
pub(super) const NEEDED_SUBGROUP: u32 = 4;

/// Why subgroups of so many invocations, or none at all, do not do.
fn no_subgroups(least: u32) -> Option<String> {
    match least {
        0 => Some("its driver lacks subgroup operations in compute shaders".to_string()),
        1..NEEDED_SUBGROUP => Some(format!("its subgroups may have {least} invocations, {NEEDED_SUBGROUP} are needed")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_limit_that_a_kernel_exceeds_is_named() {
        let needs = shaders::needs();
        assert_eq!(missing(&needs, &needs), None, "control: just enough");
        let less = |change: &dyn Fn(&mut wgpu::Limits) -> &mut u32| {
            let mut has = needs.clone();
            let limit = change(&mut has);
            *limit -= 1;
            let had = *limit;
            missing(&has, &needs).is_some_and(|why| why.contains(&format!("it has {had} ")))
        };
        assert!(less(&|l| &mut l.max_storage_buffers_per_shader_stage));
        assert!(less(&|l| &mut l.max_uniform_buffers_per_shader_stage));
        assert!(less(&|l| &mut l.max_sampled_textures_per_shader_stage));
        assert!(less(&|l| &mut l.max_bind_groups));
        assert!(less(&|l| &mut l.max_compute_invocations_per_workgroup));
    }

    #[test]
    fn small_subgroups_are_refused() {
        assert!(no_subgroups(0).is_some_and(|why| why.contains("lacks subgroup operations")));
        assert!(no_subgroups(2).is_some_and(|why| why.contains("2 invocations")));
        assert!(no_subgroups(4).is_none() && no_subgroups(32).is_none());
    }
}
