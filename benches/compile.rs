//! Benchmark: compile time of each kernel in the driver, without its disk cache.
//!
//! `cargo bench --bench compile [-- [KERNEL ...] [CONSTANT=VALUE ...]]`: of all kernels, or of
//! those named, with `override` constants such as `HAS_TEXTURES=0`. Each kernel runs one workgroup
//! over zeroed buffers, twice; the first run includes compilation.

use std::{process::Command, time::Instant};

use caustica::gpu::{
    Buffer, Gpu, Kernel, Table,
    shaders::{BindingKind, SHADERS},
};

/// Environment variable of the measuring process. Mesa reads it when it is loaded, so that the
/// benchmark starts itself again with it.
const MEASURING: (&str, &str) = ("MESA_SHADER_CACHE_DISABLE", "true");
/// Size of each zeroed buffer, bytes.
const BYTES: u64 = 1 << 16;

fn main() {
    if std::env::var(MEASURING.0).is_err() {
        let program = std::env::current_exe().expect("a process has a program");
        let args = std::env::args_os().skip(1);
        let status = Command::new(program).args(args).env(MEASURING.0, MEASURING.1).status();
        let status = status.expect("the program starts");
        std::process::exit(status.code().unwrap_or(1));
    }
    let gpu = Gpu::open(std::env::var("CAUSTICA_DEVICE").ok().as_deref()).expect("benches need an adapter");
    println!("{} ({})", gpu.name, gpu.driver);
    // Cargo adds an option of its own.
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let (constants, kernels): (Vec<_>, Vec<_>) = args.iter().partition(|arg| arg.contains('='));
    let constants: Vec<(&str, f64)> = constants
        .iter()
        .filter_map(|arg| arg.split_once('='))
        .map(|(name, value)| (name, value.parse().expect("a constant is a number")))
        .collect();
    println!("{:>18} {:>10} {:>10}", "kernel", "first (s)", "second (s)");
    for shader in SHADERS.iter().filter(|shader| kernels.is_empty() || kernels.iter().any(|k| *k == shader.stem)) {
        let buffers: Vec<(&str, Buffer)> = shader
            .bindings
            .iter()
            .filter(|b| !matches!(b.kind, BindingKind::Table { .. }))
            .map(|b| match b.kind {
                BindingKind::Uniform => (b.name, gpu.uniform("zeros", &[0_u32; 1024])),
                _ => (b.name, gpu.storage::<u8>("zeros", BYTES).expect("a small buffer fits")),
            })
            .collect();
        let named: Vec<_> = buffers.iter().map(|(name, buffer)| (*name, buffer)).collect();
        let zeros = Table::new(&gpu, "zeros", &[[0_u32; 4]; 64]).expect("a small table fits");
        let layered = Table::layered(&gpu, "zeros", &[[0_u32; 4]; 64]).expect("a small table fits");
        let words = Table::new(&gpu, "zeros", &[0_u32; 64]).expect("a small table fits");
        let layered_words = Table::layered(&gpu, "zeros", &[0_u32; 64]).expect("a small table fits");
        let table = |kind| match kind {
            BindingKind::Table { layered: true, words: 1 } => &layered_words,
            BindingKind::Table { words: 1, .. } => &words,
            BindingKind::Table { layered: true, .. } => &layered,
            _ => &zeros,
        };
        let tables: Vec<_> = shader.bindings.iter().map(|b| (b.name, table(b.kind))).collect();
        gpu.wait().expect("the device works");
        let start = Instant::now();
        let kernel = Kernel::new(&gpu, shader.stem, &constants).with_tables(&tables);
        // A kernel without an invocation index runs as a single invocation.
        let invocations = if named.iter().any(|(name, _)| *name == "first_invocation") { 64 } else { 1 };
        let run = || {
            let mut encoder = gpu.encoder();
            kernel.dispatch(&mut encoder, &kernel.bind(&gpu, &named), invocations);
            gpu.submit(encoder);
            gpu.wait().expect("the kernel runs");
        };
        run();
        let first = start.elapsed().as_secs_f64();
        let start = Instant::now();
        run();
        println!("{:>18} {first:>10.3} {:>10.4}", shader.stem, start.elapsed().as_secs_f64());
    }
}
