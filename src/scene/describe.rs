//! Scene summary for `caustica info`.

use std::{f64::consts::PI, fmt};

use glam::DVec3;
use serde::Serialize;

use crate::layout::{self, BvhNode, Normals, Primitive};

use super::{
    Cut, EmissionMap, LightKind, Projection, Scene,
    describe_materials::{self, ImageInfo, MaterialInfo},
    words::one_line,
};

/// Nodes of a tree for each of its primitives.
const NODES_OF_PRIMITIVE: f64 = 0.2;

/// Summary of a scene. Coordinates are those of the file: world space, metres. Angles are in
/// radians.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneInfo {
    /// File name without folders.
    pub file_name: String,
    /// SHA-256, in hexadecimal.
    pub hash: String,
    /// Number of meshes in the file.
    pub meshes: usize,
    /// Number of triangles, those of each instance counted.
    pub triangles: usize,
    /// Number of instances, places of meshes that are held once.
    pub instances: usize,
    /// Number of triangles that are held.
    pub stored_triangles: usize,
    /// Memory of geometry and its tree on the device, bytes; about, since the tree follows the
    /// scene.
    pub geometry_bytes: u64,
    /// Number of exact spheres.
    pub spheres: usize,
    /// Corners of the bounding box of all geometry; `None` if there is no geometry.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Punctual lights.
    pub lights: Vec<LightInfo>,
    /// Emissive materials in use.
    pub emitters: Vec<EmitterInfo>,
    /// Cameras.
    pub cameras: Vec<CameraInfo>,
    /// Materials.
    pub materials: Vec<MaterialInfo>,
    /// Images of the materials' textures.
    pub images: Vec<ImageInfo>,
    /// Variants of the materials that the file names.
    pub variants: Vec<String>,
    /// Features that are ignored or approximated.
    pub notes: Vec<String>,
}

/// Punctual light.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightInfo {
    /// Name of the light.
    pub name: String,
    /// Kind of the light.
    pub kind: LightKind,
    /// `None` for a directional light.
    pub position: Option<[f64; 3]>,
    /// Unit vector along which it shines; `None` for a point light.
    pub direction: Option<[f32; 3]>,
    /// Power, W in each channel; of a directional light, the power received by the bounding sphere
    /// of the scene.
    pub power: [f64; 3],
}

/// All surfaces of one emissive material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EmitterInfo {
    /// Name of the material.
    pub name: String,
    /// Number of triangles of the material.
    pub triangles: usize,
    /// Number of spheres of the material.
    pub spheres: usize,
    /// Area of one side, m².
    pub area: f64,
    /// Emitted radiance, W/(m² sr) in each channel, before its texture and opacity.
    pub radiance: [f32; 3],
    /// Whether both sides emit.
    pub double_sided: bool,
    /// Power, W in each channel: π times radiance and area, times the mean of its texture and
    /// opacity, of both sides if the material is double-sided.
    pub power: [f64; 3],
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraInfo {
    /// Name of the camera.
    pub name: String,
    /// Position, metres.
    pub position: [f64; 3],
    /// Projection.
    pub projection: Projection,
    /// Aspect ratio, width over height, if the file gives one.
    pub aspect: Option<f32>,
}

