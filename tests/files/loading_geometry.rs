//! Triangles and spheres from meshes, nodes and transforms.

use caustica::scene::{Scene, Triangle};
use glam::{Mat4, Quat, Vec3};
use serde_json::{Value, json};
use support::gltf::{add_accessor, add_zeros, data_uri, floats, load, loaded, message, push, triangle};

/// Corners of a unit square in the plane z = 0, in an order that suits a strip.
const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];

/// The triangle's file with another primitive: positions, mode, and indices of the given type.
fn with_primitive(positions: &[f32], mode: u32, indices: Option<(u32, Vec<u8>, usize)>) -> Value {
    let mut gltf = triangle();
    let positions = add_accessor(&mut gltf, &floats(positions), 5126, positions.len() / 3, "VEC3");
    let mut primitive = json!({ "attributes": { "POSITION": positions }, "mode": mode, "material": 0 });
    if let Some((component, bytes, count)) = indices {
        primitive["indices"] = add_accessor(&mut gltf, &bytes, component, count, "SCALAR").into();
    }
    gltf["meshes"][0]["primitives"] = json!([primitive]);
    gltf
}

/// Triangles as sorted lists of corners, each rotated to start at its smallest corner: equal for
/// equal surfaces with equal orientation.
pub fn surface(scene: &Scene) -> Vec<[[i32; 3]; 3]> {
    let corner = |p: Vec3| (p * 1000.0).round().as_ivec3().to_array();
    let mut surface: Vec<_> = scene
        .triangles
        .iter()
        .map(|triangle| {
            let mut corners = triangle.positions.map(corner);
            let first = (0..3).min_by_key(|i| corners[*i]).expect("three corners");
            corners.rotate_left(first);
            corners
        })
        .collect();
    surface.sort_unstable();
    surface
}

#[test]
fn lists_strips_and_fans_give_the_same_surface() {
    let bytes = |indices: &[u32], size: usize| indices.iter().flat_map(|i| i.to_le_bytes()[..size].to_vec()).collect();
    let list = [0, 1, 2, 2, 1, 3];
    let expected = surface(&loaded(&with_primitive(&SQUARE, 4, Some((5125, bytes(&list, 4), 6)))));
    assert_eq!(expected.len(), 2);
    for (component, size) in [(5121, 1), (5123, 2)] {
        assert_eq!(surface(&loaded(&with_primitive(&SQUARE, 4, Some((component, bytes(&list, size), 6))))), expected);
    }
    assert_eq!(surface(&loaded(&with_primitive(&SQUARE, 5, None))), expected);
    // The fan's corners go around the square, so that its diagonal is that of the strip.
    let fan = bytes(&[1, 3, 2, 0], 1);
    assert_eq!(surface(&loaded(&with_primitive(&SQUARE, 6, Some((5121, fan, 4))))), expected);
    let corners: Vec<f32> = list.iter().flat_map(|i| SQUARE[3 * *i as usize..][..3].to_vec()).collect();
    assert_eq!(surface(&loaded(&with_primitive(&corners, 4, None))), expected);
    // Negative control: the opposite winding gives another surface.
    let turned = bytes(&[0, 2, 1, 2, 3, 1], 1);
    assert_ne!(surface(&loaded(&with_primitive(&SQUARE, 4, Some((5121, turned, 6))))), expected);
}

