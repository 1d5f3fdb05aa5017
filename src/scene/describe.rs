//! What a file holds and how it is read, for `caustica info`.

use std::fmt;

use serde::Serialize;

use super::{Projection, Scene};

/// Facts about a scene. Coordinates are the file's: metres in its world. Angles are in radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneInfo {
    pub file_name: String,
    /// SHA-256, in hexadecimal.
    pub hash: String,
    pub meshes: usize,
    pub triangles: usize,
    pub spheres: usize,
    /// Corners of the box around all geometry; none without any.
    pub bounds: Option<[[f64; 3]; 2]>,
    pub lights: Vec<LightInfo>,
    pub cameras: Vec<CameraInfo>,
    pub materials: Vec<MaterialInfo>,
    /// What is ignored or read in a special way.
    pub notes: Vec<String>,
}

/// A point light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightInfo {
    pub name: String,
    pub position: [f64; 3],
    /// Power in W, each channel: 4π I.
    pub power: [f32; 3],
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraInfo {
    pub name: String,
    pub position: [f64; 3],
    pub projection: Projection,
    /// Width over height, where the file says.
    pub aspect: Option<f32>,
}

/// A material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialInfo {
    pub name: String,
    /// The surface that it is read as.
    pub read_as: String,
}

impl Scene {
    /// What the file holds and how it is read.
    #[must_use]
    pub fn describe(&self) -> SceneInfo {
        let world = |point: glam::Vec3| (self.center + point.as_dvec3()).to_array();
        let bounds = self.bounds();
        SceneInfo {
            file_name: self.file_name.clone(),
            hash: self.hash.clone(),
            meshes: self.mesh_count,
            triangles: self.triangles.len(),
            spheres: self.spheres.len(),
            bounds: (bounds.min.x <= bounds.max.x).then(|| [world(bounds.min), world(bounds.max)]),
            lights: (self.lights.iter())
                .map(|light| LightInfo {
                    name: light.name.clone(),
                    position: world(light.position),
                    power: light.power(0.5 * bounds.diagonal()).to_array(),
                })
                .collect(),
            cameras: (self.cameras.iter())
                .map(|camera| CameraInfo {
                    name: camera.name.clone(),
                    position: world(camera.position),
                    projection: camera.projection,
                    aspect: camera.aspect,
                })
                .collect(),
            materials: (self.materials.iter())
                .map(|material| MaterialInfo { name: material.name.clone(), read_as: material.surface.to_string() })
                .collect(),
            notes: self.warnings.clone(),
        }
    }
}

/// Three numbers with about six digits of the largest.
fn triple(v: [f64; 3]) -> String {
    let largest = v.into_iter().map(f64::abs).fold(1e-6, f64::max);
    let digits = (5.0 - largest.log10().floor()).clamp(0.0, 9.0) as usize;
    v.map(|x| {
        let text = format!("{x:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    })
    .join(" ")
}

impl fmt::Display for SceneInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.file_name)?;
        writeln!(f, "  sha256     {}", self.hash)?;
        writeln!(f, "  meshes     {}", self.meshes)?;
        writeln!(f, "  triangles  {}", self.triangles)?;
        writeln!(f, "  spheres    {}", self.spheres)?;
        match self.bounds {
            Some([min, max]) => writeln!(f, "  bounds     {} .. {} m", triple(min), triple(max))?,
            None => writeln!(f, "  bounds     none: nothing to draw")?,
        }
        section(f, "point lights", self.lights.iter(), |light| {
            let power = triple(light.power.map(f64::from));
            format!("{}  at {}  {power} W", light.name, triple(light.position))
        })?;
        section(f, "cameras", self.cameras.iter(), |camera| {
            let aspect = camera.aspect.map_or(String::new(), |aspect| format!("  aspect {aspect}"));
            let view = match camera.projection {
                Projection::Perspective { yfov } => format!("yfov {:.2}°", yfov.to_degrees()),
                Projection::Orthographic { ymag } => format!("orthographic, ymag {ymag} m"),
            };
            format!("{}  at {}  {view}{aspect}", camera.name, triple(camera.position))
        })?;
        section(f, "materials", self.materials.iter(), |material| format!("{}  {}", material.name, material.read_as))?;
        section(f, "notes", self.notes.iter(), Clone::clone)
    }
}

/// A heading with the number of entries, and a line for each with its index.
fn section<T>(
    f: &mut fmt::Formatter<'_>,
    heading: &str,
    entries: impl ExactSizeIterator<Item = T>,
    line: impl Fn(T) -> String,
) -> fmt::Result {
    writeln!(f, "  {heading} ({})", entries.len())?;
    entries.enumerate().try_for_each(|(i, entry)| writeln!(f, "    {i}  {}", line(entry)))
}
