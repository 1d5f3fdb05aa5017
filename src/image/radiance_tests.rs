//! Tests with generated files of both formats: what is decoded, what is repaired, what is refused
//! with which message.

use exr::{
    image::{AnyChannel, AnyChannels, FlatSamples, Image, Layer},
    meta::attribute::{Chromaticities, IntegerBounds},
    prelude::{Encoding, LayerAttributes, WritableImage, f16},
};

use super::*;

/// OpenEXR file of `columns` columns and two rows, whose data window is offset by `at` from the
/// display window.
fn exr(columns: usize, at: Vec2<i32>, channels: &[(&str, FlatSamples)]) -> Vec<u8> {
    exr_of(None, columns, at, channels)
}

/// The same with chromaticities.
fn exr_of(space: Option<Chromaticities>, columns: usize, at: Vec2<i32>, channels: &[(&str, FlatSamples)]) -> Vec<u8> {
    let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
    let attributes = LayerAttributes { layer_position: at, ..LayerAttributes::default() };
    let layer = Layer::new((columns, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list));
    let mut image = Image::from_layer(layer);
    image.attributes.display_window = IntegerBounds::new(Vec2(0, 0), Vec2(2, 2));
    image.attributes.chromaticities = space;
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file).expect("it can be written");
    file.into_inner()
}

fn floats(numbers: &[f32]) -> FlatSamples {
    FlatSamples::F32(numbers.to_vec())
}

fn halves(numbers: &[f32]) -> FlatSamples {
    FlatSamples::F16(numbers.iter().map(|&x| f16::from_f32(x)).collect())
}

/// Radiance HDR file of RGBE bytes: r, g, b, exponent.
fn hdr(header: &str, width: u32, height: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    [format!("{header}\n\n-Y {height} +X {width}\n").as_bytes(), pixels.as_flattened()].concat()
}

