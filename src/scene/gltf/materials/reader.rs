//! Reading of numbers and textures of one material.

use gltf::json;
use serde::de::DeserializeOwned;

use super::super::fault::{Notes, Read, fault};
use super::super::images::{Content, ImageList};
use super::super::strict_json::typed;
use super::super::textures::{self, AXES, Reference};
use crate::scene::{Alpha, ImageValues, Texture, UV_SETS};
use glam::Vec3;

/// Reader of one material of the file, as a mesh without some sets of texture coordinates shows it.
pub(super) struct Reader<'a> {
    pub(super) root: &'a json::Root,
    pub(super) material: &'a json::Material,
    /// Name in notes, and JSON path.
    pub(super) name: String,
    pub(super) place: String,
    /// TEXCOORD_n that the mesh lacks.
    pub(super) lacks: &'a [u32],
    /// TEXCOORD_n behind each of the triangles' sets.
    pub(super) sets: Vec<u32>,
    /// TEXCOORD_n of all textures, also of those left out.
    pub(super) asked: Vec<u32>,
    pub(super) images: &'a mut ImageList,
    pub(super) notes: &'a mut Notes,
}

impl Reader<'_> {
    /// Adds a note on the material.
    pub(super) fn note(&mut self, note: &str) {
        self.notes.about("material", &self.name, &format!(": {note}"));
    }

    /// An extension of the material that the crate does not know.
    pub(super) fn extension<T: DeserializeOwned>(&self, name: &str) -> Read<Option<T>> {
        let extension = self.material.extensions.as_ref().and_then(|extensions| extensions.others.get(name));
        let Some(extension) = extension else { return Ok(None) };
        typed(extension, format_args!("{}.extensions.{name}", self.place)).map(Some)
    }

    /// A number of the material, clamped to 0..1; `what` it is in notes, `at` in the file.
    pub(super) fn unit(&mut self, value: f32, what: &str, at: &str) -> Read<f32> {
        if !value.is_finite() {
            return fault(format!("{}.{at}", self.place), format!("{value} is not finite"));
        }
        if !(0.0..=1.0).contains(&value) {
            self.note(&format!("{what} {value} is clamped to 0..1"));
        }
        Ok(value.clamp(0.0, 1.0))
    }

    /// A colour of the material, each channel clamped to 0..1.
    pub(super) fn color(&mut self, given: [f32; 3], what: &str, at: &str) -> Read<Vec3> {
        let color = Vec3::from_array(given);
        if !color.is_finite() {
            let [r, g, b] = given;
            return fault(format!("{}.{at}", self.place), format!("{r} {g} {b} is not a colour of finite numbers"));
        }
        let clamped = color.clamp(Vec3::ZERO, Vec3::ONE);
        if clamped != color {
            let [r, g, b] = given;
            self.note(&format!("{what} {r} {g} {b} is clamped to 0..1"));
        }
        Ok(clamped)
    }

    /// A number of the material that must be finite and at least `least`.
    pub(super) fn at_least(&self, least: f32, value: f32, at: &str) -> Read<f32> {
        if value.is_finite() && value >= least {
            return Ok(value);
        }
        fault(format!("{}.{at}", self.place), format!("{value} is not a finite number of at least {least}"))
    }

    /// A texture of colours: its RGB have the sRGB curve.
    pub(super) fn color_texture<'r>(
        &mut self,
        reference: Option<impl Into<Reference<'r>>>,
        at: &str,
    ) -> Read<Option<Texture>> {
        self.texture(reference, at, |image| (Content::File(image), ImageValues::Colors))
    }

    /// The texture of the base colour of a material: its A is the opacity.
    pub(super) fn base_texture<'r>(
        &mut self,
        reference: Option<impl Into<Reference<'r>>>,
        (alpha, opacity): (Alpha, f32),
        at: &str,
    ) -> Read<Option<Texture>> {
        let values = ImageValues::of_colors(alpha, opacity);
        self.texture(reference, at, |image| (Content::File(image), values))
    }

    /// A texture of linear values.
    pub(super) fn data_texture<'r>(
        &mut self,
        reference: Option<impl Into<Reference<'r>>>,
        at: &str,
    ) -> Read<Option<Texture>> {
        self.texture(reference, at, |image| (Content::File(image), ImageValues::Data))
    }

    /// A texture that shows what `content` makes of an image of the file, and what that is.
    /// `None` if there is none, or if it is left out with a note.
    pub(super) fn texture<'r>(
        &mut self,
        reference: Option<impl Into<Reference<'r>>>,
        at: &str,
        content: impl Fn(usize) -> (Content, ImageValues),
    ) -> Read<Option<Texture>> {
        let Some(reference) = reference.map(Into::into) else { return Ok(None) };
        let place = format!("{}.{at}", self.place);
        let (set, texture) = textures::sampled(self.root, reference, &place, self.notes)?;
        let Some(image) = textures::image(self.root, reference.texture, self.notes)? else { return Ok(None) };
        let lacks = self.lacks.contains(&set);
        let Some(uv_set) = self.uv_set(set) else {
            if !lacks {
                let what = at.rsplit('.').next().unwrap_or(at);
                self.note(&format!(
                    "{what} is left out: its TEXCOORD_{set} is one more than the {UV_SETS} sets of texture \
                     coordinates that a material can use"
                ));
            }
            return Ok(None);
        };
        let (content, values) = content(image);
        Ok(Some(Texture { image: self.images.index(content, values), uv_set, ..texture }))
    }

    /// Asks for tangents, which may be made along the first set of texture coordinates; whether the
    /// mesh has either.
    pub(super) fn axes(&mut self) -> bool {
        let has = self.asks(AXES);
        if has {
            self.known_set(0);
        }
        has
    }

    /// Index of TEXCOORD_n among the triangles' sets of texture coordinates; `None` where the mesh
    /// lacks it or there are too many.
    pub(super) fn uv_set(&mut self, set: u32) -> Option<u32> {
        if self.asks(set) { self.known_set(set) } else { None }
    }

    /// Whether the mesh has what is asked for.
    fn asks(&mut self, set: u32) -> bool {
        if !self.asked.contains(&set) {
            self.asked.push(set);
        }
        !self.lacks.contains(&set)
    }

    fn known_set(&mut self, set: u32) -> Option<u32> {
        let known = self.sets.iter().position(|known| *known == set);
        if known.is_none() && self.sets.len() == UV_SETS {
            return None;
        }
        let uv_set = known.unwrap_or_else(|| {
            self.sets.push(set);
            self.sets.len() - 1
        });
        Some(uv_set as u32)
    }
}
