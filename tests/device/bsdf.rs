//! The lobes of the BSDF: sampling, density, value and albedo are consistent.
//!
//! | test | claim | negative control |
//! |---|---|---|
//! | diffuse | directions follow the density (chi-square at 1e-4), which integrates to 1 | another normal |
//! | flux | directions follow the cosine with the geometric normal, whatever the other is | that with the other |
//! | aimed flux | weighted, directions aimed at a sphere carry what the cosine does, there and elsewhere | without the weights |
//! | reciprocity | of light and flux: weight times cosine is the value, the other way round | another normal |
//! | albedo | is the integral of the BRDF times the cosine | another material |
//! | specular | lobes are drawn by Fresnel, in the directions of Snell | denser glass |

use std::f64::consts::PI;

use caustica::{
    bvh::Bvh,
    scene::{Scene, Surface},
    settings::LightSettings,
    upload::SceneBuffers,
};
use glam::{Vec3, vec3};
use support::*;

use super::{
    chi_square::{Directions, SAMPLES, deviate, height_and_azimuth, of_unit_square},
    fresnel::closed_form,
    probe::{Probe, Row, rows},
};

const GRID: Directions = Directions { rows: 32, columns: 48 };
const LEANING: Vec3 = vec3(0.3, 0.9, -0.31622776);

/// Value, density and weight of flux at the midpoints of all cells, `STEPS` along each side.
fn values(ns: Vec3) -> Vec<[f32; 4]> {
    let points = GRID.midpoints(STEPS).into_iter();
    let rows: Vec<Row> = points.map(|d| [d.as_vec3().extend(0.0).to_array(), ns.extend(0.0).to_array()]).collect();
    Probe::new("probe_diffuse_values").run(&rows)
}

const STEPS: usize = 12;

/// Integral over all directions of values at these midpoints.
fn integral(values: impl Iterator<Item = f64>) -> f64 {
    values.sum::<f64>() * 4.0 * PI / (GRID.rows * GRID.columns * STEPS * STEPS) as f64
}

#[test]
fn diffuse_directions_follow_their_density() {
    for (ns, other) in [(Vec3::Y, LEANING), (LEANING, Vec3::Y)] {
        let densities: Vec<f64> = values(ns).iter().map(|v| f64::from(v[1]) / PI).collect();
        let whole = integral(densities.iter().copied());
        assert!(within(whole, 1.0, 1e-3), "about {ns} the density integrates to {whole}");
        let drawn = |ns: Vec3| Probe::new("probe_diffuse").run(&rows(SAMPLES, ns.extend(0.0).to_array()));
        let test = |drawn: Vec<[f32; 4]>| deviate(&GRID.counts(drawn), &GRID.probabilities(&densities));
        let (found, wrong) = (test(drawn(ns)), test(drawn(other)));
        assert!(found.fits(), "about {ns}: {found:?}");
        assert!(!wrong.fits(), "control: about {other}: {wrong:?}");
        let told = drawn(ns).iter().all(|d| (d[3] - Vec3::from_slice(d).dot(ns)).abs() < 1e-5);
        assert!(told, "the density told for a sample is another one");
    }
}

#[test]
fn flux_leaves_by_the_geometric_cosine() {
    let test = |stem: &str| {
        let drawn = Probe::new(stem).run(&rows(SAMPLES, LEANING.extend(0.0).to_array()));
        of_unit_square(drawn.into_iter().map(|d| {
            let [height, azimuth] = height_and_azimuth(d, Vec3::Y);
            [height * (2.0 - height), azimuth]
        }))
    };
    let (found, light) = (test("probe_diffuse_flux"), test("probe_diffuse"));
    assert!(found.fits(), "{found:?}");
    assert!(!light.fits(), "control: directions of light, about the other normal: {light:?}");
}

