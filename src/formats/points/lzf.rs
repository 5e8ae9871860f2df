//! Decompression of LZF, Marc Lehmann's format, in which PCD files are compressed.
//!
//! A control byte below 32 is followed by as many bytes as it says, plus one. Any other one repeats earlier bytes: its
//! upper three bits are the length less two (7: a further byte is added), its lower five and the next byte the distance
//! less one.

/// Decompresses to exactly `length` bytes; `None` where the bytes are damaged or give another length.
pub(super) fn decompress(bytes: &[u8], length: usize) -> Option<Vec<u8>> {
    // No byte stands for more than 264, so a length that cannot be is refused before it is reserved.
    if length / 264 > bytes.len() {
        return None;
    }
    let mut out = Vec::with_capacity(length);
    let mut input = bytes.iter().copied();
    while let Some(control) = input.next() {
        if control < 32 {
            for _ in 0..=control {
                out.push(input.next()?);
            }
        } else {
            let mut count = usize::from(control >> 5);
            if count == 7 {
                count += usize::from(input.next()?);
            }
            let distance = usize::from(control & 31) << 8 | usize::from(input.next()?);
            let start = out.len().checked_sub(distance + 1)?;
            for at in start..start + count + 2 {
                out.push(out[at]);
            }
        }
        if out.len() > length {
            return None;
        }
    }
    (out.len() == length).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_repeats_are_written_out() {
        // Three bytes as they are, four of them again from three before, ten of the last.
        let bytes = [2, b'a', b'b', b'c', 2 << 5, 2, 7 << 5, 1, 0];
        assert_eq!(decompress(&bytes, 17).unwrap(), b"abcabcaaaaaaaaaaa");
    }

    #[test]
    fn damaged_bytes_are_refused() {
        assert_eq!(decompress(&[2, b'a'], 3), None, "ends too early");
        assert_eq!(decompress(&[0, b'a', 1 << 5, 1], 4), None, "repeats what is not there");
        assert_eq!(decompress(&[0, b'a'], 2), None, "another length");
        assert_eq!(decompress(&[0, b'a'], 1 << 40), None, "no room is reserved for it");
        assert_eq!(decompress(&[], 0), Some(Vec::new()));
    }
}
