//! Groups of lights, each of which can light the scene alone.

use glam::Vec3;

use super::{Material, Scene, Surface};
use crate::{Error, Result, image::cryptomatte::hash};

/// Maximum number of groups of a picture.
const MAX_GROUPS: usize = 32;
/// Maximum length of a group's name, bytes: names of channels end at 255, of which those of parts
/// need some for themselves.
const MAX_BYTES: usize = 200;
/// Group of what shows its colour without light.
const UNLIT: &str = "unlit";

impl Scene {
    /// Names of the groups of lights, in the order of the scene: what shines, by its own name or
    /// that of its group, made fit for the name of a layer.
    ///
    /// # Errors
    /// [`Error::Setting`] if there are too many.
    pub fn light_groups(&self) -> Result<Vec<String>> {
        let mut names = Vec::new();
        let shines = |index: usize, material: &Material| material.group_of_light().is_some() && self.uses(index);
        let surfaces = self.materials.iter().enumerate().filter(|(i, material)| shines(*i, material));
        let unlit = surfaces.clone().filter(|(_, material)| material.unlit).map(|_| UNLIT.to_owned());
        let lights = self.lights.iter().map(|light| group(light.group.as_ref(), &light.name));
        let emissive = surfaces.filter_map(|(_, material)| material.group_of_light());
        let environment = self.environment.iter().map(|environment| group(None, &environment.name));
        // Unlit surfaces come first: the other layers are those of the first group.
        for name in unlit.chain(lights).chain(emissive).chain(environment) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        if names.len() > MAX_GROUPS {
            let problem = format!(
                "{} groups of lights, at most {MAX_GROUPS}; lights with the same extras.caustica.group are one",
                names.len()
            );
            return Err(Error::Setting { name: "picture.layers", value: "lights".to_owned(), problem });
        }
        Ok(names)
    }

    /// The scene with the lights of one group alone.
    #[must_use]
    pub fn lit_by(&self, name: &str) -> Self {
        let mut scene = self.clone();
        scene.lights.retain(|light| group(light.group.as_ref(), &light.name) == name);
        scene.environment = scene.environment.filter(|environment| group(None, &environment.name) == name);
        for material in &mut scene.materials {
            if material.group_of_light().is_some_and(|own| own != name) {
                material.emission = Vec3::ZERO;
                if material.unlit {
                    material.surface = Surface::Diffuse { albedo: Vec3::ZERO };
                }
            }
        }
        scene
    }

    fn uses(&self, material: usize) -> bool {
        let of_triangles = self.triangles.iter().any(|triangle| triangle.material as usize == material);
        of_triangles || self.spheres.iter().any(|sphere| sphere.material as usize == material)
    }
}

impl Material {
    /// Group of the light that it gives; `None` if it gives none.
    fn group_of_light(&self) -> Option<String> {
        let shines = self.emission != Vec3::ZERO;
        if self.unlit { Some(UNLIT.to_owned()) } else { shines.then(|| group(self.group.as_ref(), &self.name)) }
    }
}

/// Name of a group that a file's layers can have: without dots, which divide layers, and without
/// control characters. Of a long name the beginning is kept, and the hash of all of it tells it
/// from others that begin alike.
fn group(own: Option<&String>, name: &str) -> String {
    let fit = |c: char| if c == '.' || c.is_control() { '_' } else { c };
    let name: String = own.map_or(name, String::as_str).chars().map(fit).collect();
    match name.len() {
        0 => "unnamed".to_owned(),
        1..=MAX_BYTES => name,
        _ => {
            let hash = format!("~{:08x}", hash(&name));
            format!("{}{hash}", &name[..name.floor_char_boundary(MAX_BYTES - hash.len())])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Environment, Light, LightKind, Sphere};

    fn light(name: &str, group: Option<&str>) -> Light {
        Light {
            name: name.to_owned(),
            group: group.map(str::to_owned),
            kind: LightKind::Point,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::ONE,
        }
    }

    fn scene() -> Scene {
        let gray = Surface::Diffuse { albedo: Vec3::splat(0.5) };
        let plain = |name: &str| Material::new(name, gray);
        Scene {
            materials: vec![
                plain("wall"),
                Material { emission: Vec3::ONE, ..plain("screen") },
                Material { emission: Vec3::ONE, group: Some("ceiling".to_owned()), ..plain("panel") },
                Material { emission: Vec3::ONE, ..plain("not there") },
                Material { unlit: true, ..plain("sign") },
            ],
            spheres: [0, 1, 2, 4]
                .map(|material| Sphere { center: Vec3::ZERO, radius: 1.0, material, object: 0 })
                .to_vec(),
            lights: vec![light("lamp.001", None), light("spot", Some("ceiling")), light("", None)],
            environment: Some(Environment::sky()),
            ..Scene::default()
        }
    }

    #[test]
    fn groups_go_by_their_name_or_that_of_the_light() {
        let sky = Environment::sky().name.replace('.', "_");
        let expected = ["unlit", "lamp_001", "ceiling", "unnamed", "screen", &sky];
        assert_eq!(scene().light_groups().expect("few"), expected);
        assert_eq!(Scene::default().light_groups().expect("none"), [""; 0]);
        let many = Scene { lights: (0..33).map(|i| light(&i.to_string(), None)).collect(), ..Scene::default() };
        assert!(many.light_groups().expect_err("too many").to_string().contains("33 groups of lights, at most 32"));
    }

    #[test]
    fn names_of_groups_are_fit_for_layers() {
        let of = |name: &str| group(None, name);
        for kept in ["Lampe Tür", "ü☃", "a b/c"] {
            assert_eq!(of(kept), kept);
        }
        assert_eq!(of("a.b\0c\nd"), "a_b_c_d");
        assert_eq!(of(&"x".repeat(200)), "x".repeat(200));
        let long = |end: &str| of(&format!("{}{end}", "ü☃".repeat(60)));
        assert!(long("1").len() <= 200 && long("1").starts_with("ü☃ü☃"), "{}", long("1"));
        assert_eq!(long("1"), long("1"));
        assert_ne!(long("1"), long("2"), "what begins alike is told apart");
    }

    #[test]
    fn each_light_shines_in_one_group() {
        let all = scene();
        let (mut lights, mut shining, mut skies) = (0, 0, 0);
        for name in all.light_groups().expect("few") {
            let lit = all.lit_by(&name);
            lights += lit.lights.len();
            skies += usize::from(lit.environment.is_some());
            let of_use = lit.materials.iter().filter(|m| m.name != "not there" && m.emission != Vec3::ZERO).count();
            let shown = lit.materials.iter().filter(|m| m.unlit && m.surface.color() != Vec3::ZERO).count();
            shining += of_use + shown;
            assert_eq!(lit.materials.len(), all.materials.len());
        }
        assert_eq!((lights, shining, skies), (3, 3, 1));
    }
}