#[test]
fn interleaved_sparse_and_quantized_positions_are_read() {
    let expected = surface(&loaded(&triangle()));
    let mut interleaved = triangle();
    let vertices = floats(&[0.0, 0.0, 0.0, 9.0, 1.0, 0.0, 0.0, 9.0, 0.0, 1.0, 0.0, 9.0]);
    let accessor = add_accessor(&mut interleaved, &vertices, 5126, 3, "VEC3");
    interleaved["bufferViews"][2]["byteStride"] = 16.into();
    interleaved["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = accessor.into();
    assert_eq!(surface(&loaded(&interleaved)), expected);

    let mut sparse = triangle();
    let bytes = [vec![1, 2, 0, 0], floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0])].concat();
    sparse["buffers"].as_array_mut().expect("a list").push(json!({ "byteLength": 28, "uri": data_uri(&bytes) }));
    sparse["bufferViews"].as_array_mut().expect("a list").push(json!({ "buffer": 1, "byteLength": 28 }));
    sparse["accessors"][0] = json!({ "componentType": 5126, "count": 3, "type": "VEC3", "sparse": {
        "count": 2,
        "indices": { "bufferView": 2, "componentType": 5121 },
        "values": { "bufferView": 2, "byteOffset": 4 },
    } });
    assert_eq!(surface(&loaded(&sparse)), expected);

    let mut quantized = triangle();
    let vertices = [0, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0];
    let accessor = add_accessor(&mut quantized, &vertices, 5121, 3, "VEC3");
    quantized["accessors"][accessor]["normalized"] = true.into();
    quantized["bufferViews"][2]["byteStride"] = 4.into();
    quantized["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = accessor.into();
    let undeclared = message(load(&quantized));
    assert!(undeclared.ends_with("is Vec3 of normalized U8, not Vec3 of F32"), "{undeclared}");
    quantized["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    quantized["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    assert_eq!(surface(&loaded(&quantized)), expected);
}

#[test]
fn sparse_elements_replace_zeros_and_others() {
    // Positions without a view, all but one of them listed; indices that are sparse over a view.
    let mut gltf = triangle();
    let bytes = [vec![1, 0, 2, 0], floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0])].concat();
    let listed = push(&mut gltf, "buffers", json!({ "byteLength": 28, "uri": data_uri(&bytes) }));
    let view = push(&mut gltf, "bufferViews", json!({ "buffer": listed, "byteLength": 28 }));
    gltf["accessors"][0] = json!({ "componentType": 5126, "count": 3, "type": "VEC3", "sparse": {
        "count": 2,
        "indices": { "bufferView": view, "componentType": 5123 },
        "values": { "bufferView": view, "byteOffset": 4 },
    } });
    let indices = add_accessor(&mut gltf, &[0, 9, 2], 5121, 3, "SCALAR");
    gltf["accessors"][indices]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": view, "componentType": 5121 },
        "values": { "bufferView": view, "byteOffset": 0 },
    });
    gltf["meshes"][0]["primitives"][0]["indices"] = indices.into();
    assert_eq!(surface(&loaded(&gltf)), surface(&loaded(&triangle())));
    // Negative control: without the sparse list the index 9 is read, and refused.
    gltf["accessors"][indices].as_object_mut().expect("an object").remove("sparse");
    assert_eq!(message(load(&gltf)), "meshes[0].primitives[0].indices: index 9 at 1, but there are 3 vertices");
}

