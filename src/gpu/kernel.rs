//! A kernel, its bindings by name, and dispatches.

use std::sync::Arc;

use super::{
    Buffer, Commands, Gpu, Table,
    chunks::CHUNK_GROUP,
    program::Program,
    shaders::{SHADERS, Shader, shader},
};

/// A compute kernel. Equal kernels share one compiled program.
#[derive(Clone, Debug)]
pub struct Kernel {
    program: Arc<Program>,
    /// Tables that its dispatches read, by the names of the shader's variables.
    tables: Vec<(&'static str, Table)>,
}

/// The buffers of one dispatch, one bind group per group that the kernel uses.
#[derive(Debug)]
pub struct Bindings(Vec<(u32, wgpu::BindGroup)>);

impl Kernel {
    /// The kernel `stem`, which other threads begin to compile. `overrides` sets its `override`
    /// constants; names that only other kernels have are ignored, so that one list serves several
    /// kernels.
    ///
    /// # Panics
    /// If no kernel has that stem, or none a constant of one of the names.
    #[must_use]
    pub fn new(gpu: &Gpu, stem: &str, overrides: &[(&str, f64)]) -> Self {
        Self::of(gpu, shader(stem), overrides)
    }

    /// The kernel of an entry of another table of shaders: the probes of the tests.
    #[doc(hidden)]
    #[must_use]
    pub fn of(gpu: &Gpu, shader: &'static Shader, overrides: &[(&str, f64)]) -> Self {
        for (name, _) in overrides {
            let is_known = SHADERS.iter().chain([shader]).any(|s| s.overrides.contains(name));
            assert!(is_known, "{}: no kernel has an override {name}", shader.stem);
        }
        let flag = |is: bool| f64::from(u8::from(is));
        let of_device = [
            ("LANES", f64::from(gpu.lanes.group)),
            ("HAS_SEVERAL_GROUPS", flag(gpu.lanes.several_groups)),
            ("PACKET_LANES", f64::from(gpu.lanes.of_packet)),
            ("HAS_PILOTS", flag(gpu.lanes.of_packet == 1)),
            ("MAP_IN_TABLES", flag(gpu.reads_images)),
        ];
        let value = |name: &str| overrides.iter().chain(&of_device).find(|(n, _)| *n == name).map(|(_, value)| *value);
        let constants = shader.overrides.iter().filter_map(|name| Some((*name, value(name)?))).collect();
        let program = gpu.compiler.program(&gpu.device, &gpu.submissions.chunks.layout, shader, constants);
        Self { program, tables: Vec::new() }
    }

    /// The kernel with tables for all its dispatches. Names that only other kernels use are
    /// ignored.
    #[must_use]
    pub fn with_tables(mut self, tables: &[(&'static str, &Table)]) -> Self {
        let binds = |name: &str| self.program.shader.bindings.iter().any(|b| b.name == name);
        let used = tables.iter().filter(|(name, _)| binds(name));
        self.tables = used.map(|(name, table)| (*name, (*table).clone())).collect();
        self
    }

    /// The kernel with another value of one of its `override` constants.
    #[must_use]
    pub fn with_constant(&self, gpu: &Gpu, name: &'static str, value: f64) -> Self {
        let others = self.program.constants.iter().filter(|(n, _)| *n != name);
        let constants = others.copied().chain([(name, value)]).collect();
        let layout = &gpu.submissions.chunks.layout;
        let program = gpu.compiler.program(&gpu.device, layout, self.program.shader, constants);
        Self { program, tables: self.tables.clone() }
    }

    /// Binds buffers by the names of the shader's variables. Names that only other kernels use are
    /// passed over, so that one list serves several kernels.
    ///
    /// # Panics
    /// If a variable of the kernel has no buffer in the list, nor a table in [`Self::with_tables`],
    /// or no kernel has a variable of one of the names.
    #[must_use]
    pub fn bind(&self, gpu: &Gpu, buffers: &[(&str, &Buffer)]) -> Bindings {
        for (name, _) in buffers {
            let mut all = SHADERS.iter().chain([self.program.shader]);
            let is_known = all.any(|s| s.bindings.iter().any(|b| b.name == *name));
            assert!(is_known, "{}: no kernel binds {name}", self.program.shader.stem);
        }
        let find = |name: &str| {
            let buffer = buffers.iter().find(|(n, _)| *n == name).map(|(_, buffer)| buffer.as_entire_binding());
            let table = self.tables.iter().find(|(n, _)| *n == name).map(|(_, table)| table.view());
            let found = buffer.or(table.map(wgpu::BindingResource::TextureView));
            found.unwrap_or_else(|| panic!("{}: nothing is bound to {name}", self.program.shader.stem))
        };
        let group = |(g, layout): (usize, &Option<wgpu::BindGroupLayout>)| {
            let entries: Vec<_> = self
                .program
                .shader
                .bindings
                .iter()
                .filter(|b| b.group as usize == g)
                .map(|b| wgpu::BindGroupEntry { binding: b.index, resource: find(b.name) })
                .collect();
            let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.program.shader.stem),
                layout: layout.as_ref()?,
                entries: &entries,
            });
            Some((g as u32, bind_group))
        };
        Bindings(self.program.compiled().layouts.iter().enumerate().filter_map(group).collect())
    }

