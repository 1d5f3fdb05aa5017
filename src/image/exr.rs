//! Writing of OpenEXR files: the frame as 32-bit floats, with the provenance that is needed to
//! reproduce it.
//!
//! A file has one part with the channels `R G B A Z N.X N.Y N.Z albedo.R albedo.G albedo.B`. Names
//! without a dot belong to the picture itself; a name before a dot is a layer. Every reader accepts
//! this form, whereas many read only the first of several parts. The format requires channels in
//! alphabetical order; readers show R, G, B, A first whatever the order.

use std::{collections::BTreeMap, io::Cursor, path::Path};

use exr::{
    math::Vec2,
    meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text},
    prelude::{
        AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LayerAttributes, WritableImage,
    },
};

use super::{
    cryptomatte::Matte,
    file::write_file,
    frame::{DataWindow, Frame},
    layers::LAYERS,
};
use crate::{
    error::{Error, Result},
    settings::{ExtraLayers, LoadOptions, Settings},
    stats::{MapStats, Stats},
};

/// Provenance of a frame, stored in the file's attributes.
#[derive(Clone, Debug)]
pub struct Provenance<'a> {
    /// File name of the scene, without folders.
    pub scene: &'a str,
    /// Hash of the scene's bytes.
    pub scene_hash: &'a str,
    /// Options with which the scene was read.
    pub options: &'a LoadOptions,
    /// Environment light, if there is any.
    pub environment: Option<EnvironmentProvenance<'a>>,
    /// Names of nodes, for mattes.
    pub objects: Vec<&'a str>,
    /// Names of materials, for mattes.
    pub materials: Vec<&'a str>,
    /// Settings of the render.
    pub settings: &'a Settings,
    /// Statistics of the render. Only the device and the photon counts are stored, so that equal
    /// runs give equal files.
    pub stats: &'a Stats,
}

/// Provenance of the environment light.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentProvenance<'a> {
    /// File name without folders, or the name of an environment without a file.
    pub name: &'a str,
    /// Hash of the file's bytes, or of the radiance of an environment without a file.
    pub hash: &'a str,
    /// Radiance of a uniform environment, W/(m² sr) in each channel.
    pub radiance: Option<[f32; 3]>,
    /// Factor on the radiance, at least 0.
    pub strength: f32,
    /// Rotation about the vertical, radians.
    pub rotation: f32,
}

/// Beginning of the names of our attributes in files, and of those of mattes.
pub(super) const OURS: &str = "caustica:";
pub(super) const CRYPTOMATTE: &str = "cryptomatte/";

/// Text attributes by name, without the prefix `caustica:` that they have in files. Those of mattes
/// begin with `cryptomatte/` in both.
pub type Attributes = BTreeMap<String, String>;
pub(super) type Channel = AnyChannel<FlatSamples>;

/// CIE xy of ITU-R BT.709 primaries and D65.
const REC709: Chromaticities =
    Chromaticities { red: Vec2(0.64, 0.33), green: Vec2(0.3, 0.6), blue: Vec2(0.15, 0.06), white: Vec2(0.3127, 0.329) };

/// Writes the frame with ZIP compression. Equal frames of equal provenance give equal bytes.
///
/// # Errors
/// [`Error::Io`] if the file cannot be written. An older file is then kept.
pub fn write_exr(path: &Path, frame: &Frame, provenance: &Provenance) -> Result<()> {
    write_exr_with(path, frame, &provenance.attributes())
}

/// Variant of [`write_exr`] with any attributes.
///
/// # Errors
/// As [`write_exr`].
pub fn write_exr_with(path: &Path, frame: &Frame, attributes: &Attributes) -> Result<()> {
    let layers = LAYERS.iter().flat_map(|layer| channels_of(frame.layer(layer.name), layer.channels, ""));
    let extras = frame.extras().map(|(name, numbers)| channel(name.to_owned(), numbers.to_vec()));
    let channels = layers.chain(extras).collect();
    let bytes =
        encode((frame.width, frame.height), frame.window, channels, attributes).map_err(|e| failure(path, e))?;
    write_file(path, &bytes)
}

