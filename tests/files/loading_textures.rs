//! Images, samplers and transforms of textures.

use base64::Engine as _;
use caustica::scene::{LoadOptions, Scene, Surface, Texture, Wrap};
use glam::Vec3;
use image::{DynamicImage, ImageFormat, Rgb, Rgba};
use proptest::prelude::*;
use serde_json::{Value, json};
use support::any_scene;
use support::gltf::{lambert, load, loaded, message, push, read_with};

use super::pictures::{add_texture, encoded, four, image_uri, png, textured, uniform};

/// The base colour texture of the only material.
fn base_color(scene: &Scene) -> Texture {
    scene.materials[0].textures.base_color.expect("a texture")
}

/// The scene of a textured triangle with this image.
fn showing(bytes: &[u8]) -> caustica::Result<Scene> {
    let mut gltf = textured();
    gltf["images"][0] = image_uri(bytes);
    load(&gltf)
}

const FOUR: [[u8; 4]; 4] = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 128]];

/// A PNG with a palette of three colours, the last one half transparent, of two bits a texel.
const PALETTE: &str = "iVBORw0KGgoAAAANSUhEUgAAAAMAAAABAgMAAABmjvwnAAAACVBMVEX/AAAA/wAAAP8tSs2KAAAAA3RSTlP//4A6co5hAAAACklE\
                       QVR4nGOQAAAAGgAZLYj0NgAAAABJRU5ErkJggg==";

#[test]
fn images_of_all_formats_are_rgba_of_8_bits() {
    let texels = |bytes: &[u8]| {
        let scene = showing(bytes).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((scene.warnings, scene.images.len()), (vec![], 1));
        (scene.images[0].width, scene.images[0].height, scene.images[0].texels.clone())
    };
    let rgba = DynamicImage::from(four());
    assert_eq!(texels(&png(four())), (2, 2, FOUR.to_vec()));
    assert_eq!(texels(&encoded(four(), ImageFormat::WebP)), (2, 2, FOUR.to_vec()));
    assert_eq!(texels(&png(rgba.to_rgba16())).2, FOUR, "16 bits");
    let opaque = FOUR.map(|[r, g, b, _]| [r, g, b, 255]);
    assert_eq!(texels(&png(rgba.to_rgb8())).2, opaque);
    let grey = image::GrayImage::from_fn(2, 1, |x, _| image::Luma([100 * x as u8]));
    assert_eq!(texels(&png(grey.clone())), (2, 1, vec![[0, 0, 0, 255], [100, 100, 100, 255]]));
    let veiled = image::GrayAlphaImage::from_fn(2, 1, |x, _| image::LumaA([100, 50 * x as u8]));
    assert_eq!(texels(&png(veiled)).2, [[100, 100, 100, 0], [100, 100, 100, 50]]);
    let jpeg = texels(&encoded(image::RgbImage::from_pixel(16, 8, Rgb([200, 100, 50])), ImageFormat::Jpeg));
    let near = |texel: &[u8; 4]| texel.iter().zip([200, 100, 50, 255]).all(|(a, b)| a.abs_diff(b) <= 3);
    assert!((jpeg.0, jpeg.1) == (16, 8) && jpeg.2.iter().all(near), "{:?}", jpeg.2[0]);
    assert_eq!(texels(&encoded(grey, ImageFormat::Jpeg)).2.len(), 2);
    let palette = base64::engine::general_purpose::STANDARD.decode(PALETTE).expect("base64");
    assert_eq!(texels(&palette), (3, 1, vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 128]]));
}

#[test]
fn textures_sample_as_their_sampler_says() {
    let sampled = |sampler: Value| {
        let mut gltf = textured();
        gltf["samplers"] = json!([sampler]);
        gltf["textures"][0]["sampler"] = 0.into();
        let scene = loaded(&gltf);
        (base_color(&scene), scene.warnings)
    };
    let default = Texture {
        image: 0,
        wrap: [Wrap::Repeat; 2],
        is_linear: true,
        is_mipmapped: true,
        uv_set: 0,
        transform: Texture::IDENTITY,
    };
    assert_eq!(base_color(&loaded(&textured())), default);
    let plain = |sampler: Value| {
        let (texture, notes) = sampled(sampler);
        assert_eq!(notes, [""; 0]);
        texture
    };
    assert_eq!(plain(json!({})), default);
    let wrap = [Wrap::Clamp, Wrap::Mirror];
    assert_eq!(plain(json!({ "wrapS": 33071, "wrapT": 33648 })), Texture { wrap, ..default });
    assert_eq!(plain(json!({ "magFilter": 9728 })), Texture { is_linear: false, ..default });
    for (filter, is_mipmapped) in [(9728, false), (9729, false), (9984, true), (9985, true), (9986, true), (9987, true)]
    {
        assert_eq!(plain(json!({ "magFilter": 9729, "minFilter": filter })), Texture { is_mipmapped, ..default });
    }
    let (odd, notes) = sampled(json!({ "wrapS": 1, "magFilter": 2 }));
    let said = "samplers[0]: what is not one of glTF's filters and wrappings is as by default";
    assert_eq!((odd, &notes[..]), (default, &[said.to_owned()][..]));
}

