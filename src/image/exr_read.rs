//! Reading of OpenEXR files that [`super::exr`] and others wrote.

use std::{
    io::{Cursor, Read},
    path::Path,
};

use exr::{
    meta::{
        MetaData,
        attribute::{AttributeValue, Text},
        header::Header,
    },
    prelude::{AnyChannels, FlatSamples, Image, ReadChannels, ReadLayers},
};

use super::{
    exr::{Attributes, CRYPTOMATTE, OURS, failure},
    file::open_regular,
    frame::{DataWindow, Frame},
    layers::LAYERS,
};
use crate::error::{Error, Result};

type ReadImage = Image<exr::image::Layer<AnyChannels<FlatSamples>>>;

/// Bytes that any file may claim, and those that one byte of a compressed file may: more than
/// DEFLATE's 1032.
const UNCHECKED_BYTES: u64 = 1 << 26;
const MOST_COMPRESSION: u64 = 1100;

/// Reads a frame with R, G, B of any sample type. A missing A is read as 1, other missing channels
/// as 0.
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
    let mut layers = [const { Vec::new() }; LAYERS.len()];
    for (numbers, row) in layers.iter_mut().zip(&LAYERS) {
        let channels = row.channels.iter().map(|name| {
            let missing = || failure(path, format!("the file has no channel {name}"));
            find(name).or(row.missing.map(|value| vec![value; pixels])).ok_or_else(missing)
        });
        let channels: Vec<Vec<f32>> = channels.collect::<Result<_>>()?;
        *numbers = (0..pixels).flat_map(|i| channels.iter().map(move |channel| channel[i])).collect();
    }
    let size = (layer.size.width() as u32, layer.size.height() as u32);
    Ok(Frame::of_layers(size, window_of(&image), layers))
}

/// Data window of the image, if it is only a part of the display window.
pub(super) fn window_of(image: &ReadImage) -> Option<DataWindow> {
    let (whole, layer) = (image.attributes.display_window, &image.layer_data);
    let from = layer.attributes.layer_position - whole.position;
    let offset = |at: i32, size: usize, whole: usize| u32::try_from(at).ok().filter(|&at| at as usize + size <= whole);
    let column = offset(from.x(), layer.size.width(), whole.size.width())?;
    let row = offset(from.y(), layer.size.height(), whole.size.height())?;
    let size = (whole.size.width() as u32, whole.size.height() as u32);
    (layer.size != whole.size).then_some(DataWindow { whole: size, column, row })
}

/// Reads the text attributes that [`write_exr`](super::write_exr) wrote, by name without the prefix
/// `caustica:`.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read or is not OpenEXR.
pub fn read_exr_attributes(path: &Path) -> Result<Attributes> {
    Ok(attributes_of(&open(path)?))
}

/// Our attributes of an image.
pub(super) fn attributes_of(image: &ReadImage) -> Attributes {
    our_attributes(image.attributes.other.iter().chain(&image.layer_data.attributes.other))
}

/// Our attributes among those of a header.
pub(super) fn our_attributes<'a>(all: impl Iterator<Item = (&'a Text, &'a AttributeValue)>) -> Attributes {
    let ours = all.filter_map(|(name, value)| match value {
        AttributeValue::Text(value) => {
            let name = String::from_utf8_lossy(name.bytes());
            let ours = name.strip_prefix(OURS).or(Some(&*name).filter(|name| name.starts_with(CRYPTOMATTE)))?;
            Some((ours.to_owned(), String::from_utf8_lossy(value.bytes()).into_owned()))
        }
        _ => None,
    });
    ours.collect()
}

pub(super) fn open(path: &Path) -> Result<ReadImage> {
    open_or(path, |error| failure(path, error))
}

/// Variant of [`open`] with another error for what the decoder refuses.
pub(super) fn open_or(path: &Path, refused: impl FnOnce(exr::error::Error) -> Error) -> Result<ReadImage> {
    let mut bytes = Vec::new();
    open_regular(path)
        .and_then(|mut file| file.read_to_end(&mut bytes))
        .map_err(|source| Error::Io { path: path.to_path_buf(), source })?;
    check_claims(&bytes).map_err(|problem| failure(path, problem))?;
    exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        // Decodes on one thread: a panic in a worker thread of the exr crate would end the process.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(refused)
}

/// Refuses a file that claims more numbers than its bytes can hold, before memory is taken for
/// them.
fn check_claims(bytes: &[u8]) -> std::result::Result<(), String> {
    let Ok(meta) = MetaData::read_from_buffered(bytes, false) else { return Ok(()) };
    let claimed = |header: &Header| {
        let pixels = header.layer_size.width() as u64 * header.layer_size.height() as u64;
        pixels.saturating_mul(4 * header.channels.list.len() as u64)
    };
    let most = UNCHECKED_BYTES + MOST_COMPRESSION * bytes.len() as u64;
    match meta.headers.iter().find(|header| claimed(header) > most) {
        None => Ok(()),
        Some(header) => {
            let (width, height) = (header.layer_size.width(), header.layer_size.height());
            Err(format!("is damaged: {} bytes do not hold {width} x {height} pixels", bytes.len()))
        }
    }
}
