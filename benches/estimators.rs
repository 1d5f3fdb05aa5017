//! Benchmark: bias of the radiance estimate where surfaces end, meet or curve, against closed
//! forms.
//!
//! `cargo bench --bench estimators`. For the cost of its options see `cargo bench --bench options`.

use caustica::gpu::Gpu;
use support::surfaces;

fn main() {
    let gpu = Gpu::open(None).expect("an adapter");
    println!("{} ({})", gpu.name, gpu.driver);
    places(&gpu);
}

fn places(gpu: &Gpu) {
    let ways = surfaces::ways().map(|(name, _)| name);
    println!("\n{:<26} {}", "error of the mean, %", ways.map(|way| format!("{way:>16}")).join(""));
    for place in surfaces::places(400) {
        let errors = surfaces::estimates(gpu, &place, 3).map(|found| 100.0 * surfaces::bias(&place, &found));
        println!("{:<26} {}", place.name, errors.map(|error| format!("{error:>16.1}")).join(""));
    }
}