#[test]
fn aimed_flux_carries_what_the_cosine_does() {
    let (center, radius) = (vec3(1.0, 1.5, 0.0), 0.5);
    let drawn = |radius: f32| Probe::new("probe_aimed_flux").run(&rows(SAMPLES, center.extend(radius).to_array()));
    // Whether a direction meets the sphere.
    let meets = |d: Vec3| d.dot(center) > 0.0 && center.cross(d).length() <= radius;
    // Form factor of a sphere above the horizon.
    let to_sphere = f64::from(radius.powi(2) * center.y) / f64::from(center.length()).powi(3);
    // All of the flux, its heights, its directions along x, and what meets the sphere.
    let integrals = [1.0, 2.0 / 3.0, 0.0, to_sphere];
    let values = |d: Vec3| [1.0, d.y.into(), d.x.into(), f64::from(u8::from(meets(d)))];
    // Deviation of a mean from what the cosine gives, in standard errors.
    let deviation = |drawn: &[[f32; 4]], of: usize, weighted: bool| {
        let value = |d: &[f32; 4]| values(Vec3::from_slice(d))[of] * if weighted { f64::from(d[3]) } else { 1.0 };
        let count = drawn.len() as f64;
        let mean = drawn.iter().map(value).sum::<f64>() / count;
        let variance = drawn.iter().map(|d| (value(d) - mean).powi(2)).sum::<f64>() / count;
        (mean - integrals[of]) / (variance / count).sqrt().max(1e-9)
    };
    let aimed = drawn(radius);
    for of in 0..integrals.len() {
        let off = deviation(&aimed, of, true);
        assert!(off.abs() < 4.5, "integral {of}: {off} standard errors");
    }
    assert!(deviation(&aimed, 3, false) > 4.5, "control: without the weights");
    let met = aimed.iter().filter(|d| meets(Vec3::from_slice(*d))).count();
    assert!(met > SAMPLES / 4, "{met} of {SAMPLES} meet the sphere");
    assert!(aimed.iter().all(|d| (0.0..1.334).contains(&d[3])), "no weight is above 4/3");
    // From within the sphere, and without one, flux leaves by the cosine.
    for radius in [3.0, 0.0] {
        assert!(drawn(radius).iter().all(|d| d[3] == 1.0), "radius {radius}");
    }
}

#[test]
fn light_and_flux_are_reciprocal() {
    for ns in [Vec3::Y, LEANING] {
        let midpoints = GRID.midpoints(STEPS);
        let mismatches = |of_flux: &[[f32; 4]]| {
            let all = values(ns).into_iter().zip(of_flux).zip(&midpoints);
            // The BRDF does not depend on the directions, so that it is symmetric.
            let wrong = |((v, flux), d): &(([f32; 4], &[f32; 4]), &glam::DVec3)| {
                let (cos_s, cos_g) = (d.dot(ns.as_dvec3()), d.y);
                let sided = if cos_s > 0.0 && cos_g > 0.0 { cos_s } else { 0.0 };
                // The weight is clamped at grazing incidence on the geometric surface.
                let bounded = cos_g < 0.2;
                let (value, weight) = (f64::from(v[0]), f64::from(flux[2]));
                (value - sided).abs() > 1e-5 || !bounded && (weight * cos_g - value).abs() > 1e-5
            };
            all.filter(wrong).count()
        };
        assert_eq!(mismatches(&values(ns)), 0, "with the normal {ns}");
        let other = values(vec3(-0.3, 0.9, 0.31622776));
        assert!(mismatches(&other) > midpoints.len() / 10, "control: another normal than {ns}");
    }
}

/// Materials of all kinds: two colours, a mirror, two glasses and a pane.
fn materials() -> Scene {
    let colour = |albedo| Surface::Diffuse { albedo };
    let glass = |ior| Surface::Glass { ior, tint: vec3(0.9, 0.8, 0.7) };
    let pane = Surface::Pane { ior: 1.5, tint: Vec3::ONE };
    let mirror = Surface::Mirror { tint: vec3(0.6, 0.7, 0.8) };
    let diffuse = [colour(vec3(0.8, 0.5, 0.2)), colour(vec3(0.1, 0.6, 0.9))];
    let mut scene = scene(&[diffuse[0], diffuse[1], mirror, glass(1.5), glass(1.6), pane]);
    scene.spheres.push(sphere(Vec3::ZERO, 1.0, 0));
    scene.lights.push(point_light(Vec3::Y, 1.0));
    scene
}

