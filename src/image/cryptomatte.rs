//! Mattes by the Cryptomatte specification (Friedman and Jones 2015, "Fully automatic ID mattes
//! with support for motion blur and transparency", and Psyop's "Cryptomatte specification" 1.2):
//! for each pixel the hashes of what it shows, with the part of the pixel that each covers.

use crate::settings::ExtraLayers;

/// Names that a pixel can show; of more, those that came last are left out.
pub(super) const RANKS: usize = 6;

/// A hash, and the number of samples that show its name; 0 for none.
pub(super) type Rank = [u32; 2];

/// Names that the samples of each pixel show.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matte {
    pub of: ExtraLayers,
    pub ranks: Vec<[Rank; RANKS]>,
}

impl Matte {
    /// An empty matte for each request of one.
    pub fn asked_for(asked: &[ExtraLayers], pixels: usize) -> impl Iterator<Item = Self> {
        let all = [ExtraLayers::Objects, ExtraLayers::Materials].into_iter().filter(|of| asked.contains(of));
        all.map(move |of| Self { of, ranks: vec![Default::default(); pixels] })
    }

    /// Adds samples of a pixel that show the name of that hash.
    pub fn add(&mut self, pixel: usize, hash: u32, samples: u32) {
        let free = self.ranks[pixel].iter_mut().find(|[other, count]| *count == 0 || *other == hash);
        if let Some(rank) = free {
            *rank = [hash, rank[1] + samples];
        }
    }

    /// Has each sample of a pixel count that many times.
    pub fn weigh(&mut self, pixel: usize, weight: u32) {
        self.ranks[pixel].iter_mut().for_each(|rank| rank[1] *= weight);
    }

    /// Adds the samples of other passes of the same pixels. What covers most is kept.
    pub fn merge(&mut self, other: &Self) {
        for (ranks, theirs) in self.ranks.iter_mut().zip(&other.ranks) {
            let mut all = ranks.to_vec();
            for [hash, count] in theirs.iter().filter(|[_, count]| *count > 0) {
                match all.iter_mut().find(|[other, count]| *count > 0 && other == hash) {
                    Some(rank) => rank[1] += count,
                    None => all.push([*hash, *count]),
                }
            }
            ranks.copy_from_slice(&by_coverage(all)[..RANKS]);
        }
    }

    /// Name of the layer in files.
    pub fn name(of: ExtraLayers) -> &'static str {
        if of == ExtraLayers::Materials { "CryptoMaterial" } else { "CryptoObject" }
    }

    /// Channels of a file, for pixels of that many samples: two ranks in each layer of R, G, B, A.
    pub fn channels(&self, samples: u64) -> Vec<(String, Vec<f32>)> {
        let sorted: Vec<_> = self.ranks.iter().map(|ranks| by_coverage(ranks.to_vec())).collect();
        let number = |ranks: &Vec<Rank>, channel: usize| {
            let [hash, count] = ranks[channel / 2];
            match channel % 2 {
                _ if count == 0 => 0.0,
                0 => f32::from_bits(hash),
                _ => (f64::from(count) / samples as f64) as f32,
            }
        };
        let name =
            |channel: usize| format!("{}{:02}.{}", Self::name(self.of), channel / 4, b"RGBA"[channel % 4] as char);
        let of = |channel| (name(channel), sorted.iter().map(|ranks| number(ranks, channel)).collect());
        (0..2 * RANKS).map(of).collect()
    }

    /// Attributes of a file with the matte, by their full names; the manifest gives the hash of
    /// each name.
    pub fn attributes<'a>(of: ExtraLayers, names: impl Iterator<Item = &'a str>) -> Vec<(String, String)> {
        let layer = Self::name(of);
        let key = &format!("{:08x}", hash(layer))[..7];
        let manifest: std::collections::BTreeMap<&str, String> =
            names.map(|name| (name, format!("{:08x}", hash(name)))).collect();
        let manifest = serde_json::to_string(&manifest).expect("texts");
        [("name", layer), ("hash", "MurmurHash3_32"), ("conversion", "uint32_to_float32"), ("manifest", &manifest)]
            .map(|(name, value)| (format!("cryptomatte/{key}/{name}"), value.to_owned()))
            .to_vec()
    }
}

