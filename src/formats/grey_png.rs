//! Whole numbers per pixel as a grey image of 16 bits.

use super::error::FormatError;

/// A PNG of so many columns and rows, from the top left row by row.
///
/// # Errors
/// As many values as pixels are needed.
pub fn grey_png([width, height]: [u32; 2], values: &[u16]) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let refused = |error: png::EncodingError| {
        FormatError::at("the image", error.to_string(), "give a value for each pixel")
    };
    let mut writer = encoder.write_header().map_err(refused)?;
    let samples: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
    writer.write_image_data(&samples).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let values = [0, 1, 255, 256, 40_000, u16::MAX];
        let bytes = grey_png([3, 2], &values).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut samples = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut samples).unwrap();
        assert_eq!((info.width, info.height, info.bit_depth), (3, 2, png::BitDepth::Sixteen));
        let read: Vec<u16> =
            samples.chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect();
        assert_eq!(read, values);
        assert!(grey_png([3, 2], &values[1..]).is_err());
    }
}
