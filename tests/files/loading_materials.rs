//! Materials: what their properties and extensions become.

use caustica::scene::{Alpha, LoadOptions, Material, Surface};
use glam::{Vec3, Vec4};
use serde_json::{Value, json};
use support::gltf::{add_accessor, floats, lambert, load, loaded, message, read_with, triangle};

use super::pictures::textured;

/// The material of a triangle, and the notes on it.
fn read(material: Value) -> (Material, Vec<String>) {
    let mut gltf = triangle();
    gltf["materials"][0] = material;
    let mut scene = loaded(&gltf);
    // A triangle of glass is no solid, which another test looks at.
    let notes = scene.warnings.into_iter().filter(|line| !line.contains("its glass")).collect();
    (scene.materials.remove(0), notes)
}

/// The material of a triangle, on which there is nothing to note.
fn quiet(material: Value) -> Material {
    let (material, notes) = read(material);
    assert_eq!(notes, [""; 0]);
    material
}

/// A material of factors and extensions.
fn with(factors: Value, extensions: Value) -> Value {
    json!({ "name": "m", "pbrMetallicRoughness": factors, "extensions": extensions })
}

/// The line by which a material is refused.
fn refusal(material: Value) -> String {
    let mut gltf = triangle();
    gltf["materials"][0] = material;
    message(load(&gltf))
}

fn layered(base: Vec3, metallic: f32, f0: Vec3, specular: f32) -> Surface {
    Surface::Layered { base, metallic, f0, specular }
}

const COAT: Vec3 = Vec3::splat(0.04);

#[test]
fn metal_and_coat_decide_the_surface() {
    assert_eq!(quiet(lambert([0.5, 0.25, 0.125])).surface, Surface::Diffuse { albedo: Vec3::new(0.5, 0.25, 0.125) });
    let gold = Vec3::new(1.0, 0.75, 0.25);
    let metal = |metallic: f32, roughness: f32| {
        let factors =
            json!({ "metallicFactor": metallic, "roughnessFactor": roughness, "baseColorFactor": [1, 0.75, 0.25, 1] });
        let material = quiet(with(factors, json!({})));
        assert_eq!(material.roughness, roughness);
        material.surface
    };
    assert_eq!(metal(1.0, 0.0), Surface::Mirror { tint: gold });
    assert_eq!(metal(1.0, 0.029), Surface::Mirror { tint: gold });
    assert_eq!(metal(1.0, 0.03), layered(gold, 1.0, COAT, 1.0));
    assert_eq!(metal(0.5, 0.0), layered(gold, 0.5, COAT, 1.0));
    assert_eq!(metal(0.0, 0.5), layered(gold, 0.0, COAT, 1.0));
    assert_eq!(quiet(json!({})).surface, layered(Vec3::ONE, 1.0, COAT, 1.0), "the defaults are rough metal");
    let mut plain = triangle();
    plain["meshes"][0]["primitives"][0].as_object_mut().expect("an object").remove("material");
    let default = &loaded(&plain).materials[0];
    assert_eq!((default.name.as_str(), default.surface), ("default material", layered(Vec3::ONE, 1.0, COAT, 1.0)));
}

#[test]
fn index_and_specular_make_the_coat() {
    let coat = |extensions: Value| quiet(with(json!({ "metallicFactor": 0 }), extensions)).surface;
    let ior = |ior: f32| coat(json!({ "KHR_materials_ior": { "ior": ior } }));
    assert_eq!(ior(2.0), layered(Vec3::ONE, 0.0, Vec3::splat(1.0 / 9.0), 1.0));
    assert_eq!(ior(1.0), layered(Vec3::ONE, 0.0, Vec3::ZERO, 1.0));
    assert_eq!(ior(0.0), layered(Vec3::ONE, 0.0, Vec3::ONE, 1.0), "everything is reflected");
    // Not clamped: the texture of the colour multiplies it first.
    let strong = json!({ "KHR_materials_ior": { "ior": 3 },
        "KHR_materials_specular": { "specularFactor": 0.5, "specularColorFactor": [8, 2, 1] } });
    assert_eq!(coat(strong), layered(Vec3::ONE, 0.0, Vec3::new(2.0, 0.5, 0.25), 0.5));
    let through = json!({ "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.5 },
        "KHR_materials_volume": { "thicknessFactor": 1 } });
    let said = "KHR_materials_volume has no effect on diffuse transmission, which is that of a thin sheet";
    assert_eq!(read(with(json!({}), through)).1, [format!("material \"m\": {said}")]);
    let place = "materials[0].extensions.KHR_materials_";
    for (extension, said) in [
        (json!({ "KHR_materials_ior": { "ior": 0.5 } }), "ior.ior: 0.5 is not an index of refraction from 1, nor 0"),
        (json!({ "KHR_materials_ior": { "ior": 1e39 } }), "ior.ior: inf is not an index of refraction from 1, nor 0"),
        (
            json!({ "KHR_materials_specular": { "specularColorFactor": [1, -1, 1] } }),
            "specular.specularColorFactor: 1 -1 1 is not a colour of positive numbers",
        ),
        (json!({ "KHR_materials_specular": { "specularFactor": 1e39 } }), "specular.specularFactor: inf is not finite"),
    ] {
        assert_eq!(refusal(with(json!({}), extension)), format!("{place}{said}"));
    }
}

