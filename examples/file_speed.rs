//! Milliseconds that files take, one JSON line for every line on stdin: the half that
//! `benches/rivals/formats.py` starts.
//!
//!     cargo run --release --example file_speed -- ply FILE
//!     cargo run --release --example file_speed -- exr FLOATS FILE [uncompressed]
//!
//! `ply` reads a mesh, which validates it. `exr` writes a square raster; its channels come one after the other,
//! row after row, as 32-bit floats, little-endian.

#[path = "support/turns.rs"]
mod turns;

use std::hint::black_box;

use matdb::formats::MeshFormat;
use matdb::formats::exr::{self, Packing};
use matdb::geometry::raster::{Channel, Raster};
use serde_json::json;
use turns::{Answer, join_pool, serve, timed};

const SIDE: usize = 1024;

fn main() -> Answer<()> {
    join_pool()?;
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ply", file] => serve(|| {
            let read = || -> Answer<_> { Ok(MeshFormat::Ply.read(&std::fs::read(file)?)?) };
            let (ms, mesh) = timed(read);
            Ok(json!({ "ms": ms, "facets": black_box(mesh?).facets.len() }))
        }),
        ["exr", floats, file, ref how @ ..] if matches!(how, [] | ["uncompressed"]) => {
            let raster = raster(&std::fs::read(floats)?);
            let packing =
                if how == ["uncompressed"] { Packing::Uncompressed } else { Packing::Zip16 };
            serve(|| {
                let (ms, written) = timed(|| -> Answer<_> {
                    let bytes = exr::write_packed(&raster, &[], None, packing)?;
                    std::fs::write(file, &bytes)?;
                    Ok(bytes.len())
                });
                Ok(json!({ "ms": ms, "bytes": written? }))
            })
        }
        _ => Err("the head of this example tells the arguments".into()),
    }
}

fn raster(bytes: &[u8]) -> Raster {
    let (values, _) = bytes.as_chunks::<4>();
    let values: Vec<f32> = values.iter().map(|value| f32::from_le_bytes(*value)).collect();
    let channel = |(number, values): (usize, &[f32])| Channel {
        name: format!("channel{number}"),
        values: values.to_vec(),
    };
    let channels = values.chunks(SIDE * SIDE).enumerate().map(channel).collect();
    Raster { width: SIDE, height: SIDE, x_min_m: 0.0, y_min_m: 0.0, pixel_m: 1e-3, channels }
}