#[test]
fn transforms_scale_turn_and_move() {
    let placed = |transform: Value| {
        let mut gltf = textured();
        let reference = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
        gltf["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = reference;
        load(&gltf)
    };
    let rows = |transform: Value| base_color(&placed(transform).unwrap_or_else(|error| panic!("{error}"))).transform;
    assert_eq!(rows(json!({})), Texture::IDENTITY);
    let [u, v] = rows(json!({ "offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 4] }));
    let (s, c) = 0.5_f32.sin_cos();
    let expected = [[2.0 * c, 4.0 * s, 0.5], [-2.0 * s, 4.0 * c, 0.25]];
    assert!(u.iter().chain(&v).zip(expected.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6), "{u:?} {v:?}");
    let place = "materials[0].pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform";
    for odd in [json!({ "scale": [1e39, 1] }), json!({ "offset": [0, 1e39] }), json!({ "rotation": 1e39 })] {
        assert_eq!(message(placed(odd)), format!("{place}: is not a transform of finite numbers"));
    }
    let text = message(placed(json!({ "scale": ["a", 1] })));
    assert_eq!(text, format!("{place}.scale[0]: invalid type: string \"a\", expected f32"));
    let short = message(placed(json!({ "offset": [1] })));
    assert_eq!(short, format!("{place}.offset: invalid length 1, expected an array of length 2"));
}

#[test]
fn every_property_has_its_texture() {
    let mut gltf = textured();
    for i in 1..9 {
        add_texture(&mut gltf, &png(uniform(1, 1, [i; 4])));
    }
    let texture = |i: usize| json!({ "index": i });
    let mut material = lambert([1.0; 3]);
    material["pbrMetallicRoughness"]["baseColorTexture"] = texture(0);
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = texture(1);
    material["normalTexture"] = json!({ "index": 2, "scale": 0.5 });
    material["occlusionTexture"] = texture(3);
    material["emissiveTexture"] = texture(4);
    material["emissiveFactor"] = json!([1, 1, 1]);
    material["extensions"] = json!({
        "KHR_materials_specular": { "specularTexture": texture(5), "specularColorTexture": texture(6) },
        "KHR_materials_clearcoat":
            { "clearcoatFactor": 1, "clearcoatTexture": texture(7), "clearcoatRoughnessTexture": texture(8) },
    });
    gltf["materials"][0] = material.clone();
    let scene = loaded(&gltf);
    // The image that a texture shows, by the number in its texels.
    let shown = |texture: Option<Texture>| texture.map(|texture| scene.images[texture.image as usize].texels[0][0]);
    let textures = &scene.materials[0].textures;
    let read = [
        textures.base_color,
        textures.metallic_roughness,
        textures.normal,
        textures.emission,
        textures.specular,
        textures.specular_color,
        textures.transmission,
        textures.clearcoat,
        textures.clearcoat_roughness,
    ];
    let expected = [Some(255), Some(1), Some(2), Some(4), Some(5), Some(6), None, Some(7), Some(8)];
    assert_eq!(read.map(shown), expected);
    assert_eq!((scene.materials[0].normal_scale, scene.images.len()), (0.5, 8), "occlusion is no image of the scene");
    assert_eq!(scene.warnings, [""; 0]);

    // Textures of factors that are zero have no effect.
    material["emissiveFactor"] = json!([0, 0, 0]);
    material["extensions"]["KHR_materials_clearcoat"]["clearcoatFactor"] = 0.into();
    material["extensions"]["KHR_materials_specular"]["specularFactor"] = 0.into();
    gltf["materials"][0] = material.clone();
    let scene = loaded(&gltf);
    assert_eq!(scene.materials[0].surface, Surface::Diffuse { albedo: Vec3::ONE });
    assert_eq!(scene.images.len(), 2, "base colour and normal");

    material["extensions"] =
        json!({ "KHR_materials_transmission": { "transmissionFactor": 0.5, "transmissionTexture": texture(3) } });
    material["normalTexture"]["scale"] = 1e39.into();
    gltf["materials"][0] = material.clone();
    assert_eq!(message(load(&gltf)), "materials[0].normalTexture.scale: inf is not finite");
    material["normalTexture"]["scale"] = 1.into();
    // All metal by its factor; the texture decides what of it transmits light.
    material["pbrMetallicRoughness"]["metallicFactor"] = 1.into();
    gltf["materials"][0] = material;
    let scene = loaded(&gltf);
    assert_eq!((scene.materials[0].metallic, scene.materials[0].surface.transmits()), (1.0, true));
    let transmission = scene.materials[0].textures.transmission.expect("a texture");
    assert_eq!(scene.images[transmission.image as usize].texels, [[3; 4]]);
}

#[test]
fn an_image_is_decoded_once_and_only_where_it_is_used() {
    let mut gltf = textured();
    // The same image by another texture; and a broken one that nothing shows.
    let again = push(&mut gltf, "textures", json!({ "source": 0, "name": "again" }));
    gltf["materials"][0]["emissiveTexture"] = json!({ "index": again });
    gltf["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
    let broken = add_texture(&mut gltf, b"nothing");
    let unused = lambert([1.0; 3]);
    push(&mut gltf, "materials", unused);
    gltf["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": broken });
    let scene = loaded(&gltf);
    assert_eq!((scene.images.len(), scene.warnings), (1, vec![]));
    gltf["meshes"][0]["primitives"][0]["material"] = 1.into();
    assert_eq!(message(load(&gltf)), "images[1]: the image is neither PNG, JPEG nor WebP", "control");
}

#[test]
fn indices_past_the_end_are_refused_in_all_materials() {
    let refused = |change: fn(&mut Value)| {
        let mut gltf = textured();
        push(&mut gltf, "materials", lambert([1.0; 3]));
        change(&mut gltf);
        message(load(&gltf))
    };
    for (said, change) in [
        (
            "materials[0].pbrMetallicRoughness.baseColorTexture.index: 1 of 1",
            (|g| g["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1.into()) as fn(&mut Value),
        ),
        ("materials[1].normalTexture.index: 7 of 1", |g| g["materials"][1]["normalTexture"] = json!({ "index": 7 })),
        ("materials[1].occlusionTexture.index: 2 of 1", |g| {
            g["materials"][1]["occlusionTexture"] = json!({ "index": 2 })
        }),
        ("materials[1].extensions.KHR_materials_sheen.sheenColorTexture.index: 3 of 1", |g| {
            let sheen = json!({ "sheenColorTexture": { "index": 3 } });
            g["materials"][1]["extensions"] = json!({ "KHR_materials_sheen": sheen });
        }),
        ("textures[0].source: 1 of 1", |g| g["textures"][0]["source"] = 1.into()),
        ("textures[0].sampler: 0 of 0", |g| g["textures"][0]["sampler"] = 0.into()),
        ("textures[1].extensions.EXT_texture_webp.source: 5 of 1", |g| {
            push(g, "textures", json!({ "extensions": { "EXT_texture_webp": { "source": 5 } } }));
        }),
        ("images[1].bufferView: 9 of 3", |g| {
            push(g, "images", json!({ "bufferView": 9, "mimeType": "image/png" }));
        }),
    ] {
        assert_eq!(refused(change), said);
    }
}

#[test]
fn damaged_and_missing_images_are_named_with_their_place() {
    let said = |bytes: &[u8]| message(showing(bytes));
    let picture = DynamicImage::from(image::RgbImage::from_fn(64, 64, |x, y| Rgb([x as u8, y as u8, (x * y) as u8])));
    for (format, name) in [(ImageFormat::Png, "PNG"), (ImageFormat::Jpeg, "JPEG"), (ImageFormat::WebP, "WebP")] {
        let whole = encoded(picture.clone(), format);
        assert!(showing(&whole).is_ok(), "{name}");
        for cut in [16, 40, whole.len() / 2, whole.len() - 20] {
            let said = said(&whole[..cut]);
            assert!(said.starts_with("images[0]: the image is damaged: "), "{name} cut to {cut}: {said}");
        }
    }
    assert_eq!(said(b"GIF89a"), "images[0]: the image is neither PNG, JPEG nor WebP");
    assert_eq!(said(b""), "images[0]: the image is neither PNG, JPEG nor WebP");
    let mut gltf = textured();
    let mut refused = |image: Value| {
        gltf["images"][0] = image;
        message(load(&gltf))
    };
    assert_eq!(refused(json!({})), "images[0]: has neither uri nor bufferView");
    let missing = refused(json!({ "uri": "gone.png" }));
    assert!(missing.starts_with(r#"images[0].uri: "gone.png": No such file"#), "{missing}");
    let outside = refused(json!({ "uri": "../gone.png" }));
    assert!(outside.starts_with(r#"images[0].uri: "../gone.png" leads out of the scene's folder"#), "{outside}");
    assert_eq!(refused(json!({ "bufferView": 0 })), "images[0]: bufferViews[0] is neither PNG, JPEG nor WebP");
}

/// The header of a PNG of that size, with nothing behind it.
fn claim(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(uniform(1, 1, [0; 4]));
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    // The checksum of the chunk: CRC-32 of its name and data.
    let crc = bytes[12..29].iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 })
    });
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    bytes
}

#[test]
fn images_that_claim_too_much_are_refused_before_memory_is_taken() {
    let said = |width: u32, height: u32| {
        let bytes = claim(width, height);
        let (most, said) = super::assets::memory::peak(|| message(showing(&bytes)));
        assert!(most < 1 << 20, "{width} x {height}: {most} bytes at once");
        said
    };
    let most = "sides of at most 16384 are read";
    assert_eq!(said(30_000, 30_000), format!("images[0]: the image has 30000 x 30000 texels; {most}"));
    assert_eq!(said(16_385, 1), format!("images[0]: the image has 16385 x 1 texels; {most}"));
    let bytes = claim(1, 1).len();
    let claimed = said(16_384, 16_384);
    assert_eq!(claimed, format!("images[0]: the image claims 16384 x 16384 texels, but has {bytes} bytes"));
}

#[test]
fn the_texture_size_halves_larger_images() {
    let mut gltf = textured();
    // A checker of black and white, as colours and as data.
    let checker = image::RgbaImage::from_fn(8, 4, |x, y| Rgba([255 * ((x + y) % 2) as u8, 0, 0, 255]));
    gltf["images"][0] = image_uri(&png(checker.clone()));
    gltf["images"][0]["name"] = "checker".into();
    let normal = add_texture(&mut gltf, &png(checker));
    gltf["materials"][0]["normalTexture"] = json!({ "index": normal });
    let small = |size: Option<u32>| {
        let options = LoadOptions { texture_size: size, ..LoadOptions::default() };
        read_with(&gltf, &options).unwrap_or_else(|error| panic!("{error}"))
    };
    let [whole, eight, two] = [None, Some(8), Some(2)].map(small);
    assert_eq!((&whole.images, &whole.warnings), (&eight.images, &eight.warnings));
    let sizes: Vec<_> = two.images.iter().map(|image| (image.width, image.height)).collect();
    assert_eq!(sizes, [(2, 1), (2, 1)]);
    assert_eq!(two.images[0].texels, [[188, 0, 0, 255]; 2], "half of the light");
    assert_eq!(two.images[1].texels, [[128, 0, 0, 255]; 2], "half of the value");
    let said = |name: &str| format!("image {name:?} of 8 x 4 texels is made 2 x 1 (`load.texture_size`)");
    assert_eq!(two.warnings, [said("checker"), said("image 1")]);
    assert!(whole.hash != two.hash, "results of one size must not be found under another");
    let options = LoadOptions { texture_size: Some(0), ..LoadOptions::default() };
    assert_eq!(message(read_with(&gltf, &options)), "load.texture_size 0: must be from 1 to 16384");
}

#[test]
fn glossiness_becomes_an_image_of_roughness() {
    let mut gltf = textured();
    gltf["images"][0] = image_uri(&png(uniform(1, 1, [200, 100, 50, 102])));
    let glossy = json!({ "glossinessFactor": 0.5, "specularGlossinessTexture": { "index": 0 }, "diffuseTexture": { "index": 0 } });
    gltf["materials"][0]["extensions"] = json!({ "KHR_materials_pbrSpecularGlossiness": glossy });
    let scene = loaded(&gltf);
    let (material, images) = (&scene.materials[0], &scene.images);
    let textures = &material.textures;
    let [rough, specular, diffuse] = [textures.metallic_roughness, textures.specular_color, textures.base_color]
        .map(|texture| texture.expect("a texture").image as usize);
    // 1 - 0.5 · 102/255 = 0.8.
    assert_eq!((images[rough].texels[0][1], material.roughness), (204, 1.0));
    assert_eq!((images[specular].texels[0], specular), ([200, 100, 50, 102], diffuse));
    assert_eq!(material.surface, Surface::Layered { base: Vec3::ONE, metallic: 0.0, f0: Vec3::ONE, specular: 1.0 });
}

#[test]
fn other_sources_are_taken_where_they_are_read() {
    let mut gltf = textured();
    let webp = push(&mut gltf, "images", image_uri(&encoded(uniform(3, 1, [9; 4]), ImageFormat::WebP)));
    let with = |texture: Value| {
        let mut gltf = gltf.clone();
        gltf["textures"][0] = texture;
        load(&gltf).map(|scene| (scene.images.first().map(|image| image.width), scene.warnings))
    };
    let read = |texture: Value| with(texture).unwrap_or_else(|error| panic!("{error}"));
    let extension = json!({ "EXT_texture_webp": { "source": webp } });
    assert_eq!(read(json!({ "source": 0, "extensions": extension })), (Some(3), vec![]));
    assert_eq!(read(json!({ "extensions": extension })), (Some(3), vec![]));
    let said = "textures[0] names no image that can be read, and is left out".to_owned();
    assert_eq!(read(json!({ "extensions": { "MSFT_texture_dds": { "source": 0 } } })), (None, vec![said.clone()]));
    assert_eq!(read(json!({})), (None, vec![said]));
}

#[test]
fn ktx2_is_refused_by_name_and_its_fallback_taken() {
    let mut gltf = textured();
    gltf["extensionsUsed"].as_array_mut().expect("a list").push("KHR_texture_basisu".into());
    let packed = push(&mut gltf, "images", image_uri(b"\xabKTX 20\xbb\r\n\x1a\n"));
    gltf["textures"][0]["extensions"] = json!({ "KHR_texture_basisu": { "source": packed } });
    let scene = loaded(&gltf);
    assert_eq!(
        (scene.images[0].width, &scene.warnings[..]),
        (2, &["extension KHR_texture_basisu is not read".to_owned()][..])
    );
    gltf["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": packed } } });
    gltf["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    let said = "extensionsRequired[0]: KHR_texture_basisu is not supported; `load.ignore_required` KHR_texture_basisu reads the \
                file without it";
    assert_eq!(message(load(&gltf)), said);
    let ignore_required = vec!["KHR_texture_basisu".to_owned()];
    let read = read_with(&gltf, &LoadOptions { ignore_required, ..LoadOptions::default() });
    let without = read.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(without.materials[0].textures.base_color, None);
    gltf["extensionsRequired"] = json!([]);
    gltf["textures"][0] = json!({ "source": packed });
    assert_eq!(message(load(&gltf)), "images[1]: the image is KTX2, which is not read");
    gltf["textures"][0] = json!({ "extensions": { "KHR_texture_basisu": { "source": 7 } } });
    assert_eq!(message(load(&gltf)), "textures[0].extensions.KHR_texture_basisu.source: 7 of 2");
}

#[test]
fn the_hash_covers_the_images_beside_the_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut gltf = textured();
    gltf["images"][0] = json!({ "uri": "my%20image.png" });
    let path = folder.path().join("test.gltf");
    std::fs::write(&path, gltf.to_string()).expect("a temporary file");
    let read = |value: u8| {
        std::fs::write(folder.path().join("my image.png"), png(uniform(1, 1, [value; 4]))).expect("a temporary file");
        Scene::load(&path).unwrap_or_else(|error| panic!("{error}"))
    };
    let (one, two) = (read(1), read(2));
    assert_eq!((one.images[0].texels[0], one.images[0].name.as_str()), ([1; 4], "my%20image.png"));
    assert_eq!(one.hash, read(1).hash);
    assert_ne!(one.hash, two.hash);
    std::fs::write(folder.path().join("my image.png"), b"").expect("a temporary file");
    let empty = Scene::load(&path).expect_err("no image").to_string();
    assert!(empty.ends_with(r#"images[0]: "my%20image.png" is neither PNG, JPEG nor WebP"#), "{empty}");
}

/// The richest file of the corpus: all properties, textures and formats of images.
fn rich() -> Vec<u8> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/scene/materials_and_images.gltf");
    std::fs::read(path).expect("it is there")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// With any bytes of a textured file changed, it is read as a sound scene or refused.
    #[test]
    fn damaged_textured_files_never_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let mut bytes = rich();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = if value < 200 { b"0123456789-.e,:[]{}\"x"[value as usize % 21] } else { value };
        }
        let _ = any_scene::check(&bytes);
    }

    /// The same for the bytes of images.
    #[test]
    fn damaged_images_never_panic(
        format in prop::sample::select(vec![ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP]),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = encoded(DynamicImage::from(four()).to_rgb8(), format);
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(scene) = showing(&bytes) {
            let image = &scene.images[0];
            prop_assert_eq!(image.texels.len(), image.width as usize * image.height as usize);
        }
    }
}
