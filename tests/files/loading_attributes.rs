//! Attributes of corners of triangles for textures: coordinates, colours, tangents.

use caustica::scene::{Attributes, Scene};
use glam::{Vec2, Vec3, Vec4, vec3};
use serde_json::{Value, json};
use support::gltf::{add_accessor, floats, lambert, load, loaded, message, push, triangle};

use super::pictures::{add_texture, png, textured, uniform};

const CORNERS: [Vec2; 3] = [Vec2::ZERO, Vec2::X, Vec2::Y];

/// The attributes of the only triangle.
fn only(scene: &Scene) -> Attributes {
    assert_eq!((scene.triangles.len(), scene.attributes.len()), (1, 1));
    assert_eq!((scene.triangles[0].attributes, scene.triangles[0].is_turned), (1, false));
    scene.attributes[0]
}

/// Sets an attribute of the only primitive to new elements.
fn set(gltf: &mut Value, name: &str, (bytes, component, kind): (&[u8], u32, &str), normalized: bool) {
    let accessor = add_accessor(gltf, bytes, component, 3, kind);
    gltf["accessors"][accessor]["normalized"] = normalized.into();
    gltf["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
}

#[test]
fn only_what_needs_attributes_has_them() {
    let plain = loaded(&triangle());
    assert_eq!((plain.attributes.len(), plain.triangles[0].attributes), (0, 0));
    // Texture coordinates that no texture asks for, and colours that change nothing.
    let mut gltf = textured();
    gltf["materials"][0] = lambert([1.0; 3]);
    set(&mut gltf, "COLOR_0", (&[255; 9], 5121, "VEC3"), true);
    assert_eq!(loaded(&gltf).attributes.len(), 0);
    let textured = only(&loaded(&textured()));
    assert_eq!(textured, Attributes { uvs: [CORNERS, [Vec2::ZERO; 3]], ..Attributes::default() });
}

#[test]
fn texture_coordinates_of_all_formats_are_read() {
    let uvs = |bytes: &[u8], component: u32, normalized: bool, quantized: bool| {
        let mut gltf = textured();
        if quantized {
            gltf["extensionsUsed"].as_array_mut().expect("a list").push("KHR_mesh_quantization".into());
        }
        set(&mut gltf, "TEXCOORD_0", (bytes, component, "VEC2"), normalized);
        load(&gltf).map(|scene| only(&scene).uvs[0])
    };
    let bytes = [0, 0, 255, 0, 0, 255];
    let read = |result: caustica::Result<[Vec2; 3]>| result.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read(uvs(&bytes, 5121, true, false)), CORNERS);
    let words: Vec<u8> = bytes.iter().flat_map(|byte| [*byte, *byte]).collect();
    assert_eq!(read(uvs(&words, 5123, true, false)), CORNERS);
    assert_eq!(read(uvs(&bytes, 5121, false, true)), CORNERS.map(|uv| 255.0 * uv), "for a transform to scale");
    assert_eq!(read(uvs(&[0, 0, 129, 0, 0, 127], 5120, true, true)), [Vec2::ZERO, -Vec2::X, Vec2::Y]);
    let place = "meshes[0].primitives[0].attributes.TEXCOORD_0";
    let refused = |result: caustica::Result<[Vec2; 3]>| result.expect_err("refused").to_string();
    for (plain, format) in [(uvs(&bytes, 5121, false, false), "U8"), (uvs(&bytes, 5120, true, false), "normalized I8")]
    {
        let said = refused(plain);
        assert!(
            said.ends_with(&format!("{place}: is Vec2 of {format}, which texture coordinates cannot be")),
            "{said}"
        );
    }
}

