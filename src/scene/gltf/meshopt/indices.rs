//! Streams of indices (EXT_meshopt_compression, appendix A, mode 1: triangles, and mode 2:
//! indices).

use super::vertices::Input;

/// FIFO of the last 16 items, the latest first.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(item: T) -> Self {
        Self { items: [item; 16], next: 0 }
    }

    fn push(&mut self, item: T) {
        self.items[self.next] = item;
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, age: u8) -> T {
        self.items[(self.next + 15 - usize::from(age)) % 16]
    }
}

/// State of the triangle stream.
struct Triangles<'a> {
    data: Input<'a>,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// Lowest vertex index not used yet.
    fresh: u32,
    /// Base of the differences that encode explicit indices.
    last: u32,
}

impl Triangles<'_> {
    fn fresh(&mut self) -> u32 {
        let fresh = self.fresh;
        self.fresh = fresh.wrapping_add(1);
        fresh
    }

    fn read_index(&mut self) -> Option<u32> {
        let v = read_number(&mut self.data)?;
        self.last = self.last.wrapping_add(v >> 1 ^ (v & 1).wrapping_neg());
        Some(self.last)
    }

    /// The third vertex of a triangle on a recent edge.
    fn opposite(&mut self, code: u8, explicit: u8) -> Option<u32> {
        let vertex = match code {
            0 => self.fresh(),
            code if code < explicit => return Some(self.vertices.get(code)),
            15 => self.read_index()?,
            // One below the last, or one above it.
            code => {
                self.last = self.last.wrapping_add(u32::from(code) * 2).wrapping_sub(27);
                self.last
            }
        };
        self.vertices.push(vertex);
        Some(vertex)
    }

    /// A vertex of a triangle on no recent edge, and whether it is pushed.
    fn corner(&mut self, code: u8) -> Corner {
        match code {
            0 => Corner::New(self.fresh()),
            15 => Corner::InData,
            code => Corner::Recent(self.vertices.get(code - 1)),
        }
    }
}

/// Source of a vertex.
#[derive(Clone, Copy)]
enum Corner {
    New(u32),
    Recent(u32),
    InData,
}

/// Decodes `count` indices, a multiple of 3; `None` if the stream is damaged.
pub(super) fn decode_triangles(bytes: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut input = Input(bytes);
    // Before version 1, codes 13 and 14 are ages like the others.
    let explicit = match input.byte()? {
        0xe0 => 15,
        0xe1 => 13,
        _ => return None,
    };
    let codes = input.take(count / 3)?;
    let (data, table) = input.0.split_at_checked(input.0.len().checked_sub(16)?)?;
    let mut state = Triangles {
        data: Input(data),
        edges: Recent::new([u32::MAX; 2]),
        vertices: Recent::new(u32::MAX),
        fresh: 0,
        last: 0,
    };
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        if code < 0xf0 {
            let [a, b] = state.edges.get(code >> 4);
            let c = state.opposite(code & 15, explicit)?;
            state.edges.push([c, b]);
            state.edges.push([a, c]);
            out.extend([a, b, c]);
            continue;
        }
        let (first, others) = match code {
            0xfe => (0, state.data.byte()?),
            0xff => (15, state.data.byte()?),
            _ => (0, table[usize::from(code & 15)]),
        };
        if code >= 0xfe && others == 0 {
            state.fresh = 0;
        }
        let corners = [first, others >> 4, others & 15].map(|code| state.corner(code));
        let mut triangle = [0; 3];
        for (vertex, corner) in triangle.iter_mut().zip(corners) {
            *vertex = match corner {
                Corner::New(vertex) | Corner::Recent(vertex) => vertex,
                Corner::InData => state.read_index()?,
            };
        }
        for (vertex, corner) in triangle.iter().zip(corners) {
            if !matches!(corner, Corner::Recent(_)) {
                state.vertices.push(*vertex);
            }
        }
        let [a, b, c] = triangle;
        [[b, a], [c, b], [a, c]].into_iter().for_each(|edge| state.edges.push(edge));
        out.extend(triangle);
    }
    state.data.0.is_empty().then_some(out)
}

/// Decodes `count` indices in any order; `None` if the stream is damaged.
pub(super) fn decode_sequence(bytes: &[u8], count: usize) -> Option<Vec<u32>> {
    let mut input = Input(bytes);
    if !matches!(input.byte()?, 0xd0 | 0xd1) {
        return None;
    }
    let mut data = Input(input.take(input.0.len().checked_sub(4)?)?);
    // Each index takes at least one byte.
    if count > data.0.len() {
        return None;
    }
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let v = read_number(&mut data)?;
        let baseline = &mut last[(v & 1) as usize];
        *baseline = baseline.wrapping_add(v >> 2 ^ (v >> 1 & 1).wrapping_neg());
        out.push(*baseline);
    }
    data.0.is_empty().then_some(out)
}

/// Variable-length integer of one to five bytes, seven bits in each, lowest first.
fn read_number(input: &mut Input<'_>) -> Option<u32> {
    let mut number = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = input.byte()?;
        number |= u32::from(byte & 127) << shift;
        if byte < 128 {
            break;
        }
    }
    Some(number)
}
