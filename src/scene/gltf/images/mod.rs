//! Images of the textures in use: each is decoded once, all of them in parallel.

use std::borrow::Cow;

use gltf::json;
use rayon::prelude::*;
use sha2::{Digest as _, Sha256};

use super::accessor::Document;
use super::buffers::decode_data_uri;
use super::fault::{Notes, Read, fault};
use super::files::Resources;
use super::memory;
use crate::scene::{Image, ImageValues};

mod decode;
mod shrink;

use decode::{Encoded, FREE_TEXELS, TEXELS_PER_BYTE};

/// Largest image file, bytes.
const MAX_FILE: u64 = 1 << 30;

/// Content of an image of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Content {
    /// An image of the file.
    File(usize),
    /// G: 1 − glossiness · A of an image of the file.
    Roughness {
        /// Index of that image.
        image: usize,
        /// Factor on its A, 0 to 1.
        glossiness: f32,
    },
}

impl Content {
    fn file(self) -> usize {
        match self {
            Content::File(image) | Content::Roughness { image, .. } => image,
        }
    }
}

/// Images that materials in use need, in the order of their first use.
#[derive(Debug, Default)]
pub(super) struct ImageList {
    wanted: Vec<(Content, ImageValues)>,
}

impl ImageList {
    /// Index of an image in the scene. `values`: what it is used as.
    pub(super) fn index(&mut self, content: Content, values: ImageValues) -> u32 {
        let known = self.wanted.iter().position(|(known, _)| *known == content);
        let index = known.unwrap_or_else(|| {
            self.wanted.push((content, values));
            self.wanted.len() - 1
        });
        self.wanted[index].1 = self.wanted[index].1.and(values);
        index as u32
    }

    /// Decodes all images. `hash` takes the bytes of the files among them. Images with a side
    /// longer than `longest` are made smaller.
    pub(super) fn read(
        &self,
        document: &Document<'_>,
        resources: &Resources<'_>,
        longest: Option<u32>,
        hash: &mut Sha256,
        notes: &mut Notes,
    ) -> Read<Vec<Image>> {
        let root = document.root;
        let mut files: Vec<usize> = self.wanted.iter().map(|(content, _)| content.file()).collect();
        files.sort_unstable();
        files.dedup();
        let mut encoded = Vec::with_capacity(files.len());
        let mut left = FREE_TEXELS + TEXELS_PER_BYTE * document.held();
        for &i in &files {
            let bytes = bytes(document, resources, i, hash)?;
            let image = Encoded::new(bytes, &said(&root.images[i], i), format!("images[{i}]"))?;
            image.claim(&mut left)?;
            encoded.push(image);
        }
        let source = |content: Content| files.binary_search(&content.file()).unwrap_or_else(|_| unreachable!());
        let sizes: Vec<[u32; 2]> = self.wanted.iter().map(|(content, _)| encoded[source(*content)].size).collect();
        memory::check_images(&sizes, longest)?;
        // Images that several contents show are decoded for each: a second one is rare.
        let images: Vec<Read<Image>> = (self.wanted.par_iter())
            .map(|(content, values)| {
                let (mut name, encoded) =
                    (name(&root.images[content.file()], content.file()), &encoded[source(*content)]);
                let mut texels = encoded.texels()?;
                if let Content::Roughness { glossiness, .. } = content {
                    texels.iter_mut().for_each(|texel| *texel = rough(*texel, *glossiness));
                    name += " as roughness";
                }
                let [width, height] = encoded.size;
                let image = Image { name, width, height, texels };
                Ok(match longest {
                    Some(longest) => shrink::shrunk(image, longest, *values),
                    None => image,
                })
            })
            .collect();
        let images = images.into_iter().collect::<Read<Vec<Image>>>()?;
        for (image, [width, height]) in
            images.iter().zip(sizes).filter(|(image, size)| [image.width, image.height] != *size)
        {
            let Image { name, width: w, height: h, .. } = image;
            let made = format!(" of {width} x {height} texels is made {w} x {h} (`load.texture_size`)");
            notes.about("image", name, &made);
        }
        Ok(images)
    }
}

/// The texel of a roughness: G alone is read.
fn rough([.., a]: [u8; 4], glossiness: f32) -> [u8; 4] {
    [0, (255.0 - glossiness * f32::from(a)).round() as u8, 0, 255]
}

/// Encoded bytes of an image of the file.
fn bytes<'d>(
    document: &'d Document<'_>,
    resources: &Resources<'_>,
    index: usize,
    hash: &mut Sha256,
) -> Read<Cow<'d, [u8]>> {
    let (image, place) = (&document.root.images[index], format!("images[{index}]"));
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) if uri.starts_with("data:") => decode_data_uri(uri, &place).map(Cow::Owned),
        (Some(uri), _) => {
            let place = format!("{place}.uri");
            let bytes = resources.read_file(uri, MAX_FILE, &place)?;
            if bytes.len() as u64 == MAX_FILE {
                return fault(place, format!("{uri:?} has more than {} MiB", MAX_FILE >> 20));
            }
            hash.update(&bytes);
            Ok(Cow::Owned(bytes))
        }
        (None, Some(view)) => document.view(view.value(), &place).map(Cow::Borrowed),
        (None, None) => fault(place, "has neither uri nor bufferView"),
    }
}

/// Name of an image in lists: its own, else that of its file.
fn name(image: &json::Image, index: usize) -> String {
    let file = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
    let name = image.name.as_deref().filter(|name| !name.is_empty()).or(file);
    name.map_or_else(|| format!("image {index}"), str::to_owned)
}

/// An image in messages that name its place already: its file, else its name.
fn said(image: &json::Image, index: usize) -> String {
    match image.uri.as_deref().filter(|uri| !uri.starts_with("data:")) {
        Some(file) => format!("{file:?}"),
        None if image.name.is_some() => format!("{:?}", name(image, index)),
        None => image.buffer_view.map_or("the image".to_owned(), |view| format!("bufferViews[{}]", view.value())),
    }
}