#[test]
fn colours_of_all_formats_are_read_and_clamped() {
    let colors = |bytes: &[u8], component: u32, kind: &str, normalized: bool| {
        let mut gltf = triangle();
        set(&mut gltf, "COLOR_0", (bytes, component, kind), normalized);
        load(&gltf).map(|scene| only(&scene).colors)
    };
    let expected = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 1.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)];
    let read = |result: caustica::Result<[Vec4; 3]>| result.unwrap_or_else(|error| panic!("{error}"));
    let bytes = [255, 0, 0, 0, 255, 0, 0, 0, 255];
    assert_eq!(read(colors(&bytes, 5121, "VEC3", true)), expected);
    let words: Vec<u8> = bytes.iter().flat_map(|byte| [*byte, *byte]).collect();
    assert_eq!(read(colors(&words, 5123, "VEC3", true)), expected);
    let numbers = floats(&[2.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.5, 0.0, 0.0, 1.0, 1.0]);
    assert_eq!(read(colors(&numbers, 5126, "VEC4", false)), expected);
    let veiled = floats(&[1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 1.0, 0.25, 1.0, 1.0, 1.0, 1.0]);
    assert_eq!(read(colors(&veiled, 5126, "VEC4", false)).map(|color| color.w), [0.5, 0.25, 1.0]);
    let said = colors(&bytes, 5121, "VEC3", false).expect_err("refused").to_string();
    assert!(said.ends_with("attributes.COLOR_0: is Vec3 of U8, which colours cannot be"), "{said}");
}

#[test]
fn a_material_uses_two_sets_of_texture_coordinates() {
    let mut gltf = textured();
    for set_of in [3, 5] {
        let offset = set_of as f32;
        let uvs = floats(&[offset, 0.0, offset, 1.0, offset, 2.0]);
        set(&mut gltf, &format!("TEXCOORD_{set_of}"), (&uvs, 5126, "VEC2"), false);
    }
    let transform = json!({ "KHR_texture_transform": { "texCoord": 3 } });
    let material = &mut gltf["materials"][0];
    material["pbrMetallicRoughness"]["baseColorTexture"] =
        json!({ "index": 0, "texCoord": 5, "extensions": transform });
    material["normalTexture"] = json!({ "index": 0, "texCoord": 0 });
    material["emissiveTexture"] = json!({ "index": 0, "texCoord": 5 });
    material["emissiveFactor"] = json!([1, 1, 1]);
    let scene = loaded(&gltf);
    let textures = &scene.materials[0].textures;
    assert_eq!(textures.base_color.map(|texture| texture.uv_set), Some(0), "the transform's number counts");
    assert_eq!((textures.normal.map(|texture| texture.uv_set), textures.emission), (Some(1), None));
    assert_eq!(only(&scene).uvs, [[0.0, 1.0, 2.0].map(|v| Vec2::new(3.0, v)), CORNERS]);
    let said = "material \"paint\": emissiveTexture is left out: its TEXCOORD_5 is one more than the 2 sets of texture \
                coordinates that a material can use";
    assert_eq!(scene.warnings, [said]);
}

