//! Benchmark: bias of the radiance estimate where surfaces end, meet or curve, against closed
//! forms.
//!
//! `cargo bench --bench estimators`. For the cost of its options see `cargo bench --bench options`.

use caustica::gpu::Gpu;
use support::surfaces;

fn main() {
    let gpu = Gpu::open(None).expect("an adapter");
    println!("{} ({})", gpu.name, gpu.driver);
    cases(&gpu);
}

fn cases(gpu: &Gpu) {
    let ways = surfaces::ways().map(|(name, _)| name);
    println!("\n{:<26} {}", "error of the mean, %", ways.map(|way| format!("{way:>16}")).join(""));
    for case in surfaces::cases(400) {
        let errors = surfaces::estimates(gpu, &case, 3).map(|found| 100.0 * surfaces::bias(&case, &found));
        println!("{:<26} {}", case.name, errors.map(|error| format!("{error:>16.1}")).join(""));
    }
}
