//! OpenEXR: a raster's channels as 32-bit floats, with their grid and their units, and a picture of them for viewers.
//!
//! One layer, ZIP in blocks of 16 lines or uncompressed; NaN is kept. The picture is the channels `R`, `G` and `B`, 16-bit
//! floats in linear light, which is what viewers show. The grid is in the attributes `pixelSizeM`,
//! `xMinM` and `yMinM` (double, m) and a channel's unit in `<channel>.unit`. The same raster
//! gives the same bytes on every run and any number of threads.

use std::collections::HashMap;
use std::io::Cursor;
use std::ops::Range;

use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::compression::Compression;
use exr::error::Error;
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use exr::image::{AnyChannel, FlatSamples};
use exr::meta::attribute::{AttributeValue, ChannelDescription, LineOrder, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::f16;
use miniz_oxide::deflate::{CompressionLevel, compress_to_vec_zlib};
use rayon::prelude::*;
use thiserror::Error;

use super::error::FormatError;
use super::light::light_of_srgb;
use crate::geometry::raster::{Channel, Raster};

/// How pixels are packed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Packing {
    /// Deflated, 16 lines together: the format's ZIP.
    #[default]
    Zip16,
    /// Not at all, for programs that cannot unpack.
    Uncompressed,
}

impl Packing {
    /// Lines that are packed together.
    fn lines(self) -> usize {
        match self {
            Packing::Zip16 => 16,
            Packing::Uncompressed => 1,
        }
    }

    fn pack(self, bytes: Vec<u8>) -> Vec<u8> {
        match self {
            Packing::Zip16 => zipped(bytes),
            Packing::Uncompressed => bytes,
        }
    }
}

impl From<Packing> for Compression {
    fn from(packing: Packing) -> Compression {
        match packing {
            Packing::Zip16 => Compression::ZIP16,
            Packing::Uncompressed => Compression::Uncompressed,
        }
    }
}

/// How many bytes of pixels one byte of a file may unfold to; deflate stays below 1032.
const MAX_UNFOLDING: usize = 2048;

/// Channels of a picture, as viewers know them.
const PICTURE: [&str; 3] = ["R", "G", "B"];

/// Bytes that a file holds per block besides its pixels: its offset, its first line and its length.
const BLOCK_OVERHEAD: usize = 16;
/// Bytes that are reserved for the header; with a longer one the buffer grows.
const RESERVED_FOR_HEADER: usize = 1 << 14;

/// Endings of channel names, and their units.
const UNITS: [(&str, &str); 9] = [
    ("_dbm", "dBm"),
    ("_db", "dB"),
    ("_w", "W"),
    ("_m", "m"),
    ("_mm", "mm"),
    ("_deg", "deg"),
    ("_rad", "rad"),
    ("_m2", "m^2"),
    ("_s", "s"),
];

/// The value of an attribute that a caller adds to a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text, UTF-8.
    Text(String),
    /// A number; its name should end in the unit.
    Number(f64),
}

/// Why a raster could not be written as OpenEXR.
#[derive(Debug, Error)]
pub enum ExrError {
    /// A channel has more or fewer values than the raster has pixels.
    #[error(
        "write channel {channel:?} of {values} values as {width} × {height} pixels: \
         give one value per pixel"
    )]
    Length {
        /// The channel's name.
        channel: String,
        /// Values in it.
        values: usize,
        /// Columns of the raster.
        width: usize,
        /// Rows of the raster.
        height: usize,
    },
    /// Two channels or two attributes have one name, or a name is empty or not plain ASCII.
    #[error("write {name:?} to OpenEXR: names are unique, of 1 to 255 printable ASCII characters")]
    Name {
        /// The name.
        name: String,
    },
    /// The encoder refused.
    #[error("write OpenEXR: {0}")]
    Encode(#[from] Error),
}

/// The bytes of an OpenEXR file with all channels of a raster, in alphabetical order, and the
/// caller's attributes, deflated.
///
/// # Errors
/// When the raster contradicts itself, or a name is given twice or cannot be written.
pub fn write(raster: &Raster, attributes: &[(String, Attribute)]) -> Result<Vec<u8>, ExrError> {
    write_packed(raster, attributes, None, Packing::Zip16)
}

