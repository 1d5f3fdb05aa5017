//! Sums of the films of many passes, whose bits do not depend on who rendered which of them.
//!
//! Additions of floating-point numbers round, so that their order decides the last bits. Passes are
//! therefore added by a binary tree over their indices: the sum of an aligned run of 2^n passes, a
//! block, is that of its left half plus that of its right half. A part of a picture's passes keeps
//! the largest blocks that it has whole, and parts together hold blocks of the same tree. The
//! rounding error of such a sum grows with the logarithm of the number of passes only (Higham 1993,
//! "The Accuracy of Floating Point Summation", section 3).

use super::film::Film;
use crate::{
    error::Result,
    map_kind::ByKind,
    settings::PassRange,
    stats::{MapStats, Stats},
};

/// Sum of consecutive passes, or of those of a range that are there.
#[derive(Clone, Debug, PartialEq)]
pub struct PassBlock {
    /// The range that it stands for: 2^n passes from a multiple of 2^n on.
    pub(super) range: PassRange,
    /// Sums of the passes.
    pub(super) film: Film,
    /// Photons of all maps of the passes.
    pub(super) photons: ByKind<MapStats>,
}

impl PassBlock {
    /// The block of one pass.
    #[must_use]
    pub fn of_pass(index: u32, film: Film, stats: &Stats) -> Self {
        let photons = ByKind { global: stats.photons.global, caustic: stats.photons.caustic };
        Self { range: PassRange { first: index, end: index + 1 }, film, photons }
    }

    /// The range of passes.
    #[must_use]
    pub fn range(&self) -> PassRange {
        self.range
    }

    /// The film of all passes.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Photons of all maps of the passes.
    #[must_use]
    pub fn photons(&self) -> &ByKind<MapStats> {
        &self.photons
    }

    /// Adds a later block. Both together stand for the smallest block that holds them.
    fn add(&mut self, later: &Self) -> Result<()> {
        self.film.merge(&later.film)?;
        self.photons.global.add(later.photons.global);
        self.photons.caustic.add(later.photons.caustic);
        self.range = around(self.range, later.range);
        Ok(())
    }
}

/// Smallest block that holds both ranges.
fn around(a: PassRange, b: PassRange) -> PassRange {
    let level = (0..32).find(|level| (a.first >> level) == ((b.end - 1) >> level)).unwrap_or(32);
    let size = 1_u64 << level;
    let first = u64::from(a.first) / size * size;
    PassRange { first: first as u32, end: u32::try_from(first + size).unwrap_or(u32::MAX) }
}

/// Whether a range is that of a block.
pub(super) fn is_block(range: PassRange) -> bool {
    range.first < range.end && range.count().is_power_of_two() && range.first.is_multiple_of(range.count())
}

/// Passes of a picture in whole blocks, ascending. Consecutive passes are at most twice the
/// logarithm of their number in blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassSum {
    pub(super) blocks: Vec<PassBlock>,
}

impl PassSum {
    /// The blocks.
    #[must_use]
    pub fn blocks(&self) -> &[PassBlock] {
        &self.blocks
    }

    /// First pass and the one behind the last; `None` if there is none.
    #[must_use]
    pub fn range(&self) -> Option<PassRange> {
        let (first, last) = (self.blocks.first()?, self.blocks.last()?);
        Some(PassRange { first: first.range.first, end: last.range.end })
    }

    /// Adds a block behind all others.
    ///
    /// # Errors
    /// [`crate::Error::Differs`] if it is of another picture.
    pub fn push(&mut self, block: PassBlock) -> Result<()> {
        self.blocks.push(block);
        while let [.., a, b] = self.blocks.as_slice() {
            let whole = PassRange { first: a.range.first, end: b.range.end };
            if a.range.end != b.range.first || a.range.count() != b.range.count() || !is_block(whole) {
                break;
            }
            let later = self.blocks.pop().expect("two blocks");
            self.blocks.last_mut().expect("two blocks").add(&later)?;
        }
        Ok(())
    }

    /// The sum of all passes; `None` if there is none.
    ///
    /// # Errors
    /// [`crate::Error::Differs`] if the blocks are of several pictures.
    pub fn total(&self) -> Result<Option<PassBlock>> {
        let mut fold = Fold::default();
        self.blocks.iter().try_for_each(|block| fold.push(block.clone()))?;
        fold.finish()
    }
}

/// Sum of blocks that come in ascending order, with gaps or without. It holds no more of them than
/// the logarithm of the index of the last pass, and gives the same bits however the passes are
/// divided into blocks.
#[derive(Debug, Default)]
pub struct Fold {
    /// Sums of what is there of blocks, ascending.
    open: Vec<PassBlock>,
}

