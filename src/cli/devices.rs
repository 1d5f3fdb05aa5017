//! `caustica devices`.

use std::fmt::Write;

use caustica::{
    Error, Result,
    gpu::{AdapterReport, NO_ADAPTER, adapters},
};

use super::say::print;

/// Lists the adapters, beginning with the default one.
pub fn devices() -> Result<()> {
    let all = adapters();
    if all.is_empty() {
        return Err(Error::Device(NO_ADAPTER.to_string()));
    }
    print(&all.iter().enumerate().map(describe).collect::<String>())
}

fn describe((index, adapter): (usize, &AdapterReport)) -> String {
    let AdapterReport { name, driver, backend, kind, limits, subgroup, unusable, .. } = adapter;
    let mut text = String::new();
    let mut line = |label: &str, value: &str| {
        writeln!(text, "   {label:<26}{value}").expect("a String can be written");
    };
    line("kind", kind);
    line("driver", driver);
    line("backend", backend);
    line("largest storage binding", &mebibytes(limits.max_storage_buffer_binding_size));
    line("largest buffer", &mebibytes(limits.max_buffer_size));
    line("storage buffers a kernel", &limits.max_storage_buffers_per_shader_stage.to_string());
    line("invocations a workgroup", &limits.max_compute_invocations_per_workgroup.to_string());
    line("invocations a subgroup", &subgroup_sizes(*subgroup));
    line("workgroups a dimension", &limits.max_compute_workgroups_per_dimension.to_string());
    match (unusable, index) {
        (Some(why), _) => line("usable", &format!("no: {why}")),
        (None, 0) => line("usable", "yes, the default"),
        (None, _) => line("usable", "yes"),
    }
    format!("{index}: {name}\n{text}")
}

/// Formats the minimum and maximum size, or the one size if both are equal.
fn subgroup_sizes((least, most): (u32, u32)) -> String {
    if least == most { least.to_string() } else { format!("{least} to {most}") }
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", bytes >> 20)
}