/// As [`write()`], with a picture for viewers and a choice of the packing. `picture`: red, green and blue (sRGB) of every
/// pixel, row by row. It changes no other channel.
///
/// # Errors
/// When the raster contradicts itself or its picture, or a name is given twice or cannot be written.
pub fn write_packed(
    raster: &Raster,
    attributes: &[(String, Attribute)],
    picture: Option<&[[u8; 3]]>,
    packing: Packing,
) -> Result<Vec<u8>, ExrError> {
    let layer_attributes = LayerAttributes {
        software_name: Some(text(concat!("matdb ", env!("CARGO_PKG_VERSION")))),
        other: named_attributes(raster, attributes)?,
        ..LayerAttributes::default()
    };
    let picture = picture.map_or_else(Vec::new, linear_light);
    let channels = checked_channels(raster, &picture)?;
    let described = channels
        .iter()
        .map(|(name, samples)| ChannelDescription::named(name.clone(), samples.kind()))
        .collect();
    let size = (raster.width, raster.height);
    let header =
        Header { own_attributes: layer_attributes, ..Header::new(text(""), size, described) };
    let blocks = BlockDescription::ScanLines;
    let header = header.with_encoding(packing.into(), blocks, LineOrder::Increasing);

    // Blocks are packed in parallel and written in order.
    let blocks: Vec<Vec<u8>> = (0..raster.height.div_ceil(packing.lines()))
        .into_par_iter()
        .map(|number| packed_block(&channels, size, packing, number))
        .collect();
    let bytes: usize = blocks.iter().map(|block| block.len() + BLOCK_OVERHEAD).sum();
    let mut file = Cursor::new(Vec::with_capacity(bytes + RESERVED_FOR_HEADER));
    exr::block::write(&mut file, [header].into_iter().collect(), true, |_, writer| {
        for (number, compressed_pixels_le) in blocks.into_iter().enumerate() {
            let y_coordinate = (packing.lines() * number) as i32;
            let block = CompressedScanLineBlock { y_coordinate, compressed_pixels_le };
            let compressed_block = CompressedBlock::ScanLine(block);
            writer.write_chunk(number, Chunk { layer_index: 0, compressed_block })?;
        }
        Ok(())
    })?;
    Ok(with_sorted_header(file.into_inner()))
}

/// Values of a channel, row by row.
#[derive(Clone, Copy)]
enum Samples<'a> {
    Float(&'a [f32]),
    Half(&'a [f16]),
}

impl Samples<'_> {
    fn kind(self) -> SampleType {
        match self {
            Samples::Float(_) => SampleType::F32,
            Samples::Half(_) => SampleType::F16,
        }
    }

    fn len(self) -> usize {
        match self {
            Samples::Float(values) => values.len(),
            Samples::Half(values) => values.len(),
        }
    }

    /// Adds some of the values to the pixels of a block.
    fn write(self, part: Range<usize>, bytes: &mut Vec<u8>) {
        match self {
            Samples::Float(values) => {
                bytes.extend(values[part].iter().flat_map(|value| value.to_le_bytes()));
            }
            Samples::Half(values) => {
                bytes.extend(values[part].iter().flat_map(|value| value.to_le_bytes()));
            }
        }
    }
}

/// Red, green and blue of a picture in linear light, each as a channel.
fn linear_light(picture: &[[u8; 3]]) -> Vec<Vec<f16>> {
    let light: Vec<f16> = (0..=255).map(|part| f16::from_f32(light_of_srgb(part))).collect();
    let parts = (0..PICTURE.len()).map(|part| picture.iter().map(move |pixel| pixel[part]));
    parts.map(|parts| parts.map(|part| light[usize::from(part)]).collect()).collect()
}

/// The pixels of one block: for each of its lines the rows of all channels.
fn packed_block(
    channels: &[(Text, Samples)],
    (width, height): (usize, usize),
    packing: Packing,
    number: usize,
) -> Vec<u8> {
    let lines = packing.lines() * number..height.min(packing.lines() * (number + 1));
    let pixel: usize = channels.iter().map(|(_, samples)| samples.kind().bytes_per_sample()).sum();
    let mut bytes = Vec::with_capacity(lines.len() * width * pixel);
    for y in lines {
        channels
            .iter()
            .for_each(|(_, samples)| samples.write(y * width..(y + 1) * width, &mut bytes));
    }
    packing.pack(bytes)
}

