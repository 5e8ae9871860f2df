//! LAS, the format of the ASPRS for laser scans, and LAZ, which is LAS compressed: by the `las` crate.
//!
//! Extra bytes are columns, too, where the file describes them (LAS 1.4 R15, tables 24 and 25): a radar's powers and
//! ranges fit nowhere else. Extended records behind the points are not read, since none of them is needed.

use std::io::Cursor;

use las::{Header, PointData, Reader};

use super::numbers::Numbers;
use crate::formats::FormatError;
use crate::formats::guard::guarded;

/// Points that are read at once, so that a damaged header cannot ask for much memory.
const CHUNK: u64 = 1000;

/// Reads a whole file.
pub(super) fn read(bytes: &[u8]) -> Result<Numbers, FormatError> {
    if has_more_chunks_than_bytes(bytes) {
        return Err(damaged("it claims more blocks than it has bytes"));
    }
    guarded(|| read_all(bytes)).unwrap_or_else(|| Err(damaged("the bytes are damaged")))
}

fn read_all(bytes: &[u8]) -> Result<Numbers, FormatError> {
    let mut reader = Reader::new(Cursor::new(without_extended_records(bytes))).map_err(damaged)?;
    let header = reader.header().clone();
    let format = *header.point_format();
    let extra = extra_columns(&header, usize::from(format.extra_bytes));
    let mut names = ["x", "y", "z", "intensity"].map(str::to_owned).to_vec();
    names.extend(format.has_gps_time.then(|| "gps_time".to_owned()));
    names.extend(extra.iter().map(|column| column.name.clone()));
    let mut columns = vec![Vec::new(); names.len()];
    let mut left = header.number_of_points();
    let mut points = reader.read_points(0).map_err(damaged)?;
    while left > 0 {
        let read = reader.fill_points(left.min(CHUNK), &mut points).map_err(damaged)?;
        if read == 0 {
            break;
        }
        append(&mut columns, &points, &extra);
        left -= read;
    }
    Ok(Numbers { names, columns })
}

fn append(columns: &mut [Vec<f64>], points: &PointData, extra: &[Extra]) {
    let mut read = vec![points.x().collect(), points.y().collect(), points.z().collect()];
    read.push(points.intensity().map(f64::from).collect::<Vec<f64>>());
    read.extend(points.gps_time().map(Iterator::collect));
    let record = points.record_len().max(1);
    for column in extra {
        let records = points.raw_bytes().chunks_exact(record);
        read.push(records.map(|record| column.value(record)).collect());
    }
    std::iter::zip(columns, read).for_each(|(column, read)| column.extend(read));
}

/// Whether a compressed file claims more chunks than it has bytes: the crate would reserve room for each.
fn has_more_chunks_than_bytes(bytes: &[u8]) -> bool {
    /// Where the header has the kind of points, whose upper bits mark compressed ones, and where the points begin.
    const KIND: usize = 104;
    const POINTS: usize = 96;
    let is_compressed = bytes.get(KIND).is_some_and(|kind| *kind >= 64);
    let chunks = u32_at(bytes, POINTS).and_then(|points| {
        let stated = i64_at(bytes, points as usize)?;
        // A writer that could not go back has put it at the end.
        let table =
            if stated <= i64::from(points) { i64_at(bytes, bytes.len() - 8)? } else { stated };
        u32_at(bytes, usize::try_from(table).ok()?.checked_add(4)?)
    });
    is_compressed && chunks.is_some_and(|chunks| chunks as usize > bytes.len())
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

fn i64_at(bytes: &[u8], at: usize) -> Option<i64> {
    Some(i64::from_le_bytes(bytes.get(at..at.checked_add(8)?)?.try_into().ok()?))
}

/// A copy of the file that says that it has no extended records.
fn without_extended_records(bytes: &[u8]) -> Vec<u8> {
    /// Where the header of version 1.4 says where they begin and how many they are.
    const EXTENDED: std::ops::Range<usize> = 235..247;
    let mut copy = bytes.to_vec();
    let is_new = matches!(bytes.get(24..26), Some([1, minor]) if *minor >= 4);
    if let Some(stated) = copy.get_mut(EXTENDED).filter(|_| is_new) {
        stated.fill(0);
    }
    copy
}

/// A described number in the extra bytes.
struct Extra {
    name: String,
    /// From the end of the record, byte.
    from_end: usize,
    kind: u8,
    scale: f64,
    offset: f64,
}

/// Bytes of the kinds of numbers, by their code: u8, i8, u16, i16, u32, i32, u64, i64, f32, f64.
const SIZES: [usize; 11] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8];

impl Extra {
    fn value(&self, record: &[u8]) -> f64 {
        let size = SIZES[usize::from(self.kind)];
        let start = record.len().checked_sub(self.from_end);
        let Some(stored) = start.and_then(|start| record.get(start..start + size)) else {
            return f64::NAN;
        };
        let mut first = [0; 8];
        first[..size].copy_from_slice(stored);
        let whole = u64::from_le_bytes(first);
        let number = match self.kind {
            2 => f64::from(whole as u8 as i8),
            4 => f64::from(whole as u16 as i16),
            6 => f64::from(whole as u32 as i32),
            8 => whole as i64 as f64,
            9 => f64::from(f32::from_bits(whole as u32)),
            10 => f64::from_bits(whole),
            _ => whole as f64,
        };
        number * self.scale + self.offset
    }
}