/// The largest count first; equal ones by hash.
fn by_coverage(mut ranks: Vec<Rank>) -> Vec<Rank> {
    ranks.sort_by_key(|[hash, count]| (std::cmp::Reverse(*count), *hash));
    ranks
}

/// Hash of a name, whose bits are those of a normal 32-bit float.
pub(crate) fn hash(name: &str) -> u32 {
    const MANTISSA_BITS: u32 = 23;
    let hash = murmur3_32(name.as_bytes());
    let exponent = ((hash >> MANTISSA_BITS) & 0xff).clamp(1, 254);
    (hash & !(0xff << MANTISSA_BITS)) | (exponent << MANTISSA_BITS)
}

/// MurmurHash3_x86_32 with seed 0 (Appleby 2011).
fn murmur3_32(bytes: &[u8]) -> u32 {
    let scrambled = |word: u32| word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, byte| (word << 8) | u32::from(*byte));
    let (words, rest) = bytes.split_at(bytes.len() / 4 * 4);
    let mut hash = words.chunks(4).fold(0_u32, |hash, bytes| {
        (hash ^ scrambled(word(bytes))).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64)
    });
    hash ^= scrambled(word(rest)) ^ bytes.len() as u32;
    hash = (hash ^ (hash >> 16)).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ (hash >> 13)).wrapping_mul(0xc2b2_ae35);
    hash ^ (hash >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_specification() {
        // Vectors of the algorithm, and those that the specification lists.
        for (text, expected) in [("", 0), ("hello", 0x248b_fa47), ("hello, world", 0x149b_bb7f)] {
            assert_eq!(murmur3_32(text.as_bytes()), expected, "{text}");
        }
        for name in ["", "a", "CryptoObject", "Würfel.001"] {
            assert!(f32::from_bits(hash(name)).is_normal(), "{name}");
        }
    }

    #[test]
    fn a_matte_ranks_names_by_what_they_cover() {
        let [a, b] = ["a", "b"].map(hash);
        let mut matte = Matte::asked_for(&[ExtraLayers::Objects], 2).next().expect("asked for");
        matte.add(1, a, 1);
        matte.add(1, b, 2);
        let mut other = matte.clone();
        other.add(1, hash("c"), 1);
        matte.merge(&other);
        let channels = matte.channels(8);
        let names: Vec<_> = channels.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!((names.len(), names[0], names[5]), (12, "CryptoObject00.R", "CryptoObject01.G"));
        let numbers: Vec<f32> = channels.iter().take(6).map(|(_, numbers)| numbers[1]).collect();
        let [r, g, b_, a_, r1, g1] = numbers[..] else { panic!("six") };
        assert_eq!((r.to_bits(), g, b_.to_bits(), a_, r1.to_bits(), g1), (b, 0.5, a, 0.25, hash("c"), 0.125));
        assert!(channels.iter().all(|(_, numbers)| numbers[0] == 0.0), "a pixel that shows nothing");
    }

    #[test]
    fn the_manifest_lists_each_name() {
        let attributes = Matte::attributes(ExtraLayers::Materials, ["glass", "\"wall\""].into_iter());
        let key = format!("cryptomatte/{:07x}", hash("CryptoMaterial") >> 4);
        let names: Vec<_> = attributes.iter().map(|(name, _)| name.clone()).collect();
        assert_eq!(names, ["name", "hash", "conversion", "manifest"].map(|name| format!("{key}/{name}")));
        let manifest: serde_json::Value = serde_json::from_str(&attributes[3].1).expect("JSON");
        assert_eq!(manifest["\"wall\""], format!("{:08x}", hash("\"wall\"")));
    }

    #[test]
    fn the_names_that_cover_most_are_kept() {
        let mut matte = Matte::asked_for(&[ExtraLayers::Materials], 1).next().expect("asked for");
        (0..RANKS as u32).for_each(|i| matte.add(0, 100 + i, 1));
        matte.add(0, 999, 5);
        assert!(matte.ranks[0].iter().all(|[hash, _]| *hash != 999), "no place is left");
        let mut other = Matte::asked_for(&[ExtraLayers::Materials], 1).next().expect("asked for");
        other.add(0, 999, 5);
        matte.merge(&other);
        assert_eq!(matte.ranks[0][0], [999, 5]);
        assert_eq!(matte.ranks[0].len(), RANKS);
    }
}