/// A block of ZIP: bytes at even places, then those at odd places, all as differences from the one
/// before (OpenEXR, `ImfZip.cpp`), deflated. It stays as it is where that would make it longer.
fn zipped(bytes: Vec<u8>) -> Vec<u8> {
    let mut apart = vec![0; bytes.len()];
    // Samples have an even number of bytes.
    let (even, odd) = apart.split_at_mut(bytes.len() / 2);
    for ((even, odd), pair) in even.iter_mut().zip(odd).zip(bytes.as_chunks().0) {
        [*even, *odd] = *pair;
    }
    let steps = apart.iter().zip(apart.iter().skip(1));
    let steps = steps.map(|(before, byte)| byte.wrapping_sub(*before).wrapping_add(128));
    let differences: Vec<u8> = apart.first().copied().into_iter().chain(steps).collect();
    // A higher level takes six times as long and saves 4 % of a power image.
    let deflated = compress_to_vec_zlib(&differences, CompressionLevel::BestSpeed as u8);
    if deflated.len() < bytes.len() { deflated } else { bytes }
}

/// The raster in an OpenEXR file: its first layer, as written by [`write()`] or by any tool that
/// keeps the grid's three attributes. Channels come in alphabetical order, without those of a picture.
pub fn read(bytes: &[u8]) -> Result<Raster, FormatError> {
    check_size(bytes)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .pedantic()
        .from_buffered(Cursor::new(bytes))
        .map_err(malformed)?;
    let layer = image.layer_data;
    let number = |name| grid_number(name, [&layer.attributes.other, &image.attributes.other]);
    let (pixel_m, x_min_m, y_min_m) = (number("pixelSizeM")?, number("xMinM")?, number("yMinM")?);
    let data = layer.channel_data.list.iter().map(channel);
    let channels = data.filter(|channel| !PICTURE.contains(&channel.name.as_str())).collect();
    Ok(Raster { width: layer.size.0, height: layer.size.1, x_min_m, y_min_m, pixel_m, channels })
}

/// The channels of a raster and of its picture in the format's order, the alphabetical one.
fn checked_channels<'a>(
    raster: &'a Raster,
    picture: &'a [Vec<f16>],
) -> Result<Vec<(Text, Samples<'a>)>, ExrError> {
    let Raster { width, height, ref channels, .. } = *raster;
    let data = channels.iter().map(|one| (one.name.as_str(), Samples::Float(&one.values)));
    let shown = PICTURE.into_iter().zip(picture).map(|(name, part)| (name, Samples::Half(part)));
    let mut checked: Vec<(Text, Samples)> = Vec::new();
    for (name, samples) in data.chain(shown) {
        let values = samples.len();
        if width.checked_mul(height) != Some(values) {
            return Err(ExrError::Length { channel: name.to_owned(), values, width, height });
        }
        let exr_name = checked_name(name)?;
        if checked.iter().any(|earlier| earlier.0 == exr_name) {
            return Err(ExrError::Name { name: name.to_owned() });
        }
        checked.push((exr_name, samples));
    }
    checked.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(checked)
}

fn named_attributes(
    raster: &Raster,
    attributes: &[(String, Attribute)],
) -> Result<HashMap<Text, AttributeValue>, ExrError> {
    let grid =
        [("pixelSizeM", raster.pixel_m), ("xMinM", raster.x_min_m), ("yMinM", raster.y_min_m)];
    let grid = grid.map(|(name, value)| (name.to_owned(), AttributeValue::F64(value)));
    let units = raster.channels.iter().filter_map(|channel| {
        let unit = AttributeValue::Text(text(unit_of(&channel.name)?));
        Some((format!("{}.unit", channel.name), unit))
    });
    let own = attributes.iter().map(|(name, value)| {
        let value = match value {
            Attribute::Text(value) => AttributeValue::Text(text(value)),
            Attribute::Number(value) => AttributeValue::F64(*value),
        };
        (name.clone(), value)
    });
    let mut named = HashMap::new();
    for (name, value) in grid.into_iter().chain(units).chain(own) {
        if named.insert(checked_name(&name)?, value).is_some() {
            return Err(ExrError::Name { name });
        }
    }
    Ok(named)
}

fn unit_of(channel: &str) -> Option<&'static str> {
    UNITS.iter().find(|(ending, _)| channel.ends_with(ending)).map(|&(_, unit)| unit)
}

fn checked_name(name: &str) -> Result<Text, ExrError> {
    let printable = name.bytes().all(|byte| byte.is_ascii_graphic() || byte == b' ');
    if printable && (1..=255).contains(&name.len()) {
        return Ok(text(name));
    }
    Err(ExrError::Name { name: name.into() })
}

fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// The file with its attributes in alphabetical order; the encoder's own order changes from run
/// to run. No length changes, so every offset in the file stays true.
fn with_sorted_header(mut file: Vec<u8>) -> Vec<u8> {
    const MAGIC_AND_VERSION: usize = 8;
    let mut attributes = Vec::new();
    let mut start = MAGIC_AND_VERSION;
    while let Some(length) = attribute_length(&file[start..]) {
        attributes.push(file[start..start + length].to_vec());
        start += length;
    }
    attributes.sort();
    file.splice(MAGIC_AND_VERSION..start, attributes.concat());
    file
}

/// Bytes of the attribute at the start of a header: name, 0, type, 0, size, value.
fn attribute_length(header: &[u8]) -> Option<usize> {
    let name = header.iter().position(|&byte| byte == 0).filter(|&length| length > 0)?;
    let kind = header.get(name + 1..)?.iter().position(|&byte| byte == 0)?;
    let value = name + kind + 2;
    let size = u32::from_le_bytes(header.get(value..value + 4)?.try_into().ok()?) as usize;
    Some(value + 4 + size).filter(|&length| length <= header.len())
}

/// Refuses a file whose header claims more pixels than its bytes could hold.
fn check_size(bytes: &[u8]) -> Result<(), FormatError> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), true).map_err(malformed)?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.0, header.layer_size.1);
        let pixel_bytes = header.channels.bytes_per_pixel;
        let claimed = width.checked_mul(height).and_then(|n| n.checked_mul(pixel_bytes.max(1)));
        if claimed.is_none_or(|claimed| claimed > bytes.len().saturating_mul(MAX_UNFOLDING)) {
            return Err(FormatError::at(
                "header",
                format!("{width} × {height} pixels cannot be in {} bytes", bytes.len()),
                "get the whole file again",
            ));
        }
    }
    Ok(())
}

fn malformed(error: Error) -> FormatError {
    FormatError::at("OpenEXR", error.to_string(), "export it again as one flat layer")
}

fn grid_number(
    name: &str,
    places: [&HashMap<Text, AttributeValue>; 2],
) -> Result<f64, FormatError> {
    match places.iter().find_map(|attributes| attributes.get(&text(name))) {
        Some(&AttributeValue::F64(value)) => Ok(value),
        Some(&AttributeValue::F32(value)) => Ok(value.into()),
        _ => Err(FormatError::at(
            format!("attribute {name}"),
            "it is missing or not a number",
            "add it as a double, in metres",
        )),
    }
}

fn channel(channel: &AnyChannel<FlatSamples>) -> Channel {
    let values = match &channel.sample_data {
        FlatSamples::F32(values) => values.clone(),
        FlatSamples::F16(values) => values.iter().map(|value| value.to_f32()).collect(),
        FlatSamples::U32(values) => values.iter().map(|&value| value as f32).collect(),
    };
    Channel { name: channel.name.to_string(), values }
}

#[cfg(test)]
mod tests {
    use exr::math::Vec2;

    use super::*;

    fn raster(width: usize, height: usize) -> Raster {
        let value = |i: usize| if i % 7 == 3 { f32::NAN } else { (i as f32).sin() * 1e-9 - 40.0 };
        let channel = |name: &str| Channel {
            name: name.into(),
            values: (0..width * height).map(value).collect(),
        };
        let channels = vec![channel("incidence_deg"), channel("power_dbm"), channel("range_m")];
        Raster { width, height, x_min_m: -0.25, y_min_m: -0.45, pixel_m: 0.004, channels }
    }

    fn notes() -> Vec<(String, Attribute)> {
        vec![
            ("scene".into(), Attribute::Text("plate at θ = 20°".into())),
            ("seed".into(), Attribute::Number(7.0)),
        ]
    }

    fn bits(raster: &Raster) -> Vec<Vec<u32>> {
        let channel_bits = |c: &Channel| c.values.iter().map(|v| v.to_bits()).collect();
        raster.channels.iter().map(channel_bits).collect()
    }

    #[test]
    fn a_raster_returns_bit_by_bit() {
        for (width, height) in [(125, 225), (1, 1), (33, 17)] {
            for packing in [Packing::Zip16, Packing::Uncompressed] {
                let written = raster(width, height);
                let picture = vec![[0, 127, 255]; width * height];
                for picture in [None, Some(picture.as_slice())] {
                    let bytes = write_packed(&written, &notes(), picture, packing).unwrap();
                    let read = read(&bytes).unwrap();
                    assert_eq!(bits(&read), bits(&written));
                    let without_values = |mut raster: Raster| {
                        raster.channels.iter_mut().for_each(|c| c.values.clear());
                        raster
                    };
                    assert_eq!(without_values(read), without_values(written.clone()));
                }
            }
        }
    }