#[test]
fn factors_outside_of_their_range_are_clamped_with_a_note() {
    let (material, notes) = read(lambert([1.5, 1.0, -0.25]));
    assert_eq!(material.surface, Surface::Diffuse { albedo: Vec3::new(1.0, 1.0, 0.0) });
    assert_eq!(notes, [r#"material "paint": base colour 1.5 1 -0.25 is clamped to 0..1"#]);
    let factors = json!({ "metallicFactor": 2, "roughnessFactor": -1 });
    let (material, notes) = read(with(factors, json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 1.5 } })));
    assert_eq!((material.roughness, material.clearcoat), (0.0, 1.0));
    assert_eq!(material.surface, Surface::Mirror { tint: Vec3::ONE });
    let said = ["metallic 2", "roughness -1", "clearcoat 1.5"];
    assert_eq!(notes, said.map(|what| format!("material \"m\": {what} is clamped to 0..1")));
    let place = "materials[0].pbrMetallicRoughness";
    let endless = refusal(with(json!({ "roughnessFactor": 1e39 }), json!({})));
    assert_eq!(endless, format!("{place}.roughnessFactor: inf is not finite"));
    let endless = refusal(with(json!({ "baseColorFactor": [1e39, 1, 1, 1] }), json!({})));
    assert_eq!(endless, format!("{place}.baseColorFactor: inf 1 1 is not a colour of finite numbers"));
}

/// Glass of a volume with those members.
fn glass(volume: Value) -> Value {
    let transmission = json!({ "transmissionFactor": 1 });
    let extensions = json!({ "KHR_materials_transmission": transmission, "KHR_materials_volume": volume });
    with(json!({ "metallicFactor": 0, "roughnessFactor": 0 }), extensions)
}

/// The material of a solid, on which there is nothing to note.
fn solid(material: Value) -> Material {
    let material = quiet(material);
    assert!(material.medium().is_some());
    material
}