impl Scene {
    /// Summarizes the scene.
    #[must_use]
    pub fn describe(&self) -> SceneInfo {
        let world = |point: glam::Vec3| (self.center + point.as_dvec3()).to_array();
        let bounds = self.bounds();
        SceneInfo {
            file_name: self.file_name.clone(),
            hash: self.hash.clone(),
            meshes: self.mesh_count,
            triangles: self.triangle_count(),
            instances: self.instances.len(),
            stored_triangles: self.stored_triangles(),
            geometry_bytes: self.geometry_bytes(),
            spheres: self.spheres.len(),
            bounds: (bounds.min.x <= bounds.max.x).then(|| [world(bounds.min), world(bounds.max)]),
            lights: (self.lights.iter())
                .map(|light| LightInfo {
                    name: light.name.clone(),
                    kind: light.kind,
                    position: (light.kind != LightKind::Directional).then(|| world(light.position)),
                    direction: (light.kind != LightKind::Point).then(|| light.direction.to_array()),
                    power: light.power(self.bounding_sphere().1).to_array(),
                })
                .collect(),
            emitters: self.emitters(),
            cameras: (self.cameras.iter())
                .map(|camera| CameraInfo {
                    name: camera.name.clone(),
                    position: world(camera.position),
                    projection: camera.projection,
                    aspect: camera.aspect,
                })
                .collect(),
            materials: self.materials.iter().map(|material| MaterialInfo::new(material, &self.images)).collect(),
            images: describe_materials::images(self),
            variants: self.variants.clone(),
            notes: self.warnings.iter().cloned().chain(self.dark_emitters()).collect(),
        }
    }

    /// What rendering would say of emitters whose textures leave no light.
    fn dark_emitters(&self) -> impl Iterator<Item = String> {
        let dark = self.emitters().into_iter().filter(|emitter| emitter.power == [0.0; 3]);
        dark.map(|emitter| format!("material {:?} is black wherever it is seen: it gives no light", emitter.name))
    }

    fn stored_triangles(&self) -> usize {
        self.triangles.len() + self.meshes.iter().map(|mesh| mesh.triangles.len()).sum::<usize>()
    }

    fn geometry_bytes(&self) -> u64 {
        let primitives = (self.stored_triangles() + self.spheres.len() + self.instances.len()) as u64;
        let of_primitive = (size_of::<Primitive>() + size_of::<Normals>()) as u64;
        primitives * of_primitive
            + (primitives as f64 * NODES_OF_PRIMITIVE) as u64 * size_of::<BvhNode>() as u64
            + (self.instances.len() * size_of::<layout::Instance>()) as u64
            + (self.attributes.len() * size_of::<layout::Attributes>()) as u64
    }

    /// Emissive materials of visible geometry.
    fn emitters(&self) -> Vec<EmitterInfo> {
        let mut emitters: Vec<EmitterInfo> = (self.materials.iter())
            .map(|material| EmitterInfo {
                name: material.name.clone(),
                triangles: 0,
                spheres: 0,
                area: 0.0,
                radiance: material.emission.to_array(),
                double_sided: material.double_sided,
                power: [0.0; 3],
            })
            .collect();
        let varied = EmissionMap::new(self).cut();
        // Areas, times the mean of what varies the emission.
        let mut lit = vec![DVec3::ZERO; emitters.len()];
        let mut add = |primitive: usize, material: u32, area: f64| {
            emitters[material as usize].area += area;
            lit[material as usize] += varied.get(&primitive).map_or(DVec3::ONE, Cut::mean) * area;
        };
        for (i, triangle) in self.triangles.iter().enumerate() {
            add(i, triangle.material, triangle.area());
        }
        for (i, sphere) in self.spheres.iter().enumerate() {
            add(self.triangles.len() + i, sphere.material, sphere.area());
        }
        self.triangles.iter().for_each(|triangle| emitters[triangle.material as usize].triangles += 1);
        self.spheres.iter().for_each(|sphere| emitters[sphere.material as usize].spheres += 1);
        for (emitter, lit) in emitters.iter_mut().zip(lit) {
            let sides = if emitter.double_sided { 2.0 } else { 1.0 };
            emitter.power = [0, 1, 2].map(|c| PI * sides * lit[c] * f64::from(emitter.radiance[c]));
        }
        emitters.retain(|emitter| emitter.radiance != [0.0; 3] && emitter.area > 0.0);
        emitters
    }
}

/// Formats three numbers with about six digits of the largest.
fn triple(v: [f64; 3]) -> String {
    let largest = v.into_iter().map(f64::abs).fold(1e-6, f64::max);
    v.map(|x| decimal(x, largest)).join(" ")
}

