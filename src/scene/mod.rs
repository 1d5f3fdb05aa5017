//! What a file holds, in the renderer's own nouns. Coordinates are metres, right-handed, +Y up, relative to
//! [`Scene::center`].

use glam::{DVec3, Vec3};

mod gltf;

/// A triangle in scene coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    pub positions: [Vec3; 3],
    /// Unit normals at the corners, interpolated across the face.
    pub normals: [Vec3; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// An exact sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: Vec3,
    /// Metres, > 0.
    pub radius: f32,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// How a surface scatters light; colours are linear Rec.709, each channel 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Lambert reflectance.
    Diffuse { albedo: Vec3 },
    /// Perfect mirror.
    Mirror { tint: Vec3 },
    /// Closed solid of smooth dielectric.
    Glass { ior: f32, tint: Vec3 },
    /// Thin smooth dielectric sheet, crossed in a straight line.
    Pane { ior: f32, tint: Vec3 },
}

impl Surface {
    /// Scatters into single directions only.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        !matches!(self, Surface::Diffuse { .. })
    }
}

/// A named surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    pub surface: Surface,
}

/// A point light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    pub name: String,
    pub position: Vec3,
    /// Radiant intensity, W/sr in each channel, as the file's candela are read.
    pub intensity: Vec3,
}

/// A perspective camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    pub name: String,
    pub position: Vec3,
    /// Unit axes: right, up, and the direction of view.
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    /// Full vertical angle of view, radians.
    pub yfov: f32,
    /// Width over height, where the file says.
    pub aspect: Option<f32>,
}

/// A scene ready to be traced.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// File name without folders.
    pub file_name: String,
    /// Hash of the bytes of the file and of the buffers it names, in hexadecimal.
    pub hash: String,
    /// What was subtracted from every world coordinate of the file.
    pub center: DVec3,
    pub triangles: Vec<Triangle>,
    pub spheres: Vec<Sphere>,
    pub materials: Vec<Material>,
    pub lights: Vec<Light>,
    /// Never empty after [`Scene::load`]: a camera that frames the scene stands in where the file has none.
    pub cameras: Vec<Camera>,
    /// What was ignored or read in a special way, one line each.
    pub warnings: Vec<String>,
    /// Number of meshes in the file.
    pub mesh_count: usize,
}