fn run(stem: &str, rows: &[Row]) -> Vec<[f32; 4]> {
    let scene = materials();
    let buffers = SceneBuffers::new(gpu(), &scene, &Bvh::build(&scene), &LightSettings::default()).expect("it fits");
    Probe::of_scene(stem, &buffers, &buffers.lights.photons).run(rows)
}

#[test]
fn albedo_is_the_integral_of_the_brdf() {
    let cosines = integral(values(Vec3::Y).iter().map(|v| f64::from(v[0])));
    let of =
        |material: u16, brdf: f32| run("probe_albedo", &[[[brdf, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, material.into()]]])[0];
    for (material, other) in [(0, 1), (1, 0)] {
        let (albedo, brdf, wrong) = (of(material, 0.0), of(material, 1.0), of(other, 1.0));
        for channel in 0..3 {
            let (albedo, reflected) = (f64::from(albedo[channel]), cosines * f64::from(brdf[channel]));
            assert!(within(reflected, albedo, 1e-3), "{reflected} is reflected of albedo {albedo}");
            let wrong = cosines * f64::from(wrong[channel]);
            assert!(!within(wrong, albedo, 1e-3), "control: another material passes for albedo {albedo}");
        }
    }
    assert_eq!(of(2, 0.0)[..3], [0.6, 0.7, 0.8], "the mirror's tint");
    assert_eq!(of(3, 0.0)[..3], [0.9, 0.8, 0.7], "the tint of glass");
    // A leaning shading normal adds no light.
    let leaning = integral(values(LEANING).iter().map(|v| f64::from(v[0])));
    assert!(leaning < PI && leaning > 0.9 * PI, "{leaning}");
}

/// Lobe numbers of `bsdf.wesl`.
const REFLECTION: f32 = 1.0;
const TRANSMISSION: f32 = 2.0;

#[test]
fn specular_lobes_are_drawn_by_fresnel_and_snell() {
    for degrees in [0.0_f32, 30.0, 60.0, 80.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let incoming = vec3(sine, -cosine, 0.0);
        let drawn = |material: f32| run("probe_bsdf", &rows(SAMPLES, incoming.extend(material).to_array()));
        let reflections = |drawn: &[[f32; 4]]| drawn.iter().filter(|d| d[3] == REFLECTION).count() as f64;
        let fresnel = closed_form(cosine.into(), 1.5);
        // Distance of the fraction of reflections from a probability, in standard deviations.
        let z = |drawn: &[[f32; 4]], probability: f64| {
            let count = drawn.len() as f64;
            (reflections(drawn) - count * probability).abs() / (count * probability * (1.0 - probability)).sqrt()
        };
        let (glass, denser, pane) = (drawn(3.0), drawn(4.0), drawn(5.0));
        assert!(z(&glass, fresnel) < 4.0, "glass at {degrees}°: {} reflections", reflections(&glass));
        assert!(z(&denser, fresnel) > 4.0, "control: denser glass at {degrees}°");
        let both = 2.0 * fresnel / (1.0 + fresnel);
        assert!(z(&pane, both) < 4.0, "a pane at {degrees}°: {} reflections", reflections(&pane));
        assert_eq!(reflections(&drawn(2.0)), SAMPLES as f64, "a mirror reflects all");
        let refracted = |ior: f32| vec3(sine / ior, -(1.0 - (sine / ior).powi(2)).sqrt(), 0.0);
        let astray = |drawn: &[[f32; 4]], transmitted: Vec3| {
            let wrong = |d: &&[f32; 4]| {
                let right = match d[3] {
                    REFLECTION => vec3(sine, cosine, 0.0),
                    TRANSMISSION => transmitted,
                    _ => Vec3::ZERO,
                };
                Vec3::from_slice(&d[..3]).distance(right) > 1e-5
            };
            drawn.iter().filter(wrong).count()
        };
        assert_eq!(astray(&glass, refracted(1.5)), 0, "through glass at {degrees}°");
        assert_eq!(astray(&pane, incoming), 0, "through a pane at {degrees}°");
        assert!(degrees == 0.0 || astray(&denser, refracted(1.5)) > 0, "control: denser glass at {degrees}°");
    }
}
