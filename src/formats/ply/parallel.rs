//! The layouts that most binary files have, read in parallel: little-endian, vertices of numbers
//! with x, y and z in single precision, and faces that are a count of 8 bits and three integers of
//! 32 bits.
//!
//! [`Body`] reads every other layout, and finds the place of every fault.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::body::Body;
use super::header::{Element, Scalar, Shape};

/// Rows that one thread takes at a time.
const ROWS: usize = 1 << 13;

/// The vertices, if x, y and z, the properties at the places `xyz`, are floats in rows of one length.
pub(super) fn vertices(body: &mut Body, element: &Element, xyz: [usize; 3]) -> Option<Vec<DVec3>> {
    let mut row_bytes = 0;
    let mut starts = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let Shape::Scalar(scalar) = property.shape else { return None };
        starts.push((row_bytes, scalar));
        row_bytes += scalar.size_bytes();
    }
    let [x, y, z] = xyz.map(|at| match starts.get(at) {
        Some(&(start, Scalar::Float)) => Some(start),
        _ => None,
    });
    let (x, y, z) = (x?, y?, z?);
    let rows = body.rows(element, row_bytes)?;
    let vertices = rows
        .par_chunks_exact(row_bytes)
        .with_min_len(ROWS)
        .map(|row| DVec3::new(float_at(row, x), float_at(row, y), float_at(row, z)))
        .collect();
    body.advance(rows.len());
    Some(vertices)
}

/// The number in single precision that starts at a byte of a row.
#[inline(always)]
fn float_at(row: &[u8], start: usize) -> f64 {
    let bytes = row.get(start..).and_then(|rest| rest.first_chunk());
    f64::from(f32::from_le_bytes(bytes.copied().unwrap_or_default()))
}

/// The faces, if all are triangles of `vertices` without further properties.
pub(super) fn triangles(
    body: &mut Body,
    element: &Element,
    vertices: usize,
) -> Option<Vec<[u32; 3]>> {
    const ROW_BYTES: usize = 13;
    let [only] = element.properties.as_slice() else { return None };
    // A negative index is none.
    let end = match only.shape {
        Shape::List { count: Scalar::UChar, item: Scalar::Int } => vertices.min(1 << 31),
        Shape::List { count: Scalar::UChar, item: Scalar::UInt } => vertices,
        _ => return None,
    };
    let rows = body.rows(element, ROW_BYTES)?;
    let (rows, _) = rows.as_chunks::<ROW_BYTES>();
    let fits = AtomicBool::new(true);
    let facets = rows
        .par_iter()
        .with_min_len(ROWS)
        .map(|&[count, a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3]| {
            let corners =
                [[a0, a1, a2, a3], [b0, b1, b2, b3], [c0, c1, c2, c3]].map(u32::from_le_bytes);
            if count != 3 || corners.iter().any(|&corner| corner as usize >= end) {
                fits.store(false, Ordering::Relaxed);
            }
            corners
        })
        .collect();
    fits.into_inner().then(|| {
        body.advance(ROW_BYTES * rows.len());
        facets
    })
}
