//! The scene: its contents, and queries of them.

use std::path::PathBuf;

use glam::{DVec3, Vec3};

use super::{
    Attributes, Bounds, Camera, Environment, Image, Instance, Light, LoadOptions, Material, SharedMesh, Sphere,
    Surface, Textures, Triangle, instance_bounds, reach_of_instances,
};
use crate::{
    Error, Result,
    image::{EnvironmentProvenance, Provenance},
    layout::METAL,
    settings::Settings,
    stats::Stats,
};

/// Fraction of the area of all surfaces below which glass is small.
const SMALL: f64 = 0.01;

/// A scene, ready to be traced.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Path of the file.
    pub path: PathBuf,
    /// File name without folders.
    pub file_name: String,
    /// Options with which it was read.
    pub options: LoadOptions,
    /// Files that the file refers to: buffers and images, read or not.
    pub files: Vec<PathBuf>,
    /// Variants of the materials that the file names.
    pub variants: Vec<String>,
    /// SHA-256 of the bytes of the file, its buffers and the images in use, in hexadecimal.
    pub hash: String,
    /// Offset subtracted from all world coordinates of the file: the centre of its geometry, or a
    /// camera near small things far from there.
    pub center: DVec3,
    /// Triangles of all meshes that are not shared.
    pub triangles: Vec<Triangle>,
    /// Meshes that instances share.
    pub meshes: Vec<SharedMesh>,
    /// Places of these.
    pub instances: Vec<Instance>,
    /// Attributes at the corners of triangles with textures or colours.
    pub attributes: Vec<Attributes>,
    /// Images of the materials' textures.
    pub images: Vec<Image>,
    /// Index of the solid of glass that each triangle bounds, `u32::MAX` for none; empty where no
    /// file says which triangles belong together.
    pub shells: Vec<u32>,
    /// Exact spheres.
    pub spheres: Vec<Sphere>,
    /// Names of the nodes that show triangles and spheres, which refer to them by index.
    pub objects: Vec<String>,
    /// Materials; triangles and spheres refer to them by index.
    pub materials: Vec<Material>,
    /// Punctual lights.
    pub lights: Vec<Light>,
    /// Whether the file names a light that gives none: a punctual light of intensity 0, or the
    /// emissive material of a surface with strength 0. Such a scene is dark, not without a light.
    pub names_dark_light: bool,
    /// Environment light, infinitely far away.
    pub environment: Option<Environment>,
    /// Never empty after [`Scene::load`]: a file without cameras gets one that frames the scene.
    pub cameras: Vec<Camera>,
    /// Features that were ignored or approximated, one line each.
    pub warnings: Vec<String>,
    /// Number of meshes in the file.
    pub mesh_count: usize,
}

