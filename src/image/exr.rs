//! OpenEXR files: the frame as 32-bit floats, with all that is needed to make it again.
//!
//! One part with the channels `R G B A Z N.X N.Y N.Z albedo.R albedo.G albedo.B`: the plain names are the picture, a
//! name before a dot is a layer. Every reader takes this form, whereas many read only the first of several parts. The
//! format wants channels stored in alphabetical order; readers show R, G, B, A first whatever the order.

use std::{
    collections::BTreeMap,
    io::{Cursor, Read},
    path::Path,
};

use exr::{
    math::Vec2,
    meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text},
    prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LayerAttributes, ReadChannels,
        ReadLayers, WritableImage,
    },
};

use super::{Frame, PlaceInWhole, file::open_regular, write_file};
use crate::{
    error::{Error, Result},
    settings::Settings,
    stats::Stats,
};

/// Where a frame comes from; kept in the file's attributes.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// File name of the scene, without folders.
    pub scene: &'a str,
    /// Hash of the scene's bytes.
    pub scene_hash: &'a str,
    /// The light from all around, if there is any.
    pub environment: Option<EnvironmentOrigin<'a>>,
    pub settings: &'a Settings,
    /// Of these the device and the photon counts are kept: equal runs give equal files.
    pub stats: &'a Stats,
}

/// The light from all around, as a file's attributes tell of it.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentOrigin<'a> {
    /// File name without folders, or what stands for one.
    pub name: &'a str,
    /// Hash of the file's bytes.
    pub hash: &'a str,
    /// Of a uniform one: W/(m² sr) in each channel.
    pub radiance: Option<[f32; 3]>,
    pub strength: f32,
    /// Radians.
    pub rotation: f32,
}

/// CIE xy of ITU-R BT.709 primaries and D65.
const REC709: Chromaticities =
    Chromaticities { red: Vec2(0.64, 0.33), green: Vec2(0.3, 0.6), blue: Vec2(0.15, 0.06), white: Vec2(0.3127, 0.329) };

/// Writes the frame with ZIP compression. Equal frames of equal origin give equal bytes.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written; an older file is kept then.
pub fn write_exr(path: &Path, frame: &Frame, origin: &Origin) -> Result<()> {
    let bytes = encode(frame, origin).map_err(|e| failure(path, e))?;
    write_file(path, &bytes)
}

fn encode(frame: &Frame, origin: &Origin) -> exr::error::Result<Vec<u8>> {
    let channel = |name: &str, samples: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(samples));
    let of = |pixels: &[[f32; 3]], c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    let mut channels = vec![channel("A", frame.alpha.clone()), channel("Z", frame.depth.clone())];
    let layers = [(["R", "G", "B"], &frame.radiance), (["N.X", "N.Y", "N.Z"], &frame.normal)];
    let albedo = (["albedo.R", "albedo.G", "albedo.B"], &frame.albedo);
    for (names, pixels) in layers.into_iter().chain([albedo]) {
        channels.extend((0..3).map(|c| channel(names[c], of(pixels, c))));
    }
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (frame.width as usize, frame.height as usize);
    let mut image = Image::from_encoded_channels(size, encoding, AnyChannels::sort(channels.into_iter().collect()));
    image.attributes.chromaticities = Some(REC709);
    image.layer_data.attributes = attributes(origin);
    if let Some(PlaceInWhole { whole, column, row }) = frame.place {
        // The display window is the whole picture, the data window the part that is there.
        image.attributes.display_window = IntegerBounds::from_dimensions((whole.0 as usize, whole.1 as usize));
        image.layer_data.attributes.layer_position = Vec2(column as i32, row as i32);
    }
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file)?;
    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// What the file tells of its origin. Counts and the seed are text, for the format's integers end at 2³¹.
fn attributes(origin: &Origin) -> LayerAttributes {
    let (stats, settings) = (origin.stats, origin.settings);
    let version = env!("CARGO_PKG_VERSION");
    let maps = &stats.photons;
    let texts = [
        ("version", version.to_string()),
        ("settings", serde_json::to_string(settings).expect("settings hold nothing that JSON cannot")),
        ("seed", settings.photons.seed.to_string()),
        ("scene", origin.scene.to_string()),
        ("sceneHash", origin.scene_hash.to_string()),
        ("device", stats.device.name.clone()),
        ("driver", stats.device.driver.clone()),
        ("globalEmitted", maps.global.emitted.to_string()),
        ("globalStored", maps.global.stored.to_string()),
        ("causticEmitted", maps.caustic.emitted.to_string()),
        ("causticStored", maps.caustic.stored.to_string()),
    ];
    let environment = origin.environment.iter().flat_map(|environment| {
        let degrees = (f64::from(environment.rotation).to_degrees() * 1e4).round() / 1e4;
        let uniform = environment.radiance.map(|[r, g, b]| ("environmentRadiance", format!("{r},{g},{b}")));
        let file = [
            ("environment", environment.name.to_string()),
            ("environmentHash", environment.hash.to_string()),
            ("environmentStrength", environment.strength.to_string()),
            ("environmentRotation", degrees.to_string()),
        ];
        file.into_iter().chain(uniform)
    });
    let attribute = |(name, value): (&str, String)| {
        (Text::from(format!("caustica:{name}").as_str()), AttributeValue::Text(text(&value)))
    };
    LayerAttributes {
        software_name: Some(text(&format!("Caustica {version}"))),
        other: texts.into_iter().chain(environment).map(attribute).collect(),
        ..LayerAttributes::default()
    }
}