/// A number with about six digits of `largest`.
fn decimal(x: f64, largest: f64) -> String {
    let digits = (5.0 - largest.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

impl fmt::Display for SceneInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.file_name)?;
        writeln!(f, "  sha256     {}", self.hash)?;
        writeln!(f, "  meshes     {}", self.meshes)?;
        match self.instances {
            0 => writeln!(f, "  triangles  {}", self.triangles)?,
            n => writeln!(
                f,
                "  triangles  {}, {n} instances share those of {} in memory",
                self.triangles, self.stored_triangles
            )?,
        }
        writeln!(f, "  spheres    {}", self.spheres)?;
        writeln!(f, "  geometry   about {} bytes on the device", self.geometry_bytes)?;
        match self.bounds {
            Some([min, max]) => writeln!(f, "  bounds     {} .. {} m", triple(min), triple(max))?,
            None => writeln!(f, "  bounds     none: nothing to draw")?,
        }
        section(f, "lights", self.lights.iter(), ToString::to_string)?;
        section(f, "emissive materials", self.emitters.iter(), ToString::to_string)?;
        section(f, "cameras", self.cameras.iter(), |camera| {
            let aspect = camera.aspect.map_or(String::new(), |aspect| format!("  aspect {aspect}"));
            let view = match camera.projection {
                Projection::Perspective { yfov } => format!("yfov {:.2}°", yfov.to_degrees()),
                Projection::Orthographic { ymag } => format!("orthographic, ymag {ymag} m"),
            };
            format!("{}  at {}  {view}{aspect}", camera.name, triple(camera.position))
        })?;
        writeln!(f, "  materials ({})", self.materials.len())?;
        for (i, material) in self.materials.iter().enumerate() {
            writeln!(f, "    {i}  {material}")?;
            material.textures.iter().try_for_each(|texture| writeln!(f, "         {texture}"))?;
        }
        if !self.images.is_empty() {
            section(f, "images", self.images.iter(), ToString::to_string)?;
        }
        if !self.variants.is_empty() {
            section(f, "variants", self.variants.iter(), Clone::clone)?;
        }
        section(f, "notes", self.notes.iter(), Clone::clone)
    }
}

impl fmt::Display for LightInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}  ", self.name)?;
        match self.kind {
            LightKind::Point => write!(f, "point")?,
            LightKind::Spot { inner, outer } => {
                write!(f, "spot {:.2}° to {:.2}°", inner.to_degrees(), outer.to_degrees())?;
            }
            LightKind::Directional => write!(f, "directional")?,
        }
        if let Some(position) = self.position {
            write!(f, "  at {}", triple(position))?;
        }
        if let Some(direction) = self.direction {
            write!(f, "  along {}", triple(direction.map(f64::from)))?;
        }
        write!(f, "  {} W", triple(self.power))
    }
}

impl fmt::Display for EmitterInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counted = |n: usize, what: &str| match n {
            0 => String::new(),
            1 => format!("  1 {what}"),
            n => format!("  {n} {what}s"),
        };
        let shapes = counted(self.triangles, "triangle") + &counted(self.spheres, "sphere");
        let sides = if self.double_sided { " on both sides" } else { "" };
        let area = decimal(self.area, self.area.max(1e-6));
        let radiance = triple(self.radiance.map(f64::from));
        write!(f, "{}{shapes}  {area} m²{sides}  {radiance} W/(m² sr)  {} W", self.name, triple(self.power))
    }
}

/// Writes a heading with the number of entries, and one line for each entry with its index.
fn section<T>(
    f: &mut fmt::Formatter<'_>,
    heading: &str,
    entries: impl ExactSizeIterator<Item = T>,
    line: impl Fn(T) -> String,
) -> fmt::Result {
    writeln!(f, "  {heading} ({})", entries.len())?;
    entries.enumerate().try_for_each(|(i, entry)| writeln!(f, "    {i}  {}", one_line(&line(entry))))
}
