//! Filters that are reversed after a stream of vertices was decoded (EXT_meshopt_compression,
//! appendix A, filters).

/// Unit vectors in octahedral encoding, of `BYTES` bytes per component, signed and normalised.
pub(super) fn octahedral<const BYTES: usize>(data: &mut [u8]) {
    let max = if BYTES == 1 { 127.0_f32 } else { 32767.0 };
    for element in data.chunks_exact_mut(4 * BYTES) {
        let [x, y, one] = [0, 1, 2].map(|c| component::<BYTES>(element, c));
        let z = one - x.abs() - y.abs();
        let fold = z.min(0.0);
        let unfold = |v: f32| if v >= 0.0 { v + fold } else { v - fold };
        let (x, y) = (unfold(x), unfold(y));
        let length = (x * x + y * y + z * z).sqrt();
        for (c, v) in [x, y, z].into_iter().enumerate() {
            // A vector of zero length stays zero: NaN converts to integer 0.
            let rounded = (v * (max / length)).round() as i16;
            element[c * BYTES..][..BYTES].copy_from_slice(&rounded.to_le_bytes()[..BYTES]);
        }
    }
}

fn component<const BYTES: usize>(element: &[u8], c: usize) -> f32 {
    if BYTES == 1 { f32::from(element[c] as i8) } else { f32::from(short(element, c)) }
}

fn short(element: &[u8], c: usize) -> i16 {
    i16::from_le_bytes([element[2 * c], element[2 * c + 1]])
}

/// Quaternions in 16-bit components, without the largest, which is reconstructed.
pub(super) fn quaternion(data: &mut [u8]) {
    for element in data.chunks_exact_mut(8) {
        let last = short(element, 3);
        let one = f32::from(last | 3);
        let [x, y, z] = [0, 1, 2].map(|c| f32::from(short(element, c)));
        let w = (2.0 * one * one - x * x - y * y - z * z).max(0.0).sqrt();
        let scale = 32767.0 / std::f32::consts::SQRT_2 / one;
        for (c, v) in [w, x, y, z].into_iter().enumerate() {
            let at = 2 * (((last & 3) as usize + c) % 4);
            element[at..at + 2].copy_from_slice(&((v * scale).round() as i16).to_le_bytes());
        }
    }
}

/// Floats of a signed 8-bit exponent and a signed 24-bit integer mantissa.
pub(super) fn exponential(data: &mut [u8]) {
    for word in data.chunks_exact_mut(4) {
        let (a, b, c, exponent) = (word[0], word[1], word[2], word[3] as i8);
        let mantissa = i32::from_le_bytes([0, a, b, c]) >> 8;
        let value = f64::from(mantissa) * 2_f64.powi(i32::from(exponent));
        word.copy_from_slice(&(value as f32).to_le_bytes());
    }
}