/// The text in UTF-8, as OpenEXR keeps it.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

/// Sorts the attributes of a single-part file by name, in place: the writer keeps them in a hash map, whose order
/// changes from run to run. An attribute is name, 0, type, 0, size, value; an empty name ends the header.
fn sort_attributes(file: &mut [u8]) {
    const START: usize = 8;
    let text_end = |at: usize| at + file[at..].iter().position(|&b| b == 0).expect("the writer ends its texts") + 1;
    let mut attributes = Vec::new();
    let mut at = START;
    while file[at] != 0 {
        let size_at = text_end(text_end(at));
        let size: [u8; 4] = file[size_at..size_at + 4].try_into().expect("four bytes");
        let end = size_at + 4 + u32::from_le_bytes(size) as usize;
        attributes.push(file[at..end].to_vec());
        at = end;
    }
    attributes.sort();
    file[START..at].copy_from_slice(&attributes.concat());
}

/// Reads a frame: R, G, B of any sample type; A is 1 and the other channels are 0 where the file has none.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, is not OpenEXR or lacks one of R, G, B.
pub fn read_exr(path: &Path) -> Result<Frame> {
    let image = open(path)?;
    let layer = &image.layer_data;
    let pixels = layer.size.area();
    let find = |name: &str| {
        let channel = layer.channel_data.list.iter().find(|c| c.name == *name)?;
        Some(channel.sample_data.values_as_f32().collect::<Vec<_>>()).filter(|samples| samples.len() == pixels)
    };
    let need = |name: &str| find(name).ok_or_else(|| failure(path, format!("the file has no channel {name}")));
    let or = |name: &str, value: f32| find(name).unwrap_or_else(|| vec![value; pixels]);
    let zip = |[x, y, z]: [Vec<f32>; 3]| (0..pixels).map(|i| [x[i], y[i], z[i]]).collect();
    Ok(Frame {
        width: layer.size.width() as u32,
        height: layer.size.height() as u32,
        place: place_of(&image),
        radiance: zip([need("R")?, need("G")?, need("B")?]),
        alpha: or("A", 1.0),
        depth: or("Z", 0.0),
        normal: zip(["N.X", "N.Y", "N.Z"].map(|name| or(name, 0.0))),
        albedo: zip(["albedo.R", "albedo.G", "albedo.B"].map(|name| or(name, 0.0))),
    })
}

/// Where the data window lies in the display window, if it is a part of that.
fn place_of(image: &Image<exr::image::Layer<AnyChannels<FlatSamples>>>) -> Option<PlaceInWhole> {
    let (whole, layer) = (image.attributes.display_window, &image.layer_data);
    let from = layer.attributes.layer_position - whole.position;
    let offset = |at: i32, size: usize, whole: usize| u32::try_from(at).ok().filter(|&at| at as usize + size <= whole);
    let column = offset(from.x(), layer.size.width(), whole.size.width())?;
    let row = offset(from.y(), layer.size.height(), whole.size.height())?;
    let size = (whole.size.width() as u32, whole.size.height() as u32);
    (layer.size != whole.size).then_some(PlaceInWhole { whole: size, column, row })
}

/// Reads the texts that [`write_exr`] left, by name without the prefix `caustica:`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read or is not OpenEXR.
pub fn read_exr_attributes(path: &Path) -> Result<BTreeMap<String, String>> {
    let image = open(path)?;
    let all = image.attributes.other.iter().chain(&image.layer_data.attributes.other);
    let ours = all.filter_map(|(name, value)| match value {
        AttributeValue::Text(value) => {
            let name = name.to_string().strip_prefix("caustica:")?.to_string();
            Some((name, String::from_utf8_lossy(value.bytes()).into_owned()))
        }
        _ => None,
    });
    Ok(ours.collect())
}

fn open(path: &Path) -> Result<Image<exr::image::Layer<AnyChannels<FlatSamples>>>> {
    let mut bytes = Vec::new();
    open_regular(path)
        .and_then(|mut file| file.read_to_end(&mut bytes))
        .map_err(|source| Error::Io { path: path.to_path_buf(), source })?;
    exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        // A job of exr's that panics on a thread of its own would end the process.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| failure(path, e))
}