/// The numbers that the file describes in its extra bytes; those behind one of an unknown kind are left out.
fn extra_columns(header: &Header, mut left: usize) -> Vec<Extra> {
    const DESCRIPTION_BYTES: usize = 192;
    let described = header.vlrs().iter().find(|v| v.user_id == "LASF_Spec" && v.record_id == 4);
    let mut columns = Vec::new();
    for entry in described.map_or(&[][..], |v| &v.data).chunks_exact(DESCRIPTION_BYTES) {
        let (kind, options) = (entry[2], entry[3]);
        let kind_of_each = if kind == 0 { 0 } else { (kind - 1) % 10 + 1 };
        let size_of_each = SIZES[usize::from(kind_of_each)];
        let (size, taken) = match kind {
            // Bytes without a meaning, as many as the options say.
            0 => (0, usize::from(options)),
            1..=10 => (size_of_each, size_of_each),
            // Two or three values, which no column of ours has: deprecated, and still written.
            11..=20 => (0, 2 * size_of_each),
            21..=30 => (0, 3 * size_of_each),
            _ => (0, 0),
        };
        if taken == 0 || taken > left {
            break;
        }
        if size > 0 {
            let name = String::from_utf8_lossy(&entry[4..36]);
            columns.push(Extra {
                name: name.trim_end_matches('\0').trim().to_owned(),
                from_end: left,
                kind,
                scale: if options & 8 == 0 { 1.0 } else { number_at(entry, 112) },
                offset: if options & 16 == 0 { 0.0 } else { number_at(entry, 136) },
            });
        }
        left -= taken;
    }
    columns
}

fn number_at(entry: &[u8], at: usize) -> f64 {
    entry[at..at + 8].try_into().map_or(f64::NAN, f64::from_le_bytes)
}

fn damaged(problem: impl ToString) -> FormatError {
    FormatError::at("the file", problem.to_string(), "copy it anew, or export it as CSV")
}

#[cfg(test)]
mod tests {
    use super::*;
    use las::{Builder, Point, Vlr, Writer, point::Format};

    /// Two points with a power in dBm as an f32 and a chirp as a u16 in the extra bytes.
    fn file(is_compressed: bool) -> Vec<u8> {
        let mut builder = Builder::from((1, 4));
        builder.point_format = Format { extra_bytes: 6, is_compressed, ..Format::new(1).unwrap() };
        let description = |name: &str, kind: u8, options: u8| {
            let mut entry = vec![0; 192];
            (entry[2], entry[3]) = (kind, options);
            entry[4..4 + name.len()].copy_from_slice(name.as_bytes());
            entry[112..120].copy_from_slice(&2.0_f64.to_le_bytes());
            entry[136..144].copy_from_slice(&1.0_f64.to_le_bytes());
            entry
        };
        builder.vlrs.push(Vlr {
            user_id: "LASF_Spec".to_owned(),
            record_id: 4,
            description: String::new(),
            data: [description("power_dbm", 9, 0), description("chirp", 3, 8 | 16)].concat(),
        });
        let mut writer =
            Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
        for (x, level_dbm, chirp) in [(0.5, -60.5_f32, 7_u16), (0.25, -61.25, 8)] {
            let extra_bytes = [&level_dbm.to_le_bytes()[..], &chirp.to_le_bytes()].concat();
            let point = Point {
                x,
                y: 1.0,
                z: -2.0,
                intensity: 9,
                gps_time: Some(3.0),
                extra_bytes,
                ..Point::default()
            };
            writer.write_point(point).unwrap();
        }
        writer.into_inner().unwrap().into_inner()
    }

    fn read_whole(bytes: &[u8]) -> Result<Numbers, String> {
        read(bytes).map_err(|error| error.to_string())
    }

    #[test]
    fn points_and_their_extra_bytes_are_read() {
        for is_compressed in [false, true] {
            let Numbers { names, columns } = read_whole(&file(is_compressed)).unwrap();
            assert_eq!(names, ["x", "y", "z", "intensity", "gps_time", "power_dbm", "chirp"]);
            let expected = [
                [0.5, 0.25],
                [1.0, 1.0],
                [-2.0, -2.0],
                [9.0, 9.0],
                [3.0, 3.0],
                [-60.5, -61.25],
                [15.0, 17.0],
            ];
            for (column, expected) in std::iter::zip(columns, expected) {
                // Places are multiples of a millimetre.
                assert!(std::iter::zip(column, expected).all(|(a, b)| (a - b).abs() < 1e-9));
            }
        }
    }

    #[test]
    fn damage_gives_a_sentence() {
        let whole = file(false);
        assert!(read_whole(b"LASF").unwrap_err().starts_with("the file: "));
        assert!(read_whole(b"ply\n").is_err());
        for length in (0..whole.len()).step_by(13) {
            assert!(read_whole(&whole[..length]).is_err(), "{length} bytes");
        }
        let mut hostile = whole;
        hostile[235..247].fill(0xff);
        assert!(read_whole(&hostile).is_ok(), "extended records are not read");
        // A thousand million points that are not there.
        hostile[247..255].copy_from_slice(&1_000_000_000_u64.to_le_bytes());
        hostile[107..111].copy_from_slice(&1_000_000_000_u32.to_le_bytes());
        assert!(read_whole(&hostile).is_err());
    }

    #[test]
    fn any_change_of_a_byte_gives_points_or_a_sentence() {
        for is_compressed in [false, true] {
            let whole = file(is_compressed);
            for at in 0..whole.len() {
                for change in [0x01, 0x80, 0xff] {
                    let mut changed = whole.clone();
                    changed[at] ^= change;
                    let _ = read(&changed);
                }
            }
        }
    }
}
