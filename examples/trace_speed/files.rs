//! Meshes, rays and hits as all the tracers of `benches/rivals/` read and write them, little-endian.
//!
//! A mesh is the numbers of its vertices and facets in 64 bits, the vertices as 64-bit floats and the facets
//! as 32-bit integers. Rays are their number and the origin and direction of each. Hits are the facets of all
//! rays, `u32::MAX` for none, and then their ranges.

use std::fs::File;
use std::io::{BufReader, BufWriter, Error, Read, Result, Write};
use std::path::Path;

use glam::DVec3;
use matdb::frames::{Direction, Global, Ray};
use matdb::geometry::Mesh;
use matdb::trace::Hit;

pub fn write_mesh(path: &Path, mesh: &Mesh) -> Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    for number in [mesh.vertices.len(), mesh.facets.len()] {
        file.write_all(&(number as u64).to_le_bytes())?;
    }
    mesh.vertices.iter().try_for_each(|vertex| write_vector(&mut file, *vertex))?;
    for corner in mesh.facets.iter().flatten() {
        file.write_all(&corner.to_le_bytes())?;
    }
    file.flush()
}

pub fn write_rays(path: &Path, rays: &[Ray<Global>]) -> Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(&(rays.len() as u64).to_le_bytes())?;
    for ray in rays {
        write_vector(&mut file, ray.origin.xyz)?;
        write_vector(&mut file, ray.direction.xyz())?;
    }
    file.flush()
}

pub fn write_hits(path: &Path, hits: &[Option<Hit>]) -> Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    for hit in hits {
        file.write_all(&hit.map_or(u32::MAX, |hit| hit.facet).to_le_bytes())?;
    }
    for hit in hits {
        file.write_all(&hit.map_or(f64::INFINITY, |hit| hit.range_m).to_le_bytes())?;
    }
    file.flush()
}

pub fn read_mesh(path: &Path) -> Result<Mesh> {
    let mut file = BufReader::new(File::open(path)?);
    let (vertices, facets) = (read_count(&mut file)?, read_count(&mut file)?);
    let mesh = Mesh {
        vertices: (0..vertices).map(|_| read_vector(&mut file)).collect::<Result<_>>()?,
        facets: (0..facets).map(|_| read_facet(&mut file)).collect::<Result<_>>()?,
        labels: Vec::new(),
    };
    mesh.validate().map_err(Error::other)?;
    Ok(mesh)
}

pub fn read_rays(path: &Path) -> Result<Vec<Ray<Global>>> {
    let mut file = BufReader::new(File::open(path)?);
    let ray = |file: &mut BufReader<File>| {
        let (origin, along) = (read_vector(file)?, read_vector(file)?);
        let direction = Direction::new(along).ok_or(Error::other("a ray without direction"))?;
        Ok(Ray { origin: origin.into(), direction })
    };
    (0..read_count(&mut file)?).map(|_| ray(&mut file)).collect()
}

fn write_vector(file: &mut impl Write, vector: DVec3) -> Result<()> {
    vector.to_array().iter().try_for_each(|part| file.write_all(&part.to_le_bytes()))
}

fn read_vector(file: &mut impl Read) -> Result<DVec3> {
    let parts: [f64; 3] = [read(file)?, read(file)?, read(file)?].map(f64::from_le_bytes);
    Ok(parts.into())
}

fn read_facet(file: &mut impl Read) -> Result<[u32; 3]> {
    Ok([read(file)?, read(file)?, read(file)?].map(u32::from_le_bytes))
}

fn read_count(file: &mut impl Read) -> Result<usize> {
    Ok(u64::from_le_bytes(read(file)?) as usize)
}

fn read<const BYTES: usize>(file: &mut impl Read) -> Result<[u8; BYTES]> {
    let mut bytes = [0; BYTES];
    file.read_exact(&mut bytes).map(|()| bytes)
}
