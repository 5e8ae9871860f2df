//! Raw beat signals as NumPy arrays (`.npy`, version 1.0): complex64, little-endian, row by row.
//!
//! The format (numpy.lib.format): the magic `\x93NUMPY`, two bytes of version, the length of the
//! header as u16, a Python dictionary padded with spaces to a multiple of 64 bytes and ended by a
//! newline, then the samples. `numpy.load(file, mmap_mode="r")` opens it without reading it.

use std::io::{Error, ErrorKind, Result, Write};

use num_complex::Complex;

/// Bytes that the samples must start at a multiple of.
const ALIGNMENT: usize = 64;

/// Bytes before the dictionary: magic, version, length.
const PREAMBLE: usize = 10;

/// Writes an array of `rows` × `columns`, such as chirps × samples, from its samples in that order.
///
/// Samples are rounded to single precision; 18 529 chirps of 4096 samples take 607 MB.
///
/// # Errors
/// What the writer reports; and `InvalidInput` when there are not exactly `rows` × `columns` samples.
/// What was written by then is not an array.
pub fn write_complex64(
    out: &mut impl Write,
    [rows, columns]: [usize; 2],
    samples: impl IntoIterator<Item = Complex<f64>>,
) -> Result<()> {
    out.write_all(&header([rows, columns]))?;
    let mut count = 0;
    for sample in samples {
        out.write_all(&(sample.re as f32).to_le_bytes())?;
        out.write_all(&(sample.im as f32).to_le_bytes())?;
        count += 1;
    }
    if rows.checked_mul(columns) == Some(count) {
        return Ok(());
    }
    let text =
        format!("an array of {rows} × {columns} was given {count} samples; give one for each");
    Err(Error::new(ErrorKind::InvalidInput, text))
}

fn header([rows, columns]: [usize; 2]) -> Vec<u8> {
    let dictionary =
        format!("{{'descr': '<c8', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let total = (PREAMBLE + dictionary.len() + 1).next_multiple_of(ALIGNMENT);
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    // Two 20-digit numbers fit into 128 bytes, far below the limit of a u16.
    bytes.extend(((total - PREAMBLE) as u16).to_le_bytes());
    bytes.extend(dictionary.bytes());
    bytes.resize(total - 1, b' ');
    bytes.push(b'\n');
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    fn bytes_of(shape: [usize; 2], samples: &[Complex<f64>]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_complex64(&mut bytes, shape, samples.iter().copied()).unwrap();
        bytes
    }

    #[test]
    fn bytes_are_those_of_the_format() {
        let bytes = bytes_of([1, 2], &[Complex::new(1.0, -2.0), Complex::new(0.5, 0.0)]);
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        expected.extend(b"{'descr': '<c8', 'fortran_order': False, 'shape': (1, 2), }");
        expected.extend(vec![b' '; 127 - expected.len()]);
        expected.push(b'\n');
        expected.extend([0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f, 0, 0, 0, 0]);
        assert_eq!(bytes, expected);
    }

    #[test]
    fn samples_start_aligned_whatever_the_shape() {
        for shape in [[0, 0], [18_529, 4096], [usize::MAX, usize::MAX], [7, 12_345_678]] {
            let header = header(shape);
            assert_eq!(header.len() % ALIGNMENT, 0);
            let stated = u16::from_le_bytes([header[8], header[9]]) as usize;
            assert_eq!(stated + PREAMBLE, header.len());
            assert_eq!(header.last(), Some(&b'\n'));
        }
    }

    #[test]
    fn a_wrong_count_is_refused() {
        let write = |shape, count| {
            let samples = std::iter::repeat_n(Complex::ONE, count);
            write_complex64(&mut Vec::new(), shape, samples)
        };
        assert!(write([2, 3], 6).is_ok());
        assert!(write([0, 3], 0).is_ok());
        let error = write([2, 3], 5).unwrap_err();
        assert!(error.to_string().contains("2 × 3 was given 5"), "{error}");
        assert!(write([usize::MAX, 2], 5).is_err());
    }

    #[test]
    fn numpy_reads_it() {
        if !Command::new("python3").args(["-c", "import numpy"]).status().is_ok_and(|s| s.success())
        {
            eprintln!("skipped: python3 with numpy is not installed");
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("beats.npy");
        let samples: Vec<_> = (0..6).map(|n| Complex::new(f64::from(n), -0.5)).collect();
        std::fs::write(&file, bytes_of([2, 3], &samples)).unwrap();
        let script = "import numpy, sys; a = numpy.load(sys.argv[1], mmap_mode='r'); \
                      print(a.dtype, a.shape, a.flags['C_CONTIGUOUS'], a[1, 2])";
        let output = Command::new("python3").args(["-c", script]).arg(&file).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert_eq!(text.trim(), "complex64 (2, 3) True (5-0.5j)");
    }
}
