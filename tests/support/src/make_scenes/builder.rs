//! Builds a glTF file out of shapes, materials, lights and a camera.

use std::collections::BTreeSet;

use base64::Engine as _;
use glam::{Quat, Vec3};
use serde_json::{Value, json};

use super::json::text;

/// A glTF file under construction.
pub struct Builder {
    name: &'static str,
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    shapes: Vec<Value>,
    lights: Vec<Value>,
    camera: Option<Value>,
    extensions: BTreeSet<&'static str>,
    bytes: Vec<u8>,
}

/// Attributes or indices as bytes, and their format.
pub struct Data {
    pub bytes: Vec<u8>,
    pub count: usize,
    /// Component type, as numbered by glTF.
    pub component: u32,
    pub kind: &'static str,
    pub normalized: bool,
    pub stride: Option<usize>,
    /// Bounds of positions, in the units of the components.
    pub range: Option<[Vec<f64>; 2]>,
}

impl Builder {
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            nodes: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
            accessors: Vec::new(),
            views: Vec::new(),
            shapes: Vec::new(),
            lights: Vec::new(),
            camera: None,
            extensions: BTreeSet::new(),
            bytes: Vec::new(),
        }
    }

    /// Marks an extension as required.
    pub fn uses(&mut self, extension: &'static str) {
        self.extensions.insert(extension);
    }

    fn material(&mut self, material: Value) -> usize {
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Lambertian reflectance only.
    pub fn diffuse(&mut self, name: &str, [r, g, b]: [f64; 3]) -> usize {
        self.uses("KHR_materials_specular");
        self.material(json!({
            "name": name,
            "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 } },
        }))
    }

    /// Lambertian reflectance and emission: radiance `strength` times `color`, W/(m² sr), from the
    /// front side.
    pub fn emissive(&mut self, name: &str, reflectance: f64, color: [f64; 3], strength: f64) -> usize {
        let material = self.diffuse(name, [reflectance; 3]);
        self.uses("KHR_materials_emissive_strength");
        let json = &mut self.materials[material];
        json["doubleSided"] = false.into();
        json["emissiveFactor"] = json!(color);
        json["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
        material
    }

    pub fn mirror(&mut self, name: &str) -> usize {
        self.material(json!({
            "name": name,
            "pbrMetallicRoughness": { "metallicFactor": 1.0, "roughnessFactor": 0.0 },
        }))
    }

    /// Closed solid of smooth dielectric.
    pub fn glass(&mut self, name: &str, ior: f64) -> usize {
        self.extensions.extend(["KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_volume"]);
        self.material(json!({
            "name": name,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
            "extensions": {
                "KHR_materials_ior": { "ior": ior },
                "KHR_materials_transmission": { "transmissionFactor": 1.0 },
                "KHR_materials_volume": { "thicknessFactor": 1.0 },
            },
        }))
    }

    /// An exact sphere.
    pub fn sphere(&mut self, name: &str, center: Vec3, radius: f32, material: usize) {
        self.uses("KHR_implicit_shapes");
        self.shapes.push(json!({ "type": "sphere", "sphere": { "radius": decimal(radius) } }));
        self.nodes.push(json!({
            "name": name,
            "translation": decimals(center),
            "extensions": { "KHR_implicit_shapes": { "shape": self.shapes.len() - 1 } },
            "extras": { "material": material },
        }));
    }

    /// A point light of the same radiant intensity, W/sr, in each channel.
    pub fn light(&mut self, name: &str, position: Vec3, intensity: f64) {
        let light = json!({ "type": "point", "color": [1.0, 1.0, 1.0], "intensity": intensity });
        self.light_node(light, json!({ "name": name, "translation": decimals(position) }));
    }

    /// A spot light at a position, aimed at another: W/sr times `color` along its axis, half angles
    /// of its cones in degrees.
    pub fn spot(&mut self, name: &str, [from, to]: [Vec3; 2], intensity: f64, color: [f64; 3], cones: [f32; 2]) {
        let [inner, outer] = cones.map(|degrees| decimal(degrees.to_radians()));
        let spot = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
        let light = json!({ "type": "spot", "color": color, "intensity": intensity, "spot": spot });
        let node = json!({ "name": name, "translation": decimals(from), "rotation": aim(to - from) });
        self.light_node(light, node);
    }

    /// A directional light: irradiance at normal incidence of W/m² times `color`.
    pub fn sun(&mut self, name: &str, direction: Vec3, irradiance: f64, color: [f64; 3]) {
        let light = json!({ "type": "directional", "color": color, "intensity": irradiance });
        self.light_node(light, json!({ "name": name, "rotation": aim(direction) }));
    }

    fn light_node(&mut self, light: Value, mut node: Value) {
        self.uses("KHR_lights_punctual");
        self.lights.push(light);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": self.lights.len() - 1 } });
        self.nodes.push(node);
    }

    /// The camera, looking along -Z and rotated about X by `pitch` degrees (down < 0).
    pub fn camera(&mut self, position: Vec3, pitch: f32, yfov: f32, aspect: f32) {
        let rotation = Quat::from_rotation_x(pitch.to_radians()).to_array().map(decimal);
        self.camera = Some(json!({
            "type": "perspective",
            "perspective": { "yfov": decimal(yfov.to_radians()), "aspectRatio": decimal(aspect), "znear": 0.01 },
        }));
        self.nodes.push(json!({
            "name": "camera",
            "camera": 0,
            "translation": decimals(position),
            "rotation": rotation,
        }));
    }

    /// Appends bytes. Returns the index of their accessor.
    pub fn accessor(&mut self, data: Data) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": data.bytes.len() });
        let target = if data.kind == "SCALAR" { 34963 } else { 34962 };
        view["target"] = target.into();
        if let Some(stride) = data.stride {
            view["byteStride"] = stride.into();
        }
        self.bytes.extend(&data.bytes);
        self.views.push(view);
        let mut accessor = json!({
            "bufferView": self.views.len() - 1,
            "componentType": data.component,
            "count": data.count,
            "type": data.kind,
        });
        if data.normalized {
            accessor["normalized"] = true.into();
        }
        if let Some([min, max]) = data.range {
            accessor["min"] = min.into();
            accessor["max"] = max.into();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds a mesh of one primitive. Returns its index.
    pub fn mesh(&mut self, name: &str, positions: Data, normals: Data, indices: Data, material: usize) -> usize {
        let [positions, normals, indices] = [positions, normals, indices].map(|data| self.accessor(data));
        self.meshes.push(json!({
            "name": name,
            "primitives": [{
                "attributes": { "POSITION": positions, "NORMAL": normals },
                "indices": indices,
                "material": material,
            }],
        }));
        self.meshes.len() - 1
    }

    pub fn node(&mut self, node: Value) {
        self.nodes.push(node);
    }

    /// The file's text and its buffer: in a file of its own if that has a name, else in a data URI.
    pub fn finish(mut self, bin: Option<&str>) -> (Vec<u8>, Vec<u8>) {
        if self.camera.is_none() {
            self.camera(Vec3::new(0.0, 1.0, 4.5), 0.0, 31.5, 1.0);
        }
        let encoded = || base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let uri = bin.map_or_else(|| format!("data:application/octet-stream;base64,{}", encoded()), str::to_owned);
        let mut extensions = json!({});
        if !self.lights.is_empty() {
            extensions["KHR_lights_punctual"] = json!({ "lights": self.lights });
        }
        if !self.shapes.is_empty() {
            extensions["KHR_implicit_shapes"] = json!({ "shapes": self.shapes });
        }
        let mut root = json!({
            "asset": { "version": "2.0", "generator": "caustica make_scenes" },
            "extensionsUsed": self.extensions,
            "scene": 0,
            "scenes": [{ "name": self.name, "nodes": (0..self.nodes.len()).collect::<Vec<_>>() }],
            "nodes": self.nodes,
            "cameras": [self.camera],
            "extensions": extensions,
            "materials": self.materials,
            "meshes": self.meshes,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len(), "uri": uri }],
        });
        if self.extensions.contains("KHR_mesh_quantization") {
            root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        }
        (format!("{}\n", text(&root, 0)).into_bytes(), self.bytes)
    }
}

/// The shortest decimal number that reads back as the same `f32`.
fn decimal(x: f32) -> f64 {
    x.to_string().parse().expect("a number's own text is a number")
}

/// Rotation that takes -Z to a direction.
fn aim(direction: Vec3) -> [f64; 4] {
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, direction.normalize()).to_array();
    rotation.map(|x| decimal((x * 1e6).round() / 1e6))
}

fn decimals(v: Vec3) -> [f64; 3] {
    v.to_array().map(decimal)
}