impl Fold {
    /// Adds a block that comes after all others.
    ///
    /// # Errors
    /// [`crate::Error::Differs`] if it is of another picture.
    pub fn push(&mut self, block: PassBlock) -> Result<()> {
        while let [.., a, b] = self.open.as_slice() {
            // Nothing more comes for a block that ends before this one.
            if around(a.range, b.range).end > block.range.first {
                break;
            }
            self.add_last()?;
        }
        self.open.push(block);
        Ok(())
    }

    /// The sum; `None` if nothing was added.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn finish(mut self) -> Result<Option<PassBlock>> {
        while self.open.len() > 1 {
            self.add_last()?;
        }
        Ok(self.open.pop())
    }

    fn add_last(&mut self) -> Result<()> {
        let later = self.open.pop().expect("two blocks");
        self.open.last_mut().expect("two blocks").add(&later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Crop;

    /// A pass of one pixel, with sums that do not add up exactly.
    fn pass(index: u32) -> PassBlock {
        let mut film = Film::new((1, 1), Crop { column: 0, row: 0, width: 1, height: 1 }, 1);
        let value = 0.1 + 1.0 / (index as f32 + 3.0);
        film.add(
            (0, 0),
            &[[value, value * 1e-5, value * 1e5, 0.0], [value; 4], [value; 4], [0.0; 4], [0.0; 4], [0.0; 4]],
            1,
        );
        let map = MapStats { emitted: 10, stored: u64::from(index), seen: None };
        let stats = Stats::default();
        PassBlock { photons: ByKind { global: map, caustic: map }, ..PassBlock::of_pass(index, film, &stats) }
            .with_bandwidth(1.0 / f64::from(index + 1))
    }

    impl PassBlock {
        fn with_bandwidth(self, factor: f64) -> Self {
            Self { film: self.film.with_bandwidth(factor), ..self }
        }
    }

    fn sum(passes: impl IntoIterator<Item = u32>) -> PassSum {
        let mut sum = PassSum::default();
        passes.into_iter().for_each(|index| sum.push(pass(index)).expect("they are of one picture"));
        sum
    }

    /// Sum of parts that were pushed one after the other.
    fn merged(parts: &[PassSum]) -> PassBlock {
        let mut fold = Fold::default();
        parts.iter().flat_map(|part| part.blocks.clone()).for_each(|block| fold.push(block).expect("of one picture"));
        assert!(fold.open.len() <= 12);
        fold.finish().expect("of one picture").expect("passes")
    }

    #[test]
    fn any_split_gives_the_same_bits() {
        let whole = sum(0..37).total().expect("of one picture").expect("passes");
        for cuts in [vec![0, 3, 8, 37], vec![0, 1, 2, 21, 36, 37], (0..=37).collect(), vec![0, 37]] {
            let parts: Vec<_> = cuts.windows(2).map(|w| sum(w[0]..w[1])).collect();
            assert_eq!(merged(&parts), whole, "{cuts:?}");
        }
        // Control: the order of additions matters to these numbers.
        let mut in_turn = pass(0);
        (1..37).for_each(|index| in_turn.film.merge(&pass(index).film).expect("of one picture"));
        assert_ne!(in_turn.film, whole.film);
        assert_eq!((in_turn.film.passes(), in_turn.film.samples()), (whole.film.passes(), whole.film.samples()));
    }

    #[test]
    fn gaps_do_not_depend_on_the_split_either() {
        let there = |index: &u32| !(5..12).contains(index) && *index != 20;
        let whole = sum((0..40).filter(there)).total().expect("of one picture").expect("passes");
        let parts: Vec<_> = [0, 3, 14, 22, 40].windows(2).map(|w| sum((w[0]..w[1]).filter(there))).collect();
        assert_eq!(merged(&parts), whole);
        assert_eq!((whole.film.passes(), whole.photons.global.emitted), (32, 320));
        let many = (0..1000).filter(|index| index % 2 == 0).map(|index| sum([index])).collect::<Vec<_>>();
        assert_eq!(merged(&many).film.passes(), 500, "few blocks are open at once");
    }

    #[test]
    fn blocks_are_few_and_aligned() {
        let ranges = |sum: PassSum| sum.blocks.iter().map(|b| b.range.to_string()).collect::<Vec<_>>().join(" ");
        assert_eq!(ranges(sum(0..8)), "0..8");
        assert_eq!(ranges(sum(3..8)), "3..4 4..8");
        assert_eq!(ranges(sum(5..21)), "5..6 6..8 8..16 16..20 20..21");
        assert_eq!(sum(3..8).range(), Some(PassRange { first: 3, end: 8 }));
        assert_eq!(around(PassRange { first: 3, end: 4 }, PassRange { first: 4, end: 8 }).to_string(), "0..8");
        assert!(is_block(PassRange { first: 4, end: 8 }) && !is_block(PassRange { first: 2, end: 6 }));
    }
}