#[test]
fn transmission_makes_glass_or_a_pane() {
    let clear = solid(glass(json!({ "thicknessFactor": 0.1 })));
    assert_eq!(clear.surface, Surface::Glass { ior: 1.5, tint: Vec3::ONE });
    assert_eq!((clear.transmission, clear.roughness, clear.absorption), (1.0, 0.0, Vec3::ZERO));
    let mut thin = glass(json!({ "thicknessFactor": 0, "attenuationDistance": 1, "attenuationColor": [0, 0, 0] }));
    thin["extensions"]["KHR_materials_ior"] = json!({ "ior": 1.33 });
    thin["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 0.25.into();
    thin["pbrMetallicRoughness"]["roughnessFactor"] = 0.25.into();
    let pane = quiet(thin.clone());
    assert_eq!(pane.surface, Surface::Pane { ior: 1.33, tint: Vec3::ONE });
    assert_eq!((pane.transmission, pane.roughness, pane.absorption), (0.25, 0.25, Vec3::ZERO));
    thin["pbrMetallicRoughness"]["metallicFactor"] = 0.5.into();
    let half = quiet(thin.clone());
    assert_eq!((half.surface, half.metallic, pane.metallic), (pane.surface, 0.5, 0.0));
    thin["pbrMetallicRoughness"]["metallicFactor"] = 1.into();
    let (metal, notes) = read(thin.clone());
    assert!(matches!(metal.surface, Surface::Layered { metallic: 1.0, .. }));
    assert_eq!(notes, [r#"material "m": transmits nothing, because it is of metal"#]);
    thin["pbrMetallicRoughness"]["metallicFactor"] = 0.into();
    thin["extensions"]["KHR_materials_ior"]["ior"] = 0.into();
    let (white, notes) = read(thin.clone());
    assert_eq!(white.surface, layered(Vec3::ONE, 0.0, Vec3::ONE, 1.0));
    assert_eq!(notes, [r#"material "m": transmits nothing, because ior 0 reflects all light"#]);
    thin["extensions"]["KHR_materials_ior"]["ior"] = 1.5.into();
    thin["extensions"]["KHR_materials_specular"] = json!({ "specularFactor": 0.5 });
    let (_, notes) = read(thin.clone());
    let said = "KHR_materials_specular does not change the reflection of glass, which its ior decides";
    assert_eq!(notes, [format!("material \"m\": {said}")]);
    let mut gltf = textured();
    gltf["materials"][0] = thin;
    for (specular, is_said) in [(json!({ "specularColorTexture": { "index": 0 } }), true), (json!({}), false)] {
        gltf["materials"][0]["extensions"]["KHR_materials_specular"] = specular;
        assert_eq!(loaded(&gltf).warnings.iter().any(|line| line.ends_with(said)), is_said);
    }
}

#[test]
fn attenuation_becomes_absorption() {
    let absorption = |distance: Value, color: [f32; 3]| {
        let mut volume = json!({ "thicknessFactor": 1, "attenuationColor": color });
        if !distance.is_null() {
            volume["attenuationDistance"] = distance;
        }
        solid(glass(volume)).absorption
    };
    let half = absorption(json!(2), [0.5, 1.0, 0.25]);
    let ln2 = std::f32::consts::LN_2;
    assert!((half - Vec3::new(0.5 * ln2, 0.0, ln2)).length() < 1e-6, "{half}");
    assert_eq!(absorption(Value::Null, [0.5, 1.0, 0.25]), Vec3::ZERO, "an endless distance");
    let black = absorption(json!(1e-3), [0.0, 0.0, 1.0]);
    assert!(black.is_finite() && black.x > 1e4 && black.z == 0.0, "{black}");
    let tiny = absorption(json!(1e-38), [0.0, 0.5, 1.0]);
    assert!(tiny.is_finite() && tiny.x == f32::MAX && tiny.y > 1e37, "{tiny}");
    let volume = |distance: f32| glass(json!({ "thicknessFactor": 1, "attenuationDistance": distance }));
    assert_eq!(read(volume(0.0)).1, [r#"material "m": attenuationDistance 0 is no distance: light is not attenuated"#]);
    let place = "materials[0].extensions.KHR_materials_volume";
    assert_eq!(refusal(volume(-1.0)), format!("{place}.attenuationDistance: -1 is not a positive number"));
    let thickness = refusal(glass(json!({ "thicknessFactor": -1 })));
    assert_eq!(thickness, format!("{place}.thicknessFactor: -1 is not a finite number of at least 0"));
}

#[test]
fn alpha_is_mask_or_coverage() {
    let alpha = |mode: Value| {
        let mut material = lambert([1.0; 3]);
        material["pbrMetallicRoughness"]["baseColorFactor"][3] = 0.25.into();
        mode.as_object().expect("an object").iter().for_each(|(key, value)| material[key] = value.clone());
        material
    };
    let read_as = |mode: Value| {
        let material = quiet(alpha(mode));
        (material.alpha, material.opacity)
    };
    assert_eq!(read_as(json!({})), (Alpha::Opaque, 1.0), "an opaque surface has no opacity");
    assert_eq!(read_as(json!({ "alphaMode": "BLEND" })), (Alpha::Blend, 0.25));
    assert_eq!(read_as(json!({ "alphaMode": "MASK" })), (Alpha::Mask { cutoff: 0.5 }, 0.25));
    assert_eq!(read_as(json!({ "alphaMode": "MASK", "alphaCutoff": 2 })), (Alpha::Mask { cutoff: 2.0 }, 0.25));
    let negative = refusal(alpha(json!({ "alphaMode": "MASK", "alphaCutoff": -1 })));
    assert_eq!(negative, "materials[0].alphaCutoff: -1 is not a finite number of at least 0");
}

#[test]
fn clearcoat_lies_above_any_surface() {
    let coat = json!({ "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25 });
    let mut material = lambert([1.0; 3]);
    material["extensions"]["KHR_materials_clearcoat"] = coat;
    let coated = quiet(material);
    assert_eq!((coated.clearcoat, coated.clearcoat_roughness), (0.5, 0.25));
    assert_eq!(coated.surface, Surface::Diffuse { albedo: Vec3::ONE });
    assert_eq!(quiet(lambert([1.0; 3])).clearcoat, 0.0);
}

#[test]
fn anisotropy_takes_the_tangents_of_the_file() {
    let read = |attributes: &[(&str, &str, &[f32])]| {
        let mut gltf = triangle();
        gltf["materials"][0] = with(json!({}), json!({ "KHR_materials_anisotropy": { "anisotropyStrength": 0.5 } }));
        for (name, kind, of_vertex) in attributes {
            let accessor = add_accessor(&mut gltf, &floats(&of_vertex.repeat(3)), 5126, 3, kind);
            gltf["meshes"][0]["primitives"][0]["attributes"][*name] = accessor.into();
        }
        loaded(&gltf)
    };
    let normal: (&str, &str, &[f32]) = ("NORMAL", "VEC3", &[0.0, 0.0, 1.0]);
    let tangent: (&str, &str, &[f32]) = ("TANGENT", "VEC4", &[0.0, 1.0, 0.0, -1.0]);
    let scene = read(&[normal, tangent]);
    assert_eq!((scene.materials[0].anisotropy, scene.warnings.len()), (0.5, 0), "{:?}", scene.warnings);
    assert_eq!(scene.attributes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 3], "as they are in the file");
    // Without normals those of the file count for nothing (glTF 2.0, 3.7.2.1).
    for attributes in [&[normal][..], &[tangent]] {
        let scene = read(attributes);
        let said = "meshes[0] has no TEXCOORD_0 and no TANGENT: material \"m\" is there without what needs it";
        assert_eq!((scene.materials[0].anisotropy, scene.attributes.len()), (0.0, 0), "control");
        assert_eq!(scene.warnings, [said]);
    }
}

#[test]
fn what_lies_above_a_base_is_read() {
    let mut gltf = triangle();
    let extensions = json!({
        "KHR_materials_sheen": { "sheenColorFactor": [0, 0.5, 1], "sheenRoughnessFactor": 0.25 },
        "KHR_materials_anisotropy": { "anisotropyStrength": 0.5, "anisotropyRotation": -1 },
        "KHR_materials_iridescence": { "iridescenceFactor": 0.75, "iridescenceThicknessMinimum": 200 },
        "KHR_materials_diffuse_transmission":
            { "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [1, 0, 0] },
    });
    gltf["materials"] = json!([with(json!({}), extensions.clone()), with(json!({}), extensions)]);
    let mut second = gltf["meshes"][0]["primitives"][0].clone();
    second["material"] = 1.into();
    gltf["meshes"][0]["primitives"].as_array_mut().expect("a list").push(second);
    let scene = loaded(&gltf);
    for material in &scene.materials {
        assert_eq!((material.sheen_color, material.sheen_roughness), (Vec3::new(0.0, 0.5, 1.0), 0.25));
        assert_eq!((material.anisotropy, material.anisotropy_rotation), (0.0, -1.0), "it has no direction");
        assert_eq!((material.iridescence, material.iridescence_ior), (0.75, 1.3));
        assert_eq!(material.iridescence_thickness, [200.0, 400.0]);
        assert_eq!((material.diffuse_transmission, material.diffuse_transmission_color), (0.5, Vec3::X));
    }
    let said = "meshes[0] has no TEXCOORD_0 and no TANGENT: material \"m\" is there without what needs it";
    assert_eq!(scene.warnings, [said], "the direction of the anisotropy");
    // Extensions that have no effect are not named.
    let without = json!({ "KHR_materials_sheen": {}, "KHR_materials_anisotropy": {}, "KHR_materials_iridescence": {},
        "KHR_materials_diffuse_transmission": {}, "KHR_materials_dispersion": { "dispersion": 1 } });
    let plain = quiet(with(json!({}), without));
    assert_eq!(plain.dispersion, 1.0);
    let mut prism = glass(json!({ "thicknessFactor": 1 }));
    prism["extensions"]["KHR_materials_dispersion"] = json!({ "dispersion": 0.33 });
    assert_eq!(quiet(prism.clone()).dispersion, 0.33);
    prism["extensions"]["KHR_materials_volume"]["thicknessFactor"] = 0.into();
    assert_eq!(read(prism).1, ["material \"m\": KHR_materials_dispersion has no effect on a thin pane"]);
    let place = "materials[0].extensions.KHR_materials_";
    for (extension, said) in [
        (
            json!({ "KHR_materials_dispersion": { "dispersion": -1 } }),
            "dispersion.dispersion: -1 is not a finite number of at least 0",
        ),
        (
            json!({ "KHR_materials_iridescence": { "iridescenceIor": 0.9 } }),
            "iridescence.iridescenceIor: 0.9 is not a finite number of at least 1",
        ),
        (
            json!({ "KHR_materials_anisotropy": { "anisotropyRotation": 1e39 } }),
            "anisotropy.anisotropyRotation: inf is not finite",
        ),
        (
            json!({ "KHR_materials_sheen": { "sheenColorFactor": [0, 1] } }),
            "sheen.sheenColorFactor: invalid length 2, expected an array of length 3",
        ),
    ] {
        assert_eq!(refusal(with(json!({}), extension)), format!("{place}{said}"));
    }
}

#[test]
fn unlit_materials_have_their_colour_alone() {
    let mut material = with(json!({ "baseColorFactor": [0.5, 0.25, 1, 1] }), json!({ "KHR_materials_unlit": {} }));
    material["emissiveFactor"] = json!([1, 1, 1]);
    let unlit = quiet(material.clone());
    assert_eq!((unlit.surface, unlit.unlit), (Surface::Diffuse { albedo: Vec3::new(0.5, 0.25, 1.0) }, true));
    assert_eq!(unlit.emission, Vec3::ZERO);
    material["extensions"] = json!({});
    assert!(!quiet(material).unlit, "control");
}

#[test]
fn specular_and_glossiness_become_base_and_coat() {
    let glossy =
        json!({ "diffuseFactor": [0.5, 0.25, 0.125, 0.5], "specularFactor": [1, 0.75, 0.5], "glossinessFactor": 0.75 });
    let mut material =
        with(json!({ "baseColorFactor": [0, 0, 0, 1] }), json!({ "KHR_materials_pbrSpecularGlossiness": glossy }));
    material["alphaMode"] = "BLEND".into();
    let converted = quiet(material);
    let (base, f0) = (Vec3::new(0.5, 0.25, 0.125), Vec3::new(1.0, 0.75, 0.5));
    assert_eq!((converted.surface, converted.roughness), (layered(base, 0.0, f0, 1.0), 0.25));
    assert_eq!((converted.alpha, converted.opacity), (Alpha::Blend, 0.5));
    let glass =
        json!({ "KHR_materials_pbrSpecularGlossiness": {}, "KHR_materials_transmission": { "transmissionFactor": 1 } });
    let said = "KHR_materials_transmission has no effect on KHR_materials_pbrSpecularGlossiness";
    assert_eq!(read(with(json!({}), glass)).1, [format!("material \"m\": {said}")]);
    let default = quiet(with(json!({}), json!({ "KHR_materials_pbrSpecularGlossiness": {} })));
    assert_eq!((default.surface, default.roughness), (layered(Vec3::ONE, 0.0, Vec3::ONE, 1.0), 0.0));
}

#[test]
fn a_variant_exchanges_materials() {
    let mut gltf = triangle();
    gltf["extensionsUsed"].as_array_mut().expect("a list").push("KHR_materials_variants".into());
    gltf["extensions"]["KHR_materials_variants"] = json!({ "variants": [{ "name": "day" }, { "name": "night" }] });
    gltf["materials"] = json!([lambert([1.0, 0.0, 0.0]), lambert([0.0, 1.0, 0.0])]);
    let mappings = json!({ "mappings": [{ "material": 1, "variants": [1] }] });
    gltf["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_materials_variants": mappings });
    let variant = |gltf: &Value, name: Option<&str>| {
        read_with(gltf, &LoadOptions { variant: name.map(str::to_owned), ..LoadOptions::default() })
    };
    let color = |name: Option<&str>| {
        let scene = variant(&gltf, name).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((scene.warnings, scene.variants), (vec![], vec!["day".to_owned(), "night".to_owned()]));
        (scene.materials[0].surface.color(), scene.hash)
    };
    let (plain, day, night) = (color(None), color(Some("day")), color(Some("night")));
    assert_eq!([plain.0, day.0, night.0], [Vec3::X, Vec3::X, Vec3::Y]);
    assert!(plain.1 != night.1 && day.1 != night.1, "results of one variant must not be found under another");
    assert_eq!(
        message(variant(&gltf, Some("dusk"))),
        r#"load.variant dusk: test.gltf has the variants "day", "night""#
    );
    assert_eq!(message(variant(&triangle(), Some("day"))), "load.variant day: test.gltf has no variants");
    let refused = |change: fn(&mut Value)| {
        let mut gltf = gltf.clone();
        change(&mut gltf["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][0]);
        message(load(&gltf))
    };
    let place = "meshes[0].primitives[0].extensions.KHR_materials_variants.mappings";
    assert_eq!(refused(|mapping| mapping["material"] = 2.into()), format!("{place}[0].material: 2 of 2"));
    assert_eq!(refused(|mapping| mapping["variants"] = json!([0, 2])), format!("{place}[0].variants: 2 of 2"));
    assert_eq!(
        refused(|mapping| mapping["material"] = json!(-1)),
        format!("{place}[0].material: invalid value: integer `-1`, expected usize")
    );
}