#[test]
fn what_lacks_texture_coordinates_has_the_material_without_its_texture() {
    let mut gltf = textured();
    gltf["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 1.into();
    gltf["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = 0.into();
    gltf["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({ "index": 0 });
    let mut bare = gltf["meshes"][0].clone();
    bare["name"] = "bare".into();
    bare["primitives"][0]["attributes"].as_object_mut().expect("an object").remove("TEXCOORD_0");
    let mesh = push(&mut gltf, "meshes", bare);
    let node = push(&mut gltf, "nodes", json!({ "mesh": mesh, "translation": [0, 0, 1] }));
    gltf["scenes"][0]["nodes"].as_array_mut().expect("a list").push(node.into());
    let scene = loaded(&gltf);
    let said = "mesh \"bare\" has no TEXCOORD_0: material \"paint\" is there without what needs it";
    assert_eq!(scene.warnings, [said]);
    let [first, second] = [0, 1].map(|i| &scene.materials[scene.triangles[i].material as usize]);
    assert!(first.textures.base_color.is_some() && second.textures.base_color.is_none());
    assert!(!matches!(first.surface, caustica::scene::Surface::Mirror { .. }), "its texture tells what is metal");
    assert!(
        matches!(second.surface, caustica::scene::Surface::Mirror { .. }),
        "the factors alone are those of a mirror"
    );
    assert_eq!([0, 1].map(|i| scene.triangles[i].attributes), [1, 0]);
}

#[test]
fn exact_spheres_have_no_texture_coordinates() {
    let mut gltf = textured();
    gltf["extensions"]["KHR_implicit_shapes"] = json!({ "shapes": [{ "type": "sphere" }] });
    gltf["nodes"][1] = json!({ "extensions": { "KHR_implicit_shapes": { "shape": 0 } }, "extras": { "material": 0 } });
    let scene = loaded(&gltf);
    let said = "the sphere of nodes[1] has no TEXCOORD_0: material \"paint\" is there without what needs it";
    assert_eq!(scene.warnings, [said]);
    let textures = |material: u32| scene.materials[material as usize].textures;
    assert_eq!(textures(scene.spheres[0].material).base_color, None);
    assert!(textures(scene.triangles[0].material).base_color.is_some());
}

/// A textured triangle with a normal map, facing +Z.
fn with_normal_map() -> Value {
    let mut gltf = textured();
    let map = add_texture(&mut gltf, &png(uniform(1, 1, [128, 128, 255, 255])));
    gltf["materials"][0]["normalTexture"] = json!({ "index": map });
    set(&mut gltf, "NORMAL", (&floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]), 5126, "VEC3"), false);
    gltf
}

/// Normal and tangent plane of the first corner: tangent and bitangent.
fn frame(scene: &Scene) -> [Vec3; 2] {
    let attributes = only(scene);
    let (tangent, normal) = (attributes.tangents[0], scene.triangles[0].normals[0]);
    assert!(attributes.tangents.iter().all(|tangent| tangent.w.abs() == 1.0 && tangent.truncate().is_normalized()));
    [tangent.truncate(), tangent.w * normal.cross(tangent.truncate())]
}

fn near([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> bool {
    (a - c).length() < 1e-5 && (b - d).length() < 1e-5
}

#[test]
fn tangents_are_made_along_the_image() {
    let uvs = |uvs: [f32; 6]| {
        let mut gltf = with_normal_map();
        set(&mut gltf, "TEXCOORD_0", (&floats(&uvs), 5126, "VEC2"), false);
        loaded(&gltf)
    };
    // v points down in the image. With v = y, the top of the image is at small y.
    let upside_down = uvs([0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    assert!(near(frame(&upside_down), [Vec3::X, -Vec3::Y]), "{:?}", frame(&upside_down));
    let upright = uvs([0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    assert!(near(frame(&upright), [Vec3::X, Vec3::Y]));
    assert_eq!(only(&upright).tangents[0].w, 1.0, "not mirrored, as seen from the front");
    let mirrored = uvs([1.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    assert!(near(frame(&mirrored), [-Vec3::X, Vec3::Y]));
    assert_eq!(only(&mirrored).tangents[0].w, -1.0);
    // Texture coordinates without an area determine no direction: any in the plane will do.
    let none = frame(&uvs([0.5; 6]));
    assert!(none.iter().all(|axis| axis.is_normalized() && axis.z.abs() < 1e-6), "{none:?}");
    // A transform turns the image on the surface, and its tangents with it.
    let mut turned = with_normal_map();
    let transform = json!({ "KHR_texture_transform": { "rotation": std::f32::consts::FRAC_PI_2 } });
    turned["materials"][0]["normalTexture"]["extensions"] = transform;
    // u' = v = y and v' = -u = -x.
    assert!(near(frame(&loaded(&turned)), [Vec3::Y, Vec3::X]));
    // Without a normal map there are none.
    assert_eq!(only(&loaded(&textured())).tangents, [Vec4::ZERO; 3]);
}

#[test]
fn tangents_of_the_file_follow_their_node() {
    let tangent = |change: &dyn Fn(&mut Value)| {
        let mut gltf = with_normal_map();
        let tangents = floats(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
        set(&mut gltf, "TANGENT", (&tangents, 5126, "VEC4"), false);
        change(&mut gltf);
        loaded(&gltf)
    };
    let plain = tangent(&|_| {});
    assert!(near(frame(&plain), [Vec3::Y, -Vec3::X]));
    let turned = tangent(&|g| g["nodes"][0]["rotation"] = json!([0.5_f64.sqrt(), 0, 0, 0.5_f64.sqrt()]));
    assert!(near(frame(&turned), [Vec3::Z, -Vec3::X]));
    let stretched = tangent(&|g| g["nodes"][0]["scale"] = json!([1, 5, 1]));
    assert!(near(frame(&stretched), [Vec3::Y, -Vec3::X]));
    // Mirrored in x: what pointed to -x points to +x, though the normal stays; corners are swapped.
    let mirrored = tangent(&|g| g["nodes"][0]["scale"] = json!([-1, 1, 1]));
    assert!(near(frame(&mirrored), [Vec3::Y, Vec3::X]), "{:?}", frame(&mirrored));
    assert_eq!(only(&mirrored).tangents[0].w, -1.0);
    assert_eq!(only(&mirrored).uvs[0], [Vec2::ZERO, Vec2::Y, Vec2::X]);
    // Made tangents are mirrored alike, and belong to the same corners.
    let mut made = with_normal_map();
    let before = frame(&loaded(&made));
    made["nodes"][0]["scale"] = json!([-1, 1, 1]);
    assert!(near(frame(&loaded(&made)), before.map(|axis| axis * Vec3::new(-1.0, 1.0, 1.0))));
    // Without normals, the file's tangents count for nothing (glTF 2.0, 3.7.2.1).
    let flat = tangent(&|g| {
        g["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("an object").remove("NORMAL");
    });
    assert!(near(frame(&flat), before));
    let said = {
        let mut gltf = with_normal_map();
        set(&mut gltf, "TANGENT", (&floats(&[1.0; 9]), 5126, "VEC3"), false);
        message(load(&gltf))
    };
    assert_eq!(said, "meshes[0].primitives[0].attributes.TANGENT: is Vec3 of F32, which tangents cannot be");
}

#[test]
fn attributes_stay_with_their_triangles_when_others_are_left_out() {
    let mut gltf = textured();
    // A second triangle of the same mesh without an area, a copy of the mesh, and one that is moved
    // and has other coordinates.
    let indices = add_accessor(&mut gltf, &[0, 1, 1, 0, 1, 2], 5121, 6, "SCALAR");
    gltf["meshes"][0]["primitives"][0]["indices"] = indices.into();
    let mut other = gltf["meshes"][0].clone();
    let uvs = add_accessor(&mut gltf, &floats(&[5.0, 5.0, 6.0, 5.0, 5.0, 6.0]), 5126, 3, "VEC2");
    other["primitives"][0]["attributes"]["TEXCOORD_0"] = uvs.into();
    let other = push(&mut gltf, "meshes", other);
    for node in [json!({ "mesh": 0 }), json!({ "mesh": other, "translation": [0, 0, 1] })] {
        let node = push(&mut gltf, "nodes", node);
        gltf["scenes"][0]["nodes"].as_array_mut().expect("a list").push(node.into());
    }
    let uvs = |gltf: &Value| {
        let scene = loaded(gltf);
        assert_eq!(scene.attributes.len(), scene.triangles.len(), "none is left over");
        let of = |triangle: &caustica::scene::Triangle| scene.attributes[triangle.attributes as usize - 1].uvs[0][0];
        scene.triangles.iter().map(of).collect::<Vec<_>>()
    };
    assert_eq!(uvs(&gltf), [Vec2::ZERO, Vec2::splat(5.0)]);
    // Other coordinates in the same place are no copy.
    gltf["nodes"][4]["translation"] = json!([0, 0, 0]);
    assert_eq!(uvs(&gltf), [Vec2::ZERO, Vec2::splat(5.0)]);
    // But a lamp in a lamp is one lamp.
    gltf["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    assert_eq!(uvs(&gltf), [Vec2::ZERO]);
}

#[test]
fn normals_behind_their_triangles_are_turned_with_their_maps() {
    // Corner normals and what a texel of (0.6, 0, 0.8) gives there, and whether a note tells.
    let read = |normals: [[f32; 3]; 3]| {
        let mut gltf = with_normal_map();
        let normals = add_accessor(&mut gltf, &floats(normals.as_flattened()), 5126, 3, "VEC3");
        gltf["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
        let scene = loaded(&gltf);
        let (tangents, normals) = (only(&scene).tangents, scene.triangles[0].normals);
        let mapped = [0, 1, 2].map(|i| 0.6 * tangents[i].truncate() + 0.8 * normals[i]);
        (normals, mapped, scene.warnings.iter().any(|note| note.contains("point behind them and are turned")))
    };
    let front = loaded(&with_normal_map()).triangles[0].geometric_normal();
    let leaning = [0.3, 0.0, -0.3].map(|x| (front + vec3(x, 0.0, 0.0)).normalize().to_array());
    let (right, right_mapped, told) = read(leaning);
    assert!(!told && right.iter().all(|normal| normal.dot(front) > 0.9));
    let behind = leaning.map(|normal| normal.map(|x| -x));
    let (turned, mapped, told) = read(behind);
    assert!(told && turned == right, "{turned:?} {right:?}");
    assert!(mapped.iter().zip(right_mapped).all(|(a, b)| a.dot(front) > 0.0 && b.dot(front) > 0.0), "{mapped:?}");
    // Control: of a triangle at an edge, where one normal points to the front, none is turned.
    let (mixed, _, told) = read([behind[0], behind[1], leaning[2]]);
    assert!(!told && mixed[0].dot(front) < 0.0 && mixed[2].dot(front) > 0.0, "{mixed:?}");
}

#[test]
fn normal_maps_of_turned_glass_stand_out_to_the_other_side() {
    // A tetrahedron whose faces look inwards, with a normal map.
    let mut gltf = with_normal_map();
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0_f32]];
    let inwards =
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]].as_flattened().iter().map(|i| corners[*i]).collect::<Vec<_>>();
    let uvs: Vec<f32> = [[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]; 4].as_flattened().to_vec();
    let mut primitive = json!({ "attributes": {}, "material": 0 });
    for (name, numbers, kind) in [("POSITION", inwards.as_flattened(), "VEC3"), ("TEXCOORD_0", &uvs, "VEC2")] {
        primitive["attributes"][name] = add_accessor(&mut gltf, &floats(numbers), 5126, 12, kind).into();
    }
    gltf["meshes"][0]["primitives"] = json!([primitive]);
    // The normal that the map gives at its corner, for a texel of (0.6, 0, 0.8).
    let normals = |gltf: &Value| {
        let scene = loaded(gltf);
        let normal = |triangle: &caustica::scene::Triangle| {
            let tangent = scene.attributes[triangle.attributes as usize - 1].tangents[0];
            0.6 * tangent.truncate() + 0.8 * triangle.normals[0]
        };
        (
            scene.triangles.iter().map(normal).collect::<Vec<_>>(),
            scene.triangles.iter().all(|triangle| triangle.is_turned),
        )
    };
    let (opaque, turned) = normals(&gltf);
    assert!(!turned);
    gltf["materials"][0]["extensions"] = json!({ "KHR_materials_transmission": { "transmissionFactor": 1 },
        "KHR_materials_volume": { "thicknessFactor": 1 } });
    let (glass, turned) = normals(&gltf);
    assert!(turned && opaque.iter().zip(&glass).all(|(a, b)| (*a + *b).length() < 1e-5), "{opaque:?} {glass:?}");
}

#[test]
fn morph_targets_move_tangents_with_their_surface() {
    let mut gltf = with_normal_map();
    let tangents = floats(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    set(&mut gltf, "TANGENT", (&tangents, 5126, "VEC4"), false);
    // The second corner moves from +X to +Z, the third stays at +Y.
    let moved = add_accessor(&mut gltf, &floats(&[0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0]), 5126, 3, "VEC3");
    let turned =
        add_accessor(&mut gltf, &floats(&[-1.0, 0.0, -1.0, -1.0, 0.0, -1.0, -1.0, 0.0, -1.0]), 5126, 3, "VEC3");
    gltf["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": moved, "NORMAL": turned }]);
    gltf["meshes"][0]["weights"] = json!([0]);
    assert!(near(frame(&loaded(&gltf)), [Vec3::Y, -Vec3::X]), "of the file");
    gltf["meshes"][0]["weights"] = json!([1]);
    let scene = loaded(&gltf);
    assert_eq!(scene.triangles[0].normals[0], -Vec3::X);
    assert!(near(frame(&scene), [Vec3::Z, -Vec3::Y]), "made anew: {:?}", frame(&scene));
    assert_eq!(scene.warnings, [""; 0]);
    gltf["meshes"][0]["primitives"][0]["targets"][0]["TEXCOORD_0"] = 0.into();
    let said = "morph targets of texture coordinates and colours are not read: these stay as in the mesh";
    assert_eq!(loaded(&gltf).warnings, [said]);
}