fn failure(path: &Path, problem: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
    Error::Io { path: path.to_path_buf(), source: std::io::Error::other(problem) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::{DeviceStats, MapStats, PhotonStats};

    fn frame() -> Frame {
        let pixels = |seed: usize| (0..6).map(|i| [0.5, 1.0, 1e4].map(|x| x * (i + seed) as f32)).collect();
        let samples = |seed: usize| (0..6).map(|i| (i + seed) as f32 * 0.1).collect();
        Frame {
            width: 3,
            height: 2,
            place: None,
            radiance: pixels(1),
            alpha: samples(2),
            depth: samples(3),
            normal: pixels(4),
            albedo: pixels(5),
        }
    }

    fn stats() -> Stats {
        let maps = [MapStats { emitted: 5_000_000_000, stored: 7 }, MapStats { emitted: 11, stored: 3 }];
        Stats {
            device: DeviceStats { name: "Große Karte".into(), driver: "1.2".into() },
            photons: PhotonStats { global: maps[0], caustic: maps[1], ..PhotonStats::default() },
            ..Stats::default()
        }
    }

    fn write(path: &Path, frame: &Frame, settings: &Settings) {
        let origin = Origin { scene: "räume.gltf", scene_hash: "ab12", environment: None, settings, stats: &stats() };
        write_exr(path, frame, &origin).unwrap();
    }

    #[test]
    fn reads_back_every_channel_and_attribute() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let settings = Settings::default().with(|s| s.photons.seed = u32::MAX);
        write(&path, &frame(), &settings);
        assert_eq!(read_exr(&path).unwrap(), frame());
        let found = read_exr_attributes(&path).unwrap();
        assert_eq!(serde_json::from_str::<Settings>(&found["settings"]).unwrap(), settings);
        for (name, value) in [
            ("version", env!("CARGO_PKG_VERSION")),
            ("seed", "4294967295"),
            ("scene", "räume.gltf"),
            ("sceneHash", "ab12"),
            ("device", "Große Karte"),
            ("driver", "1.2"),
            ("globalEmitted", "5000000000"),
            ("globalStored", "7"),
            ("causticEmitted", "11"),
            ("causticStored", "3"),
        ] {
            assert_eq!(found[name], value, "{name}");
        }
        assert_eq!(found.len(), 11);
    }

    #[test]
    fn tells_how_the_scene_was_lit_from_all_around() {
        let folder = tempfile::tempdir().unwrap();
        let found = |environment: Option<EnvironmentOrigin>| {
            let path = folder.path().join("a.exr");
            let settings = Settings::default();
            let origin = Origin { scene: "", scene_hash: "", environment, settings: &settings, stats: &stats() };
            write_exr(&path, &frame(), &origin).unwrap();
            let mut all = read_exr_attributes(&path).unwrap();
            all.retain(|name, _| name.starts_with("environment"));
            all.into_iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>()
        };
        let map = EnvironmentOrigin {
            name: "sky.hdr",
            hash: "cd",
            radiance: None,
            strength: 0.5,
            rotation: 30_f32.to_radians(),
        };
        let of_map = ["environment sky.hdr", "environmentHash cd", "environmentRotation 30", "environmentStrength 0.5"];
        assert_eq!(found(Some(map)), of_map);
        let uniform = EnvironmentOrigin { radiance: Some([1.0, 0.25, 0.0]), ..map };
        assert_eq!(found(Some(uniform))[2], "environmentRadiance 1,0.25,0");
        assert_eq!(found(None), [""; 0]);
    }

    #[test]
    fn is_one_zip_part_of_32_bit_channels_in_rec709() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, &frame(), &Settings::default());
        let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
        let [header] = meta.headers.as_slice() else { panic!("one part") };
        let names: Vec<_> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
        let expected = ["A", "B", "G", "N.X", "N.Y", "N.Z", "R", "Z", "albedo.B", "albedo.G", "albedo.R"];
        assert_eq!(names, expected);
        assert!(header.channels.list.iter().all(|c| c.sample_type == exr::meta::attribute::SampleType::F32));
        assert_eq!(header.compression, Compression::ZIP16);
        assert_eq!(header.shared_attributes.chromaticities, Some(REC709));
        assert_eq!(header.own_attributes.capture_date, None);
    }

    #[test]
    fn equal_frames_give_equal_bytes_and_others_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let bytes = |name: &str, frame: &Frame| {
            let path = folder.path().join(name);
            write(&path, frame, &Settings::default());
            std::fs::read(path).unwrap()
        };
        let first = bytes("0.exr", &frame());
        assert!((1..8).all(|i| bytes(&format!("{i}.exr"), &frame()) == first));
        let mut other = frame();
        other.albedo[5][2] = 0.25;
        assert_ne!(bytes("other.exr", &other), first);
    }

    #[test]
    fn a_file_that_is_not_exr_is_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        std::fs::write(&path, b"not an image").unwrap();
        let message = read_exr(&path).unwrap_err().to_string();
        assert!(message.contains("a.exr: ") && !message.contains('\n'), "{message}");
        assert!(read_exr(&folder.path().join("none.exr")).is_err());
    }
}
