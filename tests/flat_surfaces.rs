//! The estimate where the surface around a point is no whole flat disc, against closed forms.
//!
//! | place | negative control |
//! |---|---|
//! | box corner, table edge, both sides of a thin wall, small spheres | the raw estimate, rejection alone, correction alone |

mod photons;
mod surfaces;

use caustica::gpu::Gpu;
use surfaces::{bias, estimates, places};

#[test]
fn rejection_and_correction_are_right_together_and_wrong_alone() {
    let gpu = Gpu::open(std::env::var("CAUSTICA_DEVICE").ok().as_deref()).expect("tests need an adapter");
    for place in places(400) {
        let [raw, rejects, corrects, both] = estimates(&gpu, &place, 3).map(|found| bias(&place, &found));
        let found =
            format!("{}: raw {raw:.3}, rejection {rejects:.3}, correction {corrects:.3}, both {both:.3}", place.name);
        assert!(both.abs() < 0.06, "{found}");
        assert!(raw.abs() > 0.15, "control: {found}");
        assert!(rejects.abs().max(corrects.abs()) > 0.15, "control: {found}");
    }
}
