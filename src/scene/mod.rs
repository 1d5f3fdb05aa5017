//! What a file holds, in the renderer's own nouns. Coordinates are metres, right-handed, +Y up, relative to
//! [`Scene::center`].

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use crate::{
    Error, Result,
    image::{EnvironmentOrigin, Origin},
    settings::Settings,
    stats::Stats,
};

mod camera;
mod describe;
mod environment;
mod gltf;
mod light;
mod load_options;
mod material;
mod shape;
mod words;

pub use camera::{Camera, Projection};
pub use describe::{CameraInfo, EmitterInfo, LightInfo, MaterialInfo, SceneInfo};
pub use environment::Environment;
pub use light::{LEAST_FALLOFF, LUMENS_PER_WATT, Light, LightKind};
pub use load_options::LoadOptions;
pub use material::{Material, MediaTable, Medium, Surface};
pub use shape::{Bounds, Sphere, Triangle};

/// A scene ready to be traced.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The file.
    pub path: PathBuf,
    /// File name without folders.
    pub file_name: String,
    /// Files that it names: buffers and images, read or not.
    pub files: Vec<PathBuf>,
    /// SHA-256 of the bytes of the file and of the buffers it names, in hexadecimal.
    pub hash: String,
    /// What was subtracted from every world coordinate of the file: the middle of its geometry.
    pub center: DVec3,
    pub triangles: Vec<Triangle>,
    pub spheres: Vec<Sphere>,
    pub materials: Vec<Material>,
    /// Lights without extent.
    pub lights: Vec<Light>,
    /// Light from infinitely far away, all around.
    pub environment: Option<Environment>,
    /// Never empty after [`Scene::load`]: a camera that frames the scene stands in where the file has none.
    pub cameras: Vec<Camera>,
    /// What was ignored or read in a special way, one line each.
    pub warnings: Vec<String>,
    /// Number of meshes in the file.
    pub mesh_count: usize,
}

impl Scene {
    /// Reads a `.gltf` or `.glb` file and the buffers beside it.
    ///
    /// # Errors
    /// [`Error::Io`] where the file cannot be read; [`Error::Scene`] with the JSON path of what is wrong in it.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_with(path, &LoadOptions::default())
    }

    /// [`Scene::load`] with a choice of scene and of what is allowed.
    ///
    /// # Errors
    /// As [`Scene::load`]; [`Error::Setting`] that lists the file's scenes where the one asked for is not among them.
    pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Self> {
        gltf::load(path, options)
    }

    /// Reads the bytes of a `.gltf` or `.glb` file as if they were those of the file at `path`, which need not be there:
    /// the buffers that they name are looked for beside it.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub fn read(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Self> {
        gltf::read(bytes, path, options)
    }

    /// Smallest box around all geometry, in scene coordinates; [`Bounds::EMPTY`] without any.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let triangles = self.triangles.iter().map(Bounds::from);
        triangles.chain(self.spheres.iter().map(Bounds::from)).fold(Bounds::EMPTY, Bounds::union)
    }

    /// Sphere around all geometry, about the middle of its box: centre and radius, metres. Zero and zero without
    /// geometry.
    #[must_use]
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let bounds = self.bounds();
        if bounds.min.x > bounds.max.x {
            return (Vec3::ZERO, 0.0);
        }
        let center = 0.5 * (bounds.min + bounds.max);
        let corners = self.triangles.iter().flat_map(|t| t.positions).map(|p| p.distance(center));
        let balls = self.spheres.iter().map(|s| s.center.distance(center) + s.radius);
        (center, corners.chain(balls).fold(0.0, f32::max))
    }

    /// Some surface scatters into single directions only, so that there can be caustics.
    #[must_use]
    pub fn has_delta(&self) -> bool {
        self.shows(|material| material.surface.is_delta())
    }

    /// Some surface gives light by itself.
    #[must_use]
    pub fn has_emission(&self) -> bool {
        self.shows(|material| material.emission != Vec3::ZERO)
    }

    /// Some triangle or sphere has such a material.
    fn shows(&self, such: impl Fn(&Material) -> bool) -> bool {
        let such: Vec<bool> = self.materials.iter().map(such).collect();
        let is_such = |material: u32| such.get(material as usize) == Some(&true);
        self.triangles.iter().any(|triangle| is_such(triangle.material))
            || self.spheres.iter().any(|sphere| is_such(sphere.material))
    }

    /// Lights a scene that has no light of its own by a soft uniform sky ([`Environment::sky`]), and notes it. A scene with an
    /// environment keeps it, dark or not.
    pub fn add_default_light(&mut self) {
        if self.lights.is_empty() && !self.has_emission() && self.environment.is_none() {
            self.environment = Some(Environment::sky());
            self.warnings.push("no light: lit by a uniform sky of radiance 1".to_owned());
        }
    }

    /// What a picture's file is to tell of where it comes from.
    #[must_use]
    pub fn origin<'a>(&'a self, settings: &'a Settings, stats: &'a Stats) -> Origin<'a> {
        let environment = self.environment.as_ref().map(|environment| EnvironmentOrigin {
            name: &environment.name,
            hash: &environment.hash,
            radiance: (environment.pixels.len() == 1).then(|| environment.pixels[0]),
            strength: environment.strength,
            rotation: environment.rotation,
        });
        Origin { scene: &self.file_name, scene_hash: &self.hash, environment, settings, stats }
    }

    /// The camera of that name, or of that number in [`Scene::cameras`]; the first if none is asked for.
    ///
    /// # Errors
    /// [`Error::Setting`] that lists the cameras.
    pub fn camera(&self, wanted: Option<&str>) -> Result<&Camera> {
        Ok(&self.cameras[self.camera_number(wanted)?])
    }

    /// Index in [`Scene::cameras`] of [`Scene::camera`].
    ///
    /// # Errors
    /// As there.
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
                name: "camera",
                value: wanted.unwrap_or("0").to_owned(),
                problem: format!("{} has the cameras {}", self.file_name, list.join(", ")),
            }
        })
    }

    /// Whether there is something to draw and light to see it by.
    ///
    /// # Errors
    /// [`Error::Scene`] that says what is missing.
    pub fn check_renderable(&self) -> Result<()> {
        let error =
            |place: &str, problem: String| Error::Scene { path: self.path.clone(), place: place.to_owned(), problem };
        if self.triangles.is_empty() && self.spheres.is_empty() {
            let notes =
                if self.warnings.is_empty() { String::new() } else { format!(" ({})", self.warnings.join("; ")) };
            return Err(error("scene", format!("nothing to draw: it holds no triangle and no sphere{notes}")));
        }
        if self.lights.is_empty() && !self.has_emission() && self.environment.as_ref().is_none_or(Environment::is_dark)
        {
            let problem = "no light: add a light (KHR_lights_punctual) or an emissive material to the file, or give \
                           --env, --background or --default-light sky";
            return Err(error("scene", problem.to_owned()));
        }
        Ok(())
    }
}