fn decoded(bytes: &[u8]) -> RadiancePicture {
    decode_radiance(Path::new("sky"), bytes).unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(bytes: &[u8]) -> String {
    let error = decode_radiance(Path::new("sky"), bytes).expect_err("it must be refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    error.strip_prefix("sky: ").expect("the file is named").to_owned()
}

#[test]
fn half_and_float_colours_are_read_whatever_their_layer() {
    let (r, g, b) = ([1.0, 2.0, 3.0, 4.0], [0.5; 4], [0.0, 0.25, 0.0, 100.0]);
    let expected = [[1.0, 0.5, 0.0], [2.0, 0.5, 0.25], [3.0, 0.5, 0.0], [4.0, 0.5, 100.0]];
    let here = Vec2(0, 0);
    let other = floats(&[9.0; 4]);
    for bytes in [
        exr(2, here, &[("B", floats(&b)), ("G", floats(&g)), ("R", floats(&r))]),
        exr(2, here, &[("A", other.clone()), ("B", halves(&b)), ("G", floats(&g)), ("R", halves(&r))]),
        exr(2, here, &[("depth.Z", other.clone()), ("s.B", halves(&b)), ("s.G", halves(&g)), ("s.R", halves(&r))]),
        exr(
            2,
            here,
            &[
                ("B", floats(&b)),
                ("G", floats(&g)),
                ("R", floats(&r)),
                ("a.B", other.clone()),
                ("a.G", other.clone()),
                ("a.R", other.clone()),
            ],
        ),
    ] {
        let picture = decoded(&bytes);
        assert_eq!((picture.width, picture.height), (2, 2));
        assert_eq!((picture.pixels.as_slice(), picture.notes.len()), (&expected[..], 0));
    }
    let grey = decoded(&exr(2, here, &[("Y", halves(&r))]));
    assert_eq!(grey.pixels, r.map(|y| [y; 3]));
}

#[test]
fn the_display_window_is_the_picture() {
    let y = floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let pixels = |at: Vec2<i32>| decoded(&exr(3, at, &[("Y", y.clone())])).pixels.iter().map(|p| p[0]).collect();
    let found: Vec<f32> = pixels(Vec2(0, 0));
    assert_eq!(found, [1.0, 2.0, 4.0, 5.0]);
    let found: Vec<f32> = pixels(Vec2(-2, 1));
    assert_eq!(found, [0.0, 0.0, 3.0, 0.0]);
}

#[test]
fn radiance_files_of_either_signature_are_read() {
    // Value: mantissa times 2^(exponent - 136).
    let pixels = [[128, 64, 0, 129], [255, 0, 1, 136], [0, 0, 0, 0]];
    let expected = [[1.0, 0.5, 0.0], [255.0, 0.0, 1.0], [0.0; 3]];
    for signature in ["#?RADIANCE", "#?RGBE"] {
        let picture = decoded(&hdr(&format!("{signature}\nFORMAT=32-bit_rle_rgbe"), 3, 1, &pixels));
        assert_eq!((picture.width, picture.height, picture.pixels.as_slice()), (3, 1, &expected[..]));
        assert_eq!(picture.notes, [""; 0]);
    }
    let exposed = decoded(&hdr("#?RADIANCE\nEXPOSURE=2\nEXPOSURE=1.5", 3, 1, &pixels));
    assert_eq!(exposed.pixels, expected);
    assert_eq!(exposed.notes, ["its EXPOSURE of 3 is not undone, as in other renderers"]);
    let corrected = decoded(&hdr("#?RADIANCE\nCOLORCORR=2 1 1\nCOLORCORR= 1 1 0.5", 3, 1, &pixels));
    assert_eq!(corrected.pixels, expected);
    assert_eq!(corrected.notes, ["its COLORCORR of 2 1 0.5 is not undone, as in other renderers"]);
    assert_eq!(decoded(&hdr("#?RADIANCE\nCOLORCORR=1 1 1", 3, 1, &pixels)).notes, [""; 0]);
}

#[test]
fn other_primaries_are_converted_to_rec709() {
    let space = |[rx, ry, gx, gy, bx, by, wx, wy]: [f32; 8]| Chromaticities {
        red: Vec2(rx, ry),
        green: Vec2(gx, gy),
        blue: Vec2(bx, by),
        white: Vec2(wx, wy),
    };
    let rec709 = space([0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329]);
    let rec2020 = space([0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329]);
    let (r, g, b) = (floats(&[1.0, 0.5, 2.0, 0.0]), floats(&[0.0, 0.5, 1.0, 0.0]), floats(&[0.0, 0.5, 1.0, 0.0]));
    let of = |space| decoded(&exr_of(space, 2, Vec2(0, 0), &[("B", b.clone()), ("G", g.clone()), ("R", r.clone())]));
    let plain = of(None);
    assert_eq!(of(Some(rec709)), plain, "no bit is changed");
    assert_eq!(plain.pixels, [[1.0, 0.0, 0.0], [0.5; 3], [2.0, 1.0, 1.0], [0.0; 3]]);
    let wide = of(Some(rec2020));
    // ITU-R BT.2087-0. Green and blue of the first are below 0.
    let expected = [[1.6605, 0.0, 0.0], [0.5; 3], [2.6605, 0.8754, 0.9818], [0.0; 3]];
    let errors = wide.pixels.as_flattened().iter().zip(expected.as_flattened()).map(|(a, b)| (a - b).abs());
    assert!(errors.fold(0.0, f32::max) < 2e-4, "{:?}", wide.pixels);
    let said = ["primaries of Rec.2020 are converted to linear Rec.709", "numbers below 0 or NaN, read as 0: 2"];
    assert_eq!(wide.notes, said);
    let grey = decoded(&exr_of(Some(rec2020), 2, Vec2(0, 0), &[("Y", r.clone())]));
    assert_eq!((grey.pixels[2], grey.notes.len()), ([2.0; 3], 0));

    let hdr_of = |line: &str| decoded(&hdr(&format!("#?RADIANCE\n{line}"), 1, 1, &[[128, 128, 128, 130]]));
    let said = |line: &str| hdr_of(line).notes.concat();
    assert_eq!(said("PRIMARIES= .64 .33 .30 .60 .15 .06 .3127 .3290"), "");
    let own = hdr_of("PRIMARIES=0.64 0.33 0.29 0.6 0.15 0.06 0.3333 0.3333");
    assert_eq!(own.notes, ["primaries 0.64 0.33, 0.29 0.6, 0.15 0.06, 0.3333 0.3333 are converted to linear Rec.709"]);
    assert!(own.pixels[0].iter().all(|x| (x - 2.0).abs() < 1e-5), "white stays white: {:?}", own.pixels);
    for line in ["PRIMARIES=0.64 0.33", "PRIMARIES=red"] {
        assert_eq!(said(line), format!("its PRIMARIES, {:?}, are not eight numbers: Rec.709 is assumed", &line[10..]));
    }
}

#[test]
fn all_eight_orientations_are_the_same_picture() {
    // Three columns and two rows: red is the column plus one, green the row plus one.
    let pixel = |x: u8, y: u8| [64 * (x + 1), 64 * (y + 1), 0, 130];
    let expected: Vec<[f32; 3]> = (0..6).map(|i| [f32::from(i % 3 + 1_u8), f32::from(i / 3 + 1), 0.0]).collect();
    let file = |sizes: &str, order: [(u8, u8); 6]| {
        let pixels = order.map(|(x, y)| pixel(x, y));
        [format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{sizes}\n").as_bytes(), pixels.as_flattened()].concat()
    };
    let cases = [
        ("-Y 2 +X 3", [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]),
        ("+Y 2 +X 3", [(0, 1), (1, 1), (2, 1), (0, 0), (1, 0), (2, 0)]),
        ("-Y 2 -X 3", [(2, 0), (1, 0), (0, 0), (2, 1), (1, 1), (0, 1)]),
        ("+Y 2 -X 3", [(2, 1), (1, 1), (0, 1), (2, 0), (1, 0), (0, 0)]),
        ("+X 3 -Y 2", [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)]),
        ("+X 3 +Y 2", [(0, 1), (0, 0), (1, 1), (1, 0), (2, 1), (2, 0)]),
        ("-X 3 -Y 2", [(2, 0), (2, 1), (1, 0), (1, 1), (0, 0), (0, 1)]),
        ("-X 3 +Y 2", [(2, 1), (2, 0), (1, 1), (1, 0), (0, 1), (0, 0)]),
    ];
    for (sizes, order) in cases {
        let picture = decoded(&file(sizes, order));
        assert_eq!((picture.width, picture.height), (3, 2), "{sizes}");
        assert_eq!(picture.pixels, expected, "{sizes}");
        let unturned = decoded(&file("-Y 2 +X 3", order)).pixels == expected;
        assert_eq!(unturned, sizes == "-Y 2 +X 3", "control: {sizes}");
    }
    // Scanlines of the transposed ones are compressed along their own axis.
    let run = |value: u8| [136, value];
    let column = |r: u8, g: u8| [&[2, 2, 0, 8][..], &run(r), &run(g), &run(0), &run(129)].concat();
    let bytes = [&b"#?RADIANCE\n\n-X 2 +Y 8\n"[..], &column(128, 64), &column(64, 0)].concat();
    let picture = decoded(&bytes);
    assert_eq!((picture.width, picture.height), (2, 8));
    assert_eq!(picture.pixels, [[0.5, 0.0, 0.0], [1.0, 0.5, 0.0]].repeat(8));
}

#[test]
fn invalid_radiance_is_repaired_and_noted() {
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    let bytes =
        |y: [f32; 4]| exr(2, Vec2(0, 0), &[("B", floats(&[0.0; 4])), ("G", floats(&[7.0; 4])), ("R", floats(&y))]);
    let picture = decoded(&bytes([inf, -1.0, nan, -inf]));
    assert_eq!(picture.pixels, [[7.0, 7.0, 0.0], [0.0, 7.0, 0.0], [0.0, 7.0, 0.0], [0.0, 7.0, 0.0]]);
    let said = "numbers below 0 or NaN, read as 0: 3; infinite numbers, read as the largest finite one, 7: 1";
    assert_eq!(picture.notes, [said]);
    assert_eq!(decoded(&bytes([3e38, 0.0, -0.0, 1e-40])).notes, [""; 0]);
}

#[test]
fn what_cannot_be_read_is_one_line() {
    let samples = floats(&[1.0; 4]);
    let whole = exr(2, Vec2(0, 0), &[("Y", samples.clone())]);
    let no_color = "has neither the channels R, G and B nor the luminance Y alone";
    for channels in [&["R", "G"][..], &["Z"], &["Y", "RY", "BY"], &["a.R", "b.G", "b.B"]] {
        let channels: Vec<_> = channels.iter().map(|name| (*name, samples.clone())).collect();
        assert_eq!(refusal(&exr(2, Vec2(0, 0), &channels)), no_color);
    }
    for length in [4, 20, whole.len() / 2, whole.len() - 1] {
        assert_eq!(refusal(&whole[..length]), "is damaged: reference to missing bytes");
    }
    // The right edge of the data window is the first number of the second half of the attribute.
    let at = whole.windows(10).position(|bytes| bytes == b"dataWindow").expect("a window") + 10 + 1 + 6 + 4 + 8;
    let mut wide = whole.clone();
    wide[at..at + 4].copy_from_slice(&0x0fff_ffff_i32.to_le_bytes());
    assert_eq!(refusal(&wide), "is 268435456 x 2 pixels; 1 to 134217728 pixels are read");

    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe";
    assert_eq!(
        refusal(&hdr(header, 4_000_000, 4_000_000, &[])),
        "is 4000000 x 4000000 pixels; 1 to 134217728 pixels are read"
    );
    assert_eq!(refusal(&hdr(header, 0, 5, &[])), "is 0 x 5 pixels; 1 to 134217728 pixels are read");
    let few = hdr(header, 16_384, 8_192, &[[1, 2, 3, 128]]);
    assert_eq!(refusal(&few), format!("is damaged: {} bytes do not hold 16384 x 8192 pixels", few.len()));
    for (damaged, expected) in [
        (hdr(header, 2, 2, &[[1, 2, 3, 128]; 3]), "is damaged: it ends too early"),
        (
            hdr(header, 8, 1, &[[2, 2, 0, 8], [137, 1, 1, 1]]),
            "is damaged: Format error decoding Hdr: Wrong length of decoded scanline: got 9, expected 8",
        ),
        (
            hdr("#?RADIANCE\nFORMAT=32-bit_rle_xyze", 1, 1, &[[1, 2, 3, 128]]),
            "cannot be read: The image format `32-bit_rle_xyze` is not supported",
        ),
        (b"#?RADIANCE\n".to_vec(), "is damaged: Format error decoding Hdr: EOF in header"),
        (
            b"#?RADIANCE\n\n+X 2 -X 2\n".to_vec(),
            "cannot be read: The decoder for Hdr does not support the format features Orientation +X -X",
        ),
        (
            b"#?RADIANCE\n\n*Y 2 +X 2\n".to_vec(),
            "cannot be read: The decoder for Hdr does not support the format features Orientation *Y +X",
        ),
        (b"#?RADIANCE\n\n+X 2 -Y 2\n".to_vec(), "is damaged: it ends too early"),
        (
            b"#?RADIANCE\n\n-Y two +X 2\n".to_vec(),
            "is damaged: Format error decoding Hdr: Cannot parse height dimension value as u32: invalid digit found in \
             string",
        ),
    ] {
        assert_eq!(refusal(&damaged), expected);
    }
}

#[test]
fn other_files_are_refused_by_their_first_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |bytes: &[u8]| {
        let path = folder.path().join("sky.hdr");
        std::fs::write(&path, bytes).expect("can be written");
        read_radiance_bytes(&path).expect_err("it must be refused").to_string()
    };
    for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", b"#", b"v/1"] {
        let message = refused(bytes);
        assert!(message.ends_with("sky.hdr: is neither OpenEXR nor Radiance HDR"), "{message}");
    }
    let none = read_radiance_bytes(&folder.path().join("none.exr")).expect_err("there is none").to_string();
    assert!(none.contains("none.exr: "), "{none}");
    assert!(read_radiance_bytes(folder.path()).is_err(), "a folder");
}