    #[test]
    fn a_picture_is_what_viewers_show() {
        let data = raster(5, 40);
        let picture: Vec<[u8; 3]> = (0..200).map(|pixel| [0, pixel, 255]).collect();
        let bytes = write_packed(&data, &[], Some(&picture), Packing::Zip16).unwrap();
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size, _| vec![[0.0; 3]; size.area()],
                |pixels: &mut Vec<[f32; 3]>, at, (red, green, blue): (f32, f32, f32)| {
                    pixels[at.flat_index_for_size(Vec2(5, 40))] = [red, green, blue];
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .unwrap();
        let shown = read.layer_data.channel_data.pixels;
        assert_eq!(shown.len(), picture.len());
        for (number, [red, green, blue]) in shown.iter().enumerate() {
            let srgb = |light: f32| {
                let part = if light <= 0.003_130_8 {
                    12.92 * light
                } else {
                    1.055 * light.powf(1.0 / 2.4) - 0.055
                };
                (255.0 * part).round() as u8
            };
            assert_eq!([*red, *green, *blue].map(srgb), picture[number]);
        }
        let short = write_packed(&data, &[], Some(&picture[1..]), Packing::Zip16).unwrap_err();
        assert!(matches!(short, ExrError::Length { values: 199, .. }), "{short}");
    }

    #[test]
    fn the_same_raster_gives_the_same_bytes() {
        let bytes = || write(&raster(300, 500), &notes()).unwrap();
        let first = bytes();
        assert!((0..8).all(|_| bytes() == first));
    }

    #[test]
    fn channels_are_written_in_alphabetical_order() {
        let mut written = raster(4, 3);
        written.channels.reverse();
        let names = |r: &Raster| r.channels.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
        let read = read(&write(&written, &[]).unwrap()).unwrap();
        assert_eq!(names(&read), ["incidence_deg", "power_dbm", "range_m"]);
    }

    #[test]
    fn names_that_clash_or_cannot_be_written_are_refused() {
        let refused = |name: &str| {
            let note = (name.to_owned(), Attribute::Number(1.0));
            write(&raster(2, 2), &[note]).is_err()
        };
        for name in ["pixelSizeM", "power_dbm.unit", "channels", "software", "", "θ", "a\0b"] {
            assert!(refused(name), "{name:?}");
        }
        let mut twice = raster(2, 2);
        twice.channels[0].name = "range_m".into();
        assert!(matches!(write(&twice, &[]), Err(ExrError::Name { .. })));
    }

    #[test]
    fn rasters_that_contradict_themselves_are_refused() {
        let mut short = raster(3, 2);
        short.channels[1].values.pop();
        assert!(matches!(write(&short, &[]), Err(ExrError::Length { values: 5, .. })));
        assert!(write(&Raster { channels: Vec::new(), ..raster(3, 2) }, &[]).is_err());
        assert!(write(&raster(0, 0), &[]).is_err());
    }

    #[test]
    fn a_uniform_raster_is_not_taken_for_a_lie() {
        let mut uniform = raster(600, 600);
        uniform.channels.iter_mut().for_each(|c| c.values.fill(f32::NAN));
        assert!(read(&write(&uniform, &[]).unwrap()).is_ok());
    }

    #[test]
    fn cut_or_altered_files_give_errors_or_rasters() {
        let bytes = write(&raster(20, 40), &notes()).unwrap();
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err(), "cut at {length}");
        }
        for place in 0..bytes.len() {
            for value in [0, 1, 0x7f, 0xff] {
                let mut altered = bytes.clone();
                altered[place] = value;
                let _ = read(&altered);
            }
        }
    }

    #[test]
    fn huge_claims_are_refused_before_memory_is_taken() {
        let mut bytes = write(&raster(20, 40), &[]).unwrap();
        let window = bytes.windows(10).position(|w| w == b"dataWindow").unwrap();
        let x_max = window + b"dataWindow\0box2i\0".len() + 4 + 8;
        bytes[x_max..x_max + 4].copy_from_slice(&0x0fff_ffff_u32.to_le_bytes());
        let error = read(&bytes).unwrap_err().to_string();
        assert!(error.contains("268435456 × 40"), "{error}");
    }
}