impl Scene {
    /// Bounding box of all geometry in scene coordinates; [`Bounds::EMPTY`] if there is none.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let triangles = self.triangles.iter().map(Bounds::from);
        let instances = instance_bounds(&self.meshes, &self.instances);
        triangles.chain(self.spheres.iter().map(Bounds::from)).chain(instances).fold(Bounds::EMPTY, Bounds::union)
    }

    /// Bounding sphere of all geometry, around the centre of its bounding box: centre and radius,
    /// metres. Zero and zero if there is no geometry.
    #[must_use]
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let bounds = self.bounds();
        if bounds.min.x > bounds.max.x {
            return (Vec3::ZERO, 0.0);
        }
        let center = 0.5 * (bounds.min + bounds.max);
        let corners = self.triangles.iter().flat_map(|t| t.positions).map(|p| p.distance(center));
        let balls = self.spheres.iter().map(|s| s.center.distance(center) + s.radius);
        let instances = reach_of_instances(&self.meshes, &self.instances, center);
        (center, corners.chain(balls).fold(instances, f32::max))
    }

    /// Whether a surface is sharp enough for caustics.
    #[must_use]
    pub fn has_specular(&self) -> bool {
        let casts = self.caustic_materials();
        self.uses_material(|i, _| casts[i])
    }

    /// Whether some light reaches coats in ways that rays of final gathering leave to others: by
    /// mirrors, metal and glass that cast caustics, and from unlit surfaces.
    #[must_use]
    pub fn has_light_beside_gathers(&self) -> bool {
        self.has_specular() || self.uses_material(|_, material| material.unlit)
    }

    /// For each material, whether what it reflects or transmits is sharp enough for caustics
    /// somewhere: mirrors, metals, glass and panes up to [`LoadOptions::caustic_roughness`], and
    /// [small glass](Self::small_glass). For one point `shaders/lib/transport/material.wesl`
    /// decides.
    #[must_use]
    pub fn caustic_materials(&self) -> Vec<bool> {
        let small = self.small_glass();
        self.materials.iter().zip(small).map(|(material, small)| small || self.casts_caustics(material)).collect()
    }

    /// For each material, whether it is glass or a pane, and all of its surfaces are less than a
    /// hundredth of those of the scene, as the covers of lamps are. It casts caustics however rough
    /// it is: few of the rays that look around meet it, and each brings much light. None where
    /// [`LoadOptions::caustic_roughness`] is 0.
    #[must_use]
    pub fn small_glass(&self) -> Vec<bool> {
        let mut areas = vec![0.0; self.materials.len()];
        self.triangles.iter().for_each(|triangle| areas[triangle.material as usize] += triangle.area());
        self.spheres.iter().for_each(|sphere| areas[sphere.material as usize] += sphere.area());
        let of_mesh = |mesh: &SharedMesh| mesh.triangles.iter().map(Triangle::area).sum::<f64>();
        let meshes: Vec<f64> = self.meshes.iter().map(of_mesh).collect();
        let scale = |instance: &Instance| f64::from(instance.linear.determinant()).powf(2.0 / 3.0);
        let instances: f64 = self.instances.iter().map(|i| meshes[i.mesh as usize] * scale(i)).sum();
        let all = areas.iter().sum::<f64>() + instances;
        let is_small = |(material, area): (&Material, f64)| material.surface.transmits() && area < SMALL * all;
        let may_be = self.options.caustic_roughness > 0.0;
        self.materials.iter().zip(areas).map(|of| may_be && is_small(of)).collect()
    }

    fn casts_caustics(&self, material: &Material) -> bool {
        let metallic = match material.surface {
            Surface::Diffuse { .. } => return false,
            Surface::Mirror { .. } | Surface::Glass { .. } | Surface::Pane { .. } => None,
            Surface::Layered { metallic, .. } => Some(metallic),
        };
        let casts = |roughness: f32, metal: f32| {
            material.roughness * roughness <= self.options.caustic_roughness
                && metallic.is_none_or(|metallic| metallic * metal >= METAL)
        };
        let texture = material.textures.metallic_roughness;
        match texture.and_then(|texture| self.images.get(texture.image as usize)) {
            // Nothing is sharper than a factor of 0, or more of metal than a factor of 1.
            Some(image) if casts(0.0, 1.0) => {
                let texel = |of: &[u8; 4]| casts(f32::from(of[1]) / 255.0, f32::from(of[2]) / 255.0);
                image.texels.iter().any(texel)
            }
            Some(_) => false,
            None => casts(1.0, 1.0),
        }
    }

    /// Whether a surface has a diffuse lobe, which photons are gathered for.
    #[must_use]
    pub fn has_diffuse(&self) -> bool {
        self.uses_material(|_, material| {
            let Textures { metallic_roughness, transmission, .. } = material.textures;
            let is_diffuse = match material.surface {
                Surface::Diffuse { .. } => true,
                Surface::Mirror { .. } => false,
                Surface::Layered { metallic, .. } => metallic < 1.0 || metallic_roughness.is_some(),
                Surface::Glass { .. } | Surface::Pane { .. } => material.transmission < 1.0 || transmission.is_some(),
            };
            is_diffuse && !material.unlit
        })
    }

    /// Whether a surface has another lobe than a diffuse one.
    #[must_use]
    pub fn has_lobes(&self) -> bool {
        self.uses_material(|_, m| !matches!(m.surface, Surface::Diffuse { .. }) || m.is_finished())
    }

    /// Whether a surface emits light.
    #[must_use]
    pub fn has_emission(&self) -> bool {
        self.uses_material(|_, material| material.emission != Vec3::ZERO)
    }

    /// Whether a triangle or sphere has a material that satisfies the predicate.
    fn uses_material(&self, predicate: impl Fn(usize, &Material) -> bool) -> bool {
        let satisfied: Vec<bool> = self.materials.iter().enumerate().map(|(i, m)| predicate(i, m)).collect();
        let satisfies = |material: u32| satisfied.get(material as usize) == Some(&true);
        self.triangles.iter().any(|triangle| satisfies(triangle.material))
            || self.spheres.iter().any(|sphere| satisfies(sphere.material))
            || self.meshes.iter().flat_map(|mesh| &mesh.triangles).any(|triangle| satisfies(triangle.material))
    }

    /// Number of triangles that are shown, those of each instance counted.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        let of = |instance: &Instance| self.meshes[instance.mesh as usize].triangles.len();
        self.triangles.len() + self.instances.iter().map(of).sum::<usize>()
    }

    /// Whether the scene names a light, dark or not.
    fn names_light(&self) -> bool {
        !self.lights.is_empty() || self.has_emission() || self.environment.is_some() || self.names_dark_light
    }

    /// Adds a soft uniform sky ([`Environment::sky`]) to a scene without any light, and a warning.
    /// A scene with a light or an environment keeps it, dark or not; if all are dark, a warning
    /// says so.
    pub fn add_default_light(&mut self) {
        if !self.names_light() {
            self.environment = Some(Environment::sky());
            self.warnings.push("no light: lit by a uniform sky of radiance 1".to_owned());
        } else if self.is_dark() {
            self.warnings.push("all lights are off: the picture is black".to_owned());
        }
    }

    /// Whether nothing gives light or shows a colour of its own, before textures.
    fn is_dark(&self) -> bool {
        self.lights.is_empty()
            && self.environment.as_ref().is_none_or(Environment::is_dark)
            && !self.uses_material(|_, material| material.emission != Vec3::ZERO || material.unlit)
    }

    /// Provenance of a picture, for the metadata of its file.
    #[must_use]
    pub fn origin<'a>(&'a self, settings: &'a Settings, stats: &'a Stats) -> Provenance<'a> {
        let environment = self.environment.as_ref().map(|environment| EnvironmentProvenance {
            name: &environment.name,
            hash: &environment.hash,
            radiance: (environment.pixels.len() == 1).then(|| environment.pixels[0]),
            strength: environment.strength,
            rotation: environment.rotation,
        });
        Provenance {
            scene: &self.file_name,
            scene_hash: &self.hash,
            options: &self.options,
            environment,
            objects: self.objects.iter().map(String::as_str).collect(),
            materials: self.materials.iter().map(|material| material.name.as_str()).collect(),
            settings,
            stats,
        }
    }

    /// Finds a camera by its name or by its index in [`Scene::cameras`]; the first if `wanted` is
    /// `None`.
    ///
    /// # Errors
    /// [`Error::Setting`], which lists the cameras.
    pub fn camera(&self, wanted: Option<&str>) -> Result<&Camera> {
        Ok(&self.cameras[self.camera_number(wanted)?])
    }

    /// Index in [`Scene::cameras`] of the camera that [`Scene::camera`] finds.
    ///
    /// # Errors
    /// As [`Scene::camera`].
    pub fn camera_number(&self, wanted: Option<&str>) -> Result<usize> {
        let numbered = |number: usize| (number < self.cameras.len()).then_some(number);
        let found = match wanted {
            None => numbered(0),
            Some(wanted) => {
                let named = self.cameras.iter().position(|camera| camera.name == wanted);
                named.or_else(|| numbered(wanted.parse().ok()?))
            }
        };
        found.ok_or_else(|| {
            let list: Vec<String> =
                self.cameras.iter().enumerate().map(|(i, camera)| format!("{i} {:?}", camera.name)).collect();
            Error::Setting {
                name: "picture.camera",
                value: wanted.unwrap_or("0").to_owned(),
                problem: format!("{} has the cameras {}", self.file_name, list.join(", ")),
            }
        })
    }

    /// Checks that the scene has geometry, and names a light; the light may be dark.
    ///
    /// # Errors
    /// [`Error::Scene`], which names what is missing.
    pub fn check_renderable(&self) -> Result<()> {
        let error =
            |place: &str, problem: String| Error::Scene { path: self.path.clone(), place: place.to_owned(), problem };
        if self.triangles.is_empty() && self.spheres.is_empty() && self.instances.is_empty() {
            let notes =
                if self.warnings.is_empty() { String::new() } else { format!(" ({})", self.warnings.join("; ")) };
            return Err(error("scene", format!("nothing to draw: it holds no triangle and no sphere{notes}")));
        }
        if !self.names_light() {
            let problem = "no light: add a light (KHR_lights_punctual) or an emissive material to the file, or give \
                           `scene.environment`";
            return Err(error("scene", problem.to_owned()));
        }
        Ok(())
    }
}