#[test]
fn morph_targets_move_vertices_and_normals_by_default_weights() {
    let mut gltf = triangle();
    let up = add_accessor(&mut gltf, &floats(&[0.0, 0.0, 1.0].repeat(3)), 5126, 3, "VEC3");
    let normals = add_accessor(&mut gltf, &floats(&[0.0, 0.0, 1.0].repeat(3)), 5126, 3, "VEC3");
    let turn = add_accessor(&mut gltf, &floats(&[2.0, 0.0, 0.0].repeat(3)), 5126, 3, "VEC3");
    let small = add_accessor(&mut gltf, &[0, 0, 0, 0, 127, 0, 0, 0, 0, 0, 0, 0], 5120, 3, "VEC3");
    gltf["accessors"][small]["normalized"] = true.into();
    gltf["bufferViews"][5]["byteStride"] = 4.into();
    gltf["extensionsUsed"].as_array_mut().expect("a list").push("KHR_mesh_quantization".into());
    gltf["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    gltf["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": up, "NORMAL": turn }, { "POSITION": small }]);
    let positions = |gltf: &Value| {
        let scene = loaded(gltf);
        let center = scene.center.as_vec3();
        (scene.triangles[0].positions.map(|p| p + center), scene.triangles[0].normals[0])
    };
    let rest = [Vec3::ZERO, Vec3::X, Vec3::Y];
    assert_eq!(positions(&gltf), (rest, Vec3::Z), "without weights nothing moves");
    gltf["meshes"][0]["weights"] = json!([0.5, 3]);
    let expected = [Vec3::new(0.0, 0.0, 0.5), Vec3::new(4.0, 0.0, 0.5), Vec3::new(0.0, 1.0, 0.5)];
    let (moved, normal) = positions(&gltf);
    assert_eq!(moved, expected);
    assert!((normal - Vec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-6, "{normal}");
    // A node's weights override those of the mesh, for this node only.
    push(&mut gltf, "nodes", json!({ "mesh": 0, "weights": [0, 0] }));
    gltf["scenes"][0]["nodes"] = json!([3, 0]);
    let scene = loaded(&gltf);
    let heights: Vec<f64> = scene.triangles.iter().map(|t| f64::from(t.positions[0].z) + scene.center.z).collect();
    assert_eq!(heights, [0.0, 0.5]);
    gltf["nodes"][3]["weights"] = json!([1]);
    assert_eq!(message(load(&gltf)), "nodes[3].weights: 1 of them for 2 morph targets");
    gltf["nodes"][3]["weights"] = json!([3e38, 3e38]);
    let said = message(load(&gltf));
    assert!(said.starts_with("meshes[0].primitives[0]: ") || said.starts_with("nodes[3]: "), "{said}");
}

#[test]
fn skins_stand_as_their_joints_do() {
    let mut gltf = triangle();
    // The first vertex is bound to joint 0, the second to joint 1, and the third to both equally,
    // with weights that sum to 100.
    let joints = add_accessor(&mut gltf, &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0], 5121, 3, "VEC4");
    let weights = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 50.0, 50.0, 0.0, 0.0];
    let weights = add_accessor(&mut gltf, &floats(&weights), 5126, 3, "VEC4");
    let shift = |x: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0];
    let inverse = add_accessor(&mut gltf, &floats(&[shift(0.0), shift(-1.0)].concat()), 5126, 2, "MAT4");
    gltf["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = joints.into();
    gltf["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = weights.into();
    gltf["skins"] = json!([{ "joints": [3, 4], "inverseBindMatrices": inverse }]);
    // The transform of the skinned node is ignored. The joints need not be in the scene.
    gltf["nodes"][0] = json!({ "mesh": 0, "skin": 0, "translation": [100, 100, 100] });
    push(&mut gltf, "nodes", json!({ "children": [4] }));
    push(&mut gltf, "nodes", json!({ "translation": [1, 0, 4] }));
    let positions = |gltf: &Value| {
        let scene = loaded(gltf);
        scene.triangles[0].positions.map(|p| p + scene.center.as_vec3())
    };
    assert_eq!(positions(&gltf), [Vec3::ZERO, Vec3::new(1.0, 0.0, 4.0), Vec3::new(0.0, 1.0, 2.0)]);
    // Joints with a reflection keep the orientation of the surface.
    gltf["nodes"][3]["scale"] = json!([1, 1, -1]);
    let mirrored = loaded(&gltf).triangles[0].geometric_normal();
    gltf["nodes"][3]["scale"] = json!([1, 1, 1]);
    let plain = loaded(&gltf).triangles[0].geometric_normal();
    assert!((mirrored - Vec3::new(plain.x, plain.y, -plain.z)).length() < 1e-6, "{mirrored}, {plain}");

    let refused = |path: &str, value: Value| {
        let mut gltf = gltf.clone();
        *gltf.pointer_mut(path).expect("it is there") = value;
        message(load(&gltf))
    };
    assert_eq!(refused("/skins/0/joints", json!([3, 9])), "skins[0].joints[1]: 9 of 5");
    let short = refused(&format!("/accessors/{inverse}/count"), 1.into());
    assert_eq!(short, "skins[0].inverseBindMatrices: 1 matrices for 2 joints");
    let alone = refused("/skins/0/joints", json!([3]));
    assert_eq!(alone, "meshes[0].primitives[0].attributes.JOINTS_0: joint 1 of 1 at vertex 1");
    assert_eq!(refused("/nodes/0/skin", 1.into()), "nodes[0].skin: 1 of 1");
    let float = refused("/meshes/0/primitives/0/attributes/JOINTS_0", weights.into());
    assert!(float.ends_with("JOINTS_0: is Vec4 of F32, which joints and their weights cannot be"), "{float}");
}

#[test]
fn instances_stand_where_their_attributes_say() {
    let mut gltf = triangle();
    let at = add_accessor(&mut gltf, &floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 5.0]), 5126, 2, "VEC3");
    let turn = add_accessor(&mut gltf, &[0, 0, 0, 127, 0, 0, 127, 0], 5120, 2, "VEC4");
    gltf["accessors"][turn]["normalized"] = true.into();
    let scale = add_accessor(&mut gltf, &floats(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0]), 5126, 2, "VEC3");
    let attributes = json!({ "TRANSLATION": at, "ROTATION": turn, "SCALE": scale, "_ID": at });
    gltf["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    gltf["nodes"][0]["translation"] = json!([0, 0, 1]);
    let scene = loaded(&gltf);
    let positions: Vec<_> =
        scene.triangles.iter().flat_map(|t| t.positions.map(|p| (p + scene.center.as_vec3()).round())).collect();
    let expected = [[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 6], [-2, 0, 6], [0, -2, 6]];
    assert_eq!(positions, expected.map(|[x, y, z]: [i16; 3]| Vec3::new(x.into(), y.into(), z.into())));

    let refused = |attributes: Value| {
        let mut gltf = gltf.clone();
        gltf["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
        message(load(&gltf))
    };
    let place = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes";
    assert_eq!(refused(json!({ "SCALE": 99 })), format!("{place}.SCALE: accessor 99 of 5"));
    let unequal = refused(json!({ "SCALE": scale, "TRANSLATION": 0 }));
    assert_eq!(unequal, format!("{place}.TRANSLATION: has 3 elements, other attributes have 2"));
    assert_eq!(refused(json!({ "SCALE": turn })), format!("{place}.SCALE: is Vec4 of normalized I8, not Vec3 of F32"));
    let zeros = add_zeros(&mut gltf, 5126, 2, "VEC4");
    let none = json!({ "ROTATION": zeros });
    gltf["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = none;
    assert_eq!(message(load(&gltf)), format!("{place}.ROTATION: element 0 is not a rotation"));
}

/// A tetrahedron around the origin with outward winding, and normals that point away from the
/// centre.
fn tetrahedron(node: Value) -> Value {
    let corners = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];
    let indices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let mut gltf = with_primitive(&corners.concat(), 4, Some((5121, indices.to_vec(), 12)));
    let normals: Vec<f32> = corners.iter().flat_map(|c: &[f32; 3]| Vec3::from(*c).normalize().to_array()).collect();
    let normals = add_accessor(&mut gltf, &floats(&normals), 5126, 4, "VEC3");
    gltf["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    gltf["nodes"][0] = node;
    gltf["nodes"][0]["mesh"] = 0.into();
    gltf
}

/// Triangles that face the centre of the scene, by their geometric or by a vertex normal.
pub fn inward(triangles: &[Triangle]) -> usize {
    let looks_in = |t: &Triangle| {
        let out = t.positions.iter().sum::<Vec3>();
        t.geometric_normal().dot(out) <= 0.0 || t.normals.iter().zip(t.positions).any(|(n, p)| n.dot(p) <= 0.0)
    };
    triangles.iter().filter(|t| looks_in(t)).count()
}

#[test]
fn mirrored_and_stretched_solids_keep_their_outside() {
    let stretched =
        Mat4::from_scale_rotation_translation(Vec3::new(-3.0, 0.2, 1.0), Quat::from_rotation_z(1.0), Vec3::Y);
    for node in [
        json!({}),
        json!({ "scale": [-1, 1, 1] }),
        json!({ "scale": [-1, -1, -2], "rotation": [0.5, 0.5, 0.5, 0.5] }),
        json!({ "scale": [1, 5, 0.1], "translation": [3, 4, 5] }),
        json!({ "matrix": stretched.to_cols_array() }),
    ] {
        let scene = loaded(&tetrahedron(node.clone()));
        assert_eq!(scene.triangles.len(), 4, "{node}");
        assert_eq!(inward(&scene.triangles), 0, "{node}");
        assert!(scene.triangles.iter().flat_map(|t| t.normals).all(|n| (n.length() - 1.0).abs() < 1e-5));
    }
    // Negative control: one reversed triangle is found.
    let mut scene = loaded(&tetrahedron(json!({})));
    scene.triangles[2].positions.swap(0, 1);
    assert_eq!(inward(&scene.triangles), 1);
}

#[test]
fn normals_are_perpendicular_after_stretching() {
    // A plane x + y = const and its normal; stretched by 4 along x, the plane's normal is (1/4, 1,
    // 0).
    let mut gltf = with_primitive(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0], 4, None);
    let normals = add_accessor(&mut gltf, &floats(&[1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]), 5126, 3, "VEC3");
    gltf["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals.into();
    gltf["nodes"][0]["scale"] = json!([4, 1, 1]);
    let scene = loaded(&gltf);
    let expected = Vec3::new(0.25, 1.0, 0.0).normalize();
    let [a, b, zero] = scene.triangles[0].normals;
    assert!((a - expected).length() < 1e-6 && (b - expected).length() < 1e-6, "{a} {b}");
    assert_eq!(zero, scene.triangles[0].geometric_normal(), "a normal without length gives way to the plane's");
}

#[test]
fn triangles_without_area_are_dropped_and_counted() {
    let gltf = with_primitive(
        &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        4,
        None,
    );
    let scene = loaded(&gltf);
    assert_eq!(scene.triangles.len(), 1);
    assert_eq!(scene.warnings, ["1 of 2 triangles have no area and are not drawn"]);
    // A small triangle is not degenerate by its size alone.
    let small = with_primitive(&[0.0, 0.0, 0.0, 1e-15, 0.0, 0.0, 0.0, 1e-15, 0.0], 4, None);
    assert_eq!(loaded(&small).triangles.len(), 1);
}

#[test]
fn far_from_the_origin_is_as_near_it() {
    let at = |x: f64| {
        let mut gltf = tetrahedron(json!({}));
        let children = [0, 1, 2];
        gltf["nodes"].as_array_mut().expect("a list").push(json!({ "translation": [x, -x, x], "children": children }));
        gltf["scenes"][0]["nodes"] = json!([3]);
        loaded(&gltf)
    };
    // A power of two, which is exact in f32: only the loader could lose digits.
    let (near, far) = (at(0.0), at(67_108_864.0));
    assert_eq!(far.center.x, 67_108_864.0);
    assert_eq!(near.triangles, far.triangles);
    assert_eq!(near.lights, far.lights);
    assert_eq!(near.cameras, far.cameras);
    assert_eq!(far.describe().lights[0].position, Some([67_108_864.0, -67_108_864.0, 67_108_866.0]));
    // Negative control: in f32 the triangles collapse at this position.
    assert_eq!(67_108_864.0_f32 + 1.0, 67_108_864.0);
}

#[test]
fn things_before_a_far_mountain_keep_their_digits() {
    // A tetrahedron 0.6 mm wide before a camera, and one 300 km away.
    let scene = |eye: f64| {
        let mut gltf = tetrahedron(json!({ "scale": [3e-4, 3e-4, 3e-4] }));
        let nodes = gltf["nodes"].as_array_mut().expect("a list");
        let mesh = nodes.iter().find_map(|node| node.get("mesh").cloned()).expect("a mesh");
        nodes.iter_mut().filter_map(Value::as_object_mut).for_each(|node| drop(node.remove("camera")));
        nodes.push(json!({ "mesh": mesh, "translation": [3e5, 0.0, 0.0] }));
        nodes.push(json!({ "camera": 0, "translation": [eye, 0.001, 0.002] }));
        let (mountain, camera) = (nodes.len() - 2, nodes.len() - 1);
        gltf["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.001 } }]);
        let shown = gltf["scenes"][0]["nodes"].as_array_mut().expect("a list");
        shown.extend([json!(mountain), json!(camera)]);
        loaded(&gltf)
    };
    let width = |scene: &Scene| {
        let xs = scene.triangles[..4].iter().flat_map(|t| t.positions).map(|p| p.x);
        xs.clone().fold(f32::MIN, f32::max) - xs.fold(f32::MAX, f32::min)
    };
    let near = scene(0.01);
    assert!(near.center.x < 1.0, "{}", near.center);
    assert_eq!(near.triangles.len(), 8);
    assert!((width(&near) / 6e-4 - 1.0).abs() < 1e-3, "{}", width(&near));
    let far = scene(-100.0);
    assert!(far.center.x > 1e5, "control: seen from afar, the middle is the centre");
}

#[test]
fn deep_chains_of_nodes_do_not_overflow_the_stack() {
    let mut gltf = triangle();
    let nodes: Vec<Value> = (0..50_000).map(|i| json!({ "children": [i + 4], "translation": [0, 0, 1] })).collect();
    let list = gltf["nodes"].as_array_mut().expect("a list");
    list.extend(nodes);
    list.insert(3, json!({ "children": [4] }));
    list.push(json!({ "mesh": 0 }));
    gltf["nodes"][3]["children"] = json!([4]);
    gltf["scenes"][0]["nodes"] = json!([1, 3]);
    // A chain: node 3 has the child 4, and node i the child i + 1.
    for i in 4..50_004 {
        gltf["nodes"][i]["children"] = json!([i + 1]);
    }
    assert_eq!(loaded(&gltf).center.z, 50_000.0);
}

#[test]
fn spheres_are_exact_and_need_a_uniform_scale() {
    let mut gltf = triangle();
    gltf["extensions"]["KHR_implicit_shapes"] =
        json!({ "shapes": [{ "type": "sphere", "sphere": { "radius": 0.4 } }, { "type": "box" }] });
    gltf["materials"]
        .as_array_mut()
        .expect("a list")
        .push(json!({ "name": "other", "pbrMetallicRoughness": { "roughnessFactor": 0 } }));
    gltf["nodes"][0] = json!({
        "translation": [1, 2, 3], "scale": [-2, 2, 2], "rotation": [0.5, 0.5, 0.5, 0.5],
        "extensions": { "KHR_implicit_shapes": { "shape": 0 } }, "extras": { "material": 1 },
    });
    let scene = loaded(&gltf);
    let sphere = scene.spheres[0];
    assert_eq!((sphere.center, sphere.radius), (Vec3::ZERO, 0.8));
    assert_eq!(scene.center.to_array(), [1.0, 2.0, 3.0]);
    assert_eq!(scene.materials[sphere.material as usize].name, "other");

    let mut oval = gltf.clone();
    oval["nodes"][0]["scale"] = json!([2, 2, 2.1]);
    let uneven = "nodes[0]: scales its sphere differently along its axes, or not at all; spheres take a uniform scale";
    assert_eq!(message(load(&oval)), uneven);
    let mut unknown = gltf.clone();
    unknown["nodes"][0]["extensions"]["KHR_implicit_shapes"]["shape"] = 2.into();
    assert_eq!(message(load(&unknown)), "nodes[0].extensions.KHR_implicit_shapes.shape: 2 of 2");
    unknown["nodes"][0]["extensions"]["KHR_implicit_shapes"]["shape"] = 1.into();
    assert_eq!(loaded(&unknown).warnings[0], r#"implicit shapes of type "box" are not drawn, only spheres"#);
}