/// One channel. A name has at most 255 bytes, none of which is 0.
pub(super) fn channel(name: String, samples: Vec<f32>) -> Channel {
    AnyChannel::new(text(&name), FlatSamples::F32(samples))
}

/// Channels of a layer whose numbers are stored pixel by pixel; `before` begins their names.
pub(super) fn channels_of(numbers: &[f32], names: &[&str], before: &str) -> Vec<Channel> {
    let of = |c: usize| numbers.iter().skip(c).step_by(names.len()).copied().collect();
    names.iter().enumerate().map(|(c, name)| channel(format!("{before}{name}"), of(c))).collect()
}

/// Encodes a file of one part.
pub(super) fn encode(
    (width, height): (u32, u32),
    window: Option<DataWindow>,
    channels: Vec<Channel>,
    attributes: &Attributes,
) -> exr::error::Result<Vec<u8>> {
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (width as usize, height as usize);
    let mut image = Image::from_encoded_channels(size, encoding, AnyChannels::sort(channels.into()));
    image.attributes.chromaticities = Some(REC709);
    image.layer_data.attributes = layer_attributes(attributes);
    if let Some(DataWindow { whole, column, row }) = window {
        // The display window is the whole picture, the data window the rendered part.
        image.attributes.display_window = IntegerBounds::from_dimensions((whole.0 as usize, whole.1 as usize));
        image.layer_data.attributes.layer_position = Vec2(column as i32, row as i32);
    }
    let mut file = Cursor::new(Vec::new());
    image.write().to_buffered(&mut file)?;
    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

impl Provenance<'_> {
    /// The attributes. Counts and the seed are text, since the format's integers end at 2³¹.
    #[must_use]
    pub fn attributes(&self) -> Attributes {
        let (stats, settings) = (self.stats, self.settings);
        let texts = [
            ("version", env!("CARGO_PKG_VERSION").to_string()),
            ("settings", serde_json::to_string(settings).expect("settings hold nothing that JSON cannot")),
            ("seed", settings.photons.seed.to_string()),
            ("loading", serde_json::to_string(self.options).expect("options hold nothing that JSON cannot")),
            ("scene", self.scene.to_string()),
            ("sceneHash", self.scene_hash.to_string()),
            ("device", stats.device.name.clone()),
            ("driver", stats.device.driver.clone()),
        ];
        let environment = self.environment.iter().flat_map(|environment| {
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
        let all = texts.into_iter().chain(environment);
        let mut attributes: Attributes = all.map(|(name, value)| (name.to_owned(), value)).collect();
        count_photons(&mut attributes, stats.photons.global, stats.photons.caustic);
        count_samples(&mut attributes, stats.extra_samples);
        let asked = &settings.picture.layers;
        if asked.contains(&ExtraLayers::Objects) {
            attributes.extend(Matte::attributes(ExtraLayers::Objects, self.objects.iter().copied()));
        }
        if asked.contains(&ExtraLayers::Materials) {
            attributes.extend(Matte::attributes(ExtraLayers::Materials, self.materials.iter().copied()));
        }
        attributes
    }
}

/// Sets the attributes that count photons.
pub(super) fn count_photons(attributes: &mut Attributes, global: MapStats, caustic: MapStats) {
    for (map, of_map) in [("global", global), ("caustic", caustic)] {
        attributes.insert(format!("{map}Emitted"), of_map.emitted.to_string());
        attributes.insert(format!("{map}Stored"), of_map.stored.to_string());
    }
}

/// Sets the attribute that counts samples beyond those that every pixel has.
pub(super) fn count_samples(attributes: &mut Attributes, extra: u64) {
    attributes.insert("extraSamples".to_owned(), extra.to_string());
}

/// The attributes in the form of the file's writer.
fn layer_attributes(attributes: &Attributes) -> LayerAttributes {
    let version = attributes.get("version").map_or(env!("CARGO_PKG_VERSION"), String::as_str);
    let attribute = |(name, value): (&String, &String)| {
        let name = if name.starts_with(CRYPTOMATTE) { name.clone() } else { format!("{OURS}{name}") };
        (text(&name), AttributeValue::Text(text(value)))
    };
    LayerAttributes {
        software_name: Some(text(&format!("Caustica {version}"))),
        other: attributes.iter().map(attribute).collect(),
        ..LayerAttributes::default()
    }
}

/// Text in UTF-8, the encoding of OpenEXR. The crate's own conversion writes Latin-1.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

/// Sorts the attributes of a single-part file by name, in place. The writer keeps them in a hash
/// map, whose order changes from run to run. An attribute is name, 0, type, 0, size, value; an
/// empty name ends the header.
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

pub(super) fn failure(path: &Path, problem: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
    Error::Io { path: path.to_path_buf(), source: std::io::Error::other(problem) }
}

#[cfg(test)]
mod tests {
    use super::{
        super::exr_read::{read_exr, read_exr_attributes},
        *,
    };
    use crate::stats::{DeviceStats, MapStats, PhotonStats};

    fn frame() -> Frame {
        let numbers =
            |i: usize| (0..6 * LAYERS[i].channels.len()).map(move |at| 0.1 * (at + i) as f32 + 1e4 * at as f32);
        Frame::of_layers((3, 2), None, std::array::from_fn(|i| numbers(i).collect()))
    }

    fn stats() -> Stats {
        let maps = [
            MapStats { emitted: 5_000_000_000, stored: 7, seen: None },
            MapStats { emitted: 11, stored: 3, seen: None },
        ];
        Stats {
            device: DeviceStats { name: "Große Karte".into(), driver: "1.2".into() },
            photons: PhotonStats { global: maps[0], caustic: maps[1], ..PhotonStats::default() },
            ..Stats::default()
        }
    }

    fn write(path: &Path, frame: &Frame, settings: &Settings) {
        let provenance = Provenance {
            scene: "räume.gltf",
            scene_hash: "ab12",
            options: &LoadOptions::default(),
            environment: None,
            objects: Vec::new(),
            materials: Vec::new(),
            settings,
            stats: &stats(),
        };
        write_exr(path, frame, &provenance).unwrap();
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
            ("loading", &serde_json::to_string(&LoadOptions::default()).unwrap()),
            ("scene", "räume.gltf"),
            ("sceneHash", "ab12"),
            ("device", "Große Karte"),
            ("driver", "1.2"),
            ("globalEmitted", "5000000000"),
            ("globalStored", "7"),
            ("causticEmitted", "11"),
            ("causticStored", "3"),
            ("extraSamples", "0"),
        ] {
            assert_eq!(found[name], value, "{name}");
        }
        assert_eq!(found.len(), 13);
    }

    #[test]
    fn tells_how_the_scene_was_lit_from_all_around() {
        let folder = tempfile::tempdir().unwrap();
        let found = |environment: Option<EnvironmentProvenance>| {
            let path = folder.path().join("a.exr");
            let settings = Settings::default();
            let provenance = Provenance {
                scene: "",
                scene_hash: "",
                options: &LoadOptions::default(),
                environment,
                objects: Vec::new(),
                materials: Vec::new(),
                settings: &settings,
                stats: &stats(),
            };
            write_exr(&path, &frame(), &provenance).unwrap();
            let mut all = read_exr_attributes(&path).unwrap();
            all.retain(|name, _| name.starts_with("environment"));
            all.into_iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>()
        };
        let map = EnvironmentProvenance {
            name: "sky.hdr",
            hash: "cd",
            radiance: None,
            strength: 0.5,
            rotation: 30_f32.to_radians(),
        };
        let of_map = ["environment sky.hdr", "environmentHash cd", "environmentRotation 30", "environmentStrength 0.5"];
        assert_eq!(found(Some(map)), of_map);
        let uniform = EnvironmentProvenance { radiance: Some([1.0, 0.25, 0.0]), ..map };
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
        other.layer_mut("albedo")[17] = 0.25;
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
