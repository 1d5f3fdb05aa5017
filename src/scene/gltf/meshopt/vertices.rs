//! Streams of vertices (EXT_meshopt_compression, appendix A, mode 0: attributes; version 1 is
//! KHR_meshopt_compression's).

/// Maximum size of a block of vertices, in bytes and in vertices.
const BLOCK_BYTES: usize = 8192;
const BLOCK_VERTICES: usize = 256;
/// Number of bytes in a group, which have a common bit width.
const GROUP: usize = 16;
/// Bit width of a group by its selector: for version 0, and for the two tables of version 1.
const WIDTHS: [[u32; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];

/// Byte stream, read from the front.
pub(super) struct Input<'a>(pub(super) &'a [u8]);

impl<'a> Input<'a> {
    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }
}

/// Decodes `count` vertices of `stride` bytes, a multiple of 4 up to 256; `None` if the stream is
/// damaged.
pub(super) fn decode(bytes: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let mut input = Input(bytes);
    let version = match input.byte()? {
        0xa0 => 0,
        0xa1 => 1,
        _ => return None,
    };
    // The tail holds the base of the first vertex's differences, and in version 1 the kinds of
    // difference.
    let channels = if version == 0 { 0 } else { stride / 4 };
    let tail = stride + channels;
    let padded = tail.max(if version == 0 { 32 } else { 24 });
    let body = input.0.len().checked_sub(padded)?;
    let mut last = input.0[input.0.len() - tail..].to_vec();
    let channels = last.split_off(stride);
    let mut input = Input(&input.0[..body]);

    let block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_VERTICES);
    let mut out = Vec::new();
    while out.len() < count * stride {
        let vertices = block.min(count - out.len() / stride);
        let control = input.take(channels.len())?;
        let start = out.len();
        out.resize(start + vertices * stride, 0);
        for k in (0..stride).step_by(4) {
            let control = control.get(k / 4).copied();
            let mut planes = [[0; BLOCK_VERTICES]; 4];
            for (j, plane) in planes.iter_mut().enumerate() {
                let selector = control.map(|control| control >> (2 * j) & 3);
                read_plane(&mut input, selector, &mut plane[..vertices])?;
            }
            let channel = channels.get(k / 4).copied().unwrap_or(0);
            let words = (0..vertices).map(|i| u32::from_le_bytes(planes.map(|plane| plane[i])));
            let mut previous = u32::from_le_bytes(last[k..k + 4].try_into().ok()?);
            for (i, word) in words.enumerate() {
                previous = add(previous, word, channel)?;
                out[start + i * stride + k..][..4].copy_from_slice(&previous.to_le_bytes());
            }
        }
        last.copy_from_slice(&out[out.len() - stride..]);
    }
    input.0.is_empty().then_some(out)
}

/// Decodes one byte of each vertex of a block.
fn read_plane(input: &mut Input<'_>, selector: Option<u8>, plane: &mut [u8]) -> Option<()> {
    let widths = match selector {
        None => WIDTHS[0],
        Some(0) => WIDTHS[1],
        Some(1) => WIDTHS[2],
        Some(2) => return Some(()),
        Some(_) => {
            plane.copy_from_slice(input.take(plane.len())?);
            return Some(());
        }
    };
    let groups = plane.len().div_ceil(GROUP);
    let header = input.take(groups.div_ceil(4))?;
    for (g, group) in plane.chunks_mut(GROUP).enumerate() {
        let width = widths[usize::from(header[g / 4] >> (2 * (g % 4)) & 3)];
        let values = read_group(input, width)?;
        group.copy_from_slice(&values[..group.len()]);
    }
    Some(())
}

/// Decodes sixteen bytes of `width` bits each. The largest value of a narrow width marks a full
/// byte that follows.
fn read_group(input: &mut Input<'_>, width: u32) -> Option<[u8; GROUP]> {
    let mut values = [0; GROUP];
    if width == 0 {
        return Some(values);
    }
    let packed = input.take(2 * width as usize)?;
    let mask = (1_u32 << width) - 1;
    for (i, value) in values.iter_mut().enumerate() {
        let bit = i as u32 * width;
        let byte = u32::from(packed[(bit / 8) as usize]);
        // Single bits are packed from the lowest bit, wider numbers from the highest.
        let shift = if width == 1 { bit % 8 } else { 8 - width - bit % 8 };
        let number = byte >> shift & mask;
        *value = if width < 8 && number == mask { input.byte()? } else { number as u8 };
    }
    Some(values)
}

/// Applies difference `word` to the `previous` four bytes: differences of bytes, of 16 bits, or of
/// all bits by exclusive or.
fn add(previous: u32, word: u32, channel: u8) -> Option<u32> {
    match channel & 3 {
        0 => Some(u32::from_le_bytes(std::array::from_fn(|j| {
            let (byte, delta) = (previous.to_le_bytes()[j], word.to_le_bytes()[j]);
            byte.wrapping_add(delta >> 1 ^ (delta & 1).wrapping_neg())
        }))),
        1 => {
            let half = |shift: u32| {
                let (half, delta) = ((previous >> shift) as u16, (word >> shift) as u16);
                u32::from(half.wrapping_add(delta >> 1 ^ (delta & 1).wrapping_neg())) << shift
            };
            Some(half(0) | half(16))
        }
        2 => Some(previous ^ word.rotate_right(u32::from(channel >> 4))),
        _ => None,
    }
}