    /// Runs `invocations` invocations, in workgroups of [`crate::layout::WORKGROUP_SIZE`] folded to
    /// two dimensions where one is too short, and in several dispatches where one would take too
    /// long ([`super::Pacing`]); the kernel finds its index with `invocation_index` and must check
    /// it.
    pub fn dispatch(&self, commands: &mut Commands, bindings: &Bindings, invocations: u64) {
        self.record(commands, bindings, invocations, None);
    }

    /// Runs the number of workgroups that the device has written to the first three `u32` of
    /// `arguments`: at most those of `max_invocations`.
    pub fn dispatch_indirect(
        &self,
        commands: &mut Commands,
        bindings: &Bindings,
        arguments: &Buffer,
        max_invocations: u64,
    ) {
        self.record(commands, bindings, max_invocations, Some(arguments));
    }

    fn record(&self, commands: &mut Commands, bindings: &Bindings, max_invocations: u64, arguments: Option<&Buffer>) {
        let chunks = &commands.submissions.chunks;
        let stem = self.program.shader.stem;
        let record = |pass: &mut wgpu::ComputePass<'_>, first: u64, invocations: u64| {
            pass.set_pipeline(&self.program.compiled().pipeline);
            for (group, bind_group) in &bindings.0 {
                pass.set_bind_group(*group, bind_group, &[]);
            }
            if self.program.can_be_cut() {
                pass.set_bind_group(CHUNK_GROUP, &chunks.starting_at(first), &[]);
            }
            match arguments {
                Some(arguments) if invocations == max_invocations => pass.dispatch_workgroups_indirect(arguments, 0),
                // Only the device knows the true count: invocations beyond it find nothing to do.
                _ => {
                    let (x, y) = fold(invocations.div_ceil(u64::from(crate::layout::WORKGROUP_SIZE)));
                    pass.dispatch_workgroups(x, y, 1);
                }
            }
        };
        match self.program.can_be_cut() {
            true => commands.dispatch(stem, max_invocations, record),
            false => {
                assert_eq!(max_invocations, 1, "{stem}: a kernel without invocation_index is a single invocation");
                commands.dispatch(stem, 1, record);
            }
        }
    }
}

const MAX_WORKGROUPS: u64 = crate::layout::MAX_WORKGROUPS as u64;

/// Folds a count of workgroups to (columns, rows). All rows but the last are full, and none is
/// empty.
fn fold(workgroups: u64) -> (u32, u32) {
    let rows = workgroups.div_ceil(MAX_WORKGROUPS).max(1);
    let columns = workgroups.div_ceil(rows);
    assert!(rows <= MAX_WORKGROUPS, "{workgroups} workgroups are more than one dispatch can hold");
    (columns as u32, rows as u32)
}

#[cfg(test)]
mod tests {
    use std::{
        panic::{AssertUnwindSafe, catch_unwind},
        sync::Arc,
    };

    use super::{Kernel, fold};
    use crate::gpu::{Gpu, shaders::SHADERS};

    #[test]
    fn equal_kernels_are_compiled_once() {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let same = |a: &[(&str, f64)], b: &[(&str, f64)]| {
            Arc::ptr_eq(&Kernel::new(&gpu, "gather", a).program, &Kernel::new(&gpu, "gather", b).program)
        };
        assert!(same(&[("SEGMENTS", 1.0)], &[("STACK_WORDS", 3.0), ("SEGMENTS", 1.0)]));
        assert!(!same(&[("SEGMENTS", 1.0)], &[("SEGMENTS", 2.0)]), "control: constants matter");
        // Those that were asked for and never used hold up nobody.
        let all: Vec<_> = SHADERS.iter().map(|shader| Kernel::new(&gpu, shader.stem, &[])).collect();
        drop((gpu, all));
    }

    #[test]
    fn names_that_no_kernel_has_are_bugs() {
        let gpu = Gpu::open(None).expect("tests need an adapter");
        let buffer = gpu.storage::<u32>("anything", 1).expect("fits");
        let message = |what: &dyn Fn()| {
            let panic = catch_unwind(AssertUnwindSafe(what)).expect_err("it panics");
            panic.downcast::<String>().map_or_else(|_| String::new(), |text| *text)
        };
        let kernel = Kernel::new(&gpu, "merge_bounds", &[("SEGMENTS", 1.0)]);
        let wrong_override = message(&|| drop(Kernel::new(&gpu, "merge_bounds", &[("SEGMENT", 1.0)])));
        assert_eq!(wrong_override, "merge_bounds: no kernel has an override SEGMENT");
        let name = kernel.program.shader.bindings[0].name;
        let wrong_binding = message(&|| drop(kernel.bind(&gpu, &[(name, &buffer), ("photon", &buffer)])));
        assert_eq!(wrong_binding, "merge_bounds: no kernel binds photon");
        // Control: those of other kernels are passed over.
        drop(kernel.bind(&gpu, &[(name, &buffer), ("points", &buffer)]));
    }

    #[test]
    fn dispatches_fold_to_two_dimensions() {
        assert_eq!(fold(0), (0, 1));
        assert_eq!(fold(1), (1, 1));
        assert_eq!(fold(65_535), (65_535, 1));
        let (x, y) = fold(65_536);
        assert!(u64::from(x) * u64::from(y) >= 65_536 && x <= 65_535 && y == 2);
    }
}
