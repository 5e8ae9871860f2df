//! Chirps from a CSV: rays in the global frame, or mirror angles.

use glam::DVec3;

use super::chirps::Chirps;
use crate::formats::FormatError;
use crate::formats::csv::Table;
use crate::frames::{Direction, Global, Ray};
use crate::radar::error::RadarError;
use crate::radar::mirror::MirrorAngles;

/// A direction this near to unit length was meant to be one.
const UNIT_LENGTH: f64 = 1e-6;

/// What `matdb radar` writes of each chirp beside its number.
const WRITTEN: [&str; 11] =
    ["time_s", "gamma_rad", "phi_rad", "xt_m", "yt_m", "ox_m", "oy_m", "oz_m", "dx", "dy", "dz"];

/// Reads `chirp,ox_m,oy_m,oz_m,dx,dy,dz` and, where it is there, `time_s`; the mirror's angles stay empty. Other columns of
/// [`WRITTEN`] are passed over.
pub(super) fn rays(file: &str, bytes: &[u8]) -> Result<Chirps, RadarError> {
    let columns = ["chirp", "ox_m", "oy_m", "oz_m", "dx", "dy", "dz"];
    let mut stretched = 0;
    let mut chirps = read(file, bytes, &columns, |table, row, chirps| {
        let origin = vector(table, row, ["ox_m", "oy_m", "oz_m"])?;
        let along = vector(table, row, ["dx", "dy", "dz"])?;
        let direction: Direction<Global> = Direction::new(along).ok_or_else(|| {
            FormatError::at(table.place(row), "the direction has no length", "give a unit vector")
        })?;
        stretched += usize::from((along.length() - 1.0).abs() > UNIT_LENGTH);
        chirps.rays.push(Ray { origin: origin.into(), direction });
        Ok(())
    })?;
    if stretched > 0 {
        chirps.notices.push(format!(
            "{file}: {stretched} directions were not of unit length and were normalised"
        ));
    }
    Ok(chirps)
}

/// Three numbers of a row.
fn vector(table: &Table, row: usize, names: [&str; 3]) -> Result<DVec3, FormatError> {
    let [x, y, z] = names.map(|name| table.required_number(row, name));
    Ok(DVec3::new(x?, y?, z?))
}

/// Reads `chirp,gamma_rad,phi_rad` and, where it is there, `time_s`; the rays are left for the caller to draw.
pub(super) fn angles(file: &str, bytes: &[u8]) -> Result<Chirps, RadarError> {
    let columns = ["chirp", "gamma_rad", "phi_rad"];
    read(file, bytes, &columns, |table, row, chirps| {
        let gamma_rad = table.required_number(row, "gamma_rad")?;
        let phi_rad = table.required_number(row, "phi_rad")?;
        if gamma_rad.abs() > 0.5 {
            let problem = format!("a tilt of {gamma_rad} rad is beyond any mirror's");
            return Err(FormatError::at(table.place(row), problem, "give γ in rad, within ±0.5"));
        }
        chirps.mirror.push(MirrorAngles { gamma_rad, phi_rad });
        Ok(())
    })
}

/// Reads numbers and times, and what `rest` adds for every row.
fn read(
    file: &str,
    bytes: &[u8],
    columns: &[&str],
    mut rest: impl FnMut(&Table, usize, &mut Chirps) -> Result<(), FormatError>,
) -> Result<Chirps, RadarError> {
    let at = |error| RadarError::Explicit { file: file.to_owned(), error };
    let others: Vec<&str> = WRITTEN.into_iter().filter(|name| !columns.contains(name)).collect();
    let table = Table::read(bytes, columns, &others).map_err(at)?;
    let mut chirps = Chirps::default();
    let has_times = table.has("time_s");
    for row in 0..table.len() {
        let number = table.whole_number(row, "chirp").map_err(at)?;
        if i32::try_from(number).is_err() {
            let problem = format!("chirp {number} does not fit the cloud's 32-bit numbers");
            let way_out = "number chirps below 2 147 483 648";
            return Err(at(FormatError::at(table.place(row), problem, way_out)));
        }
        chirps.number.push(number);
        let time_s =
            if has_times { table.required_number(row, "time_s").map_err(at)? } else { 0.0 };
        chirps.time_s.push(time_s);
        rest(&table, row, &mut chirps).map_err(at)?;
    }
    if table.is_empty() {
        return Err(at(FormatError::at("line 2", "there is no chirp", "give a line for each")));
    }
    let mut seen = std::collections::HashSet::new();
    match chirps.number.iter().position(|number| !seen.insert(*number)) {
        None => Ok(chirps),
        Some(row) => {
            let problem = format!("chirp {} is there twice", chirps.number[row]);
            Err(at(FormatError::at(table.place(row), problem, "number every chirp once")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RAYS: &str =
        "chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n7,0.5,0,1,8,0,0,-1\n9,0.6,0,1,8,0,0,-2\n";

    fn refused(text: &str) -> String {
        rays("rays.csv", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn rays_are_read_and_directions_normalised_with_a_notice() {
        let chirps = rays("rays.csv", RAYS.as_bytes()).unwrap();
        assert_eq!((chirps.number, chirps.time_s), (vec![7, 9], vec![0.5, 0.6]));
        assert_eq!(chirps.rays[1].direction.xyz(), -DVec3::Z);
        assert!(chirps.notices[0].contains("1 directions"));
    }

    #[test]
    fn angles_are_read() {
        let text = "chirp,time_s,gamma_rad,phi_rad\n0,0,0.01,3\n";
        let chirps = angles("angles.csv", text.as_bytes()).unwrap();
        assert_eq!(chirps.mirror, [MirrorAngles { gamma_rad: 0.01, phi_rad: 3.0 }]);
    }

    #[test]
    fn what_the_program_writes_is_read_as_rays_and_as_angles() {
        let text = "chirp,time_s,gamma_rad,phi_rad,xt_m,yt_m,ox_m,oy_m,oz_m,dx,dy,dz\n\
                    0,0,0.01,3,0.1,0.2,0,1.1,8,0,0,-1\n";
        assert_eq!(rays("scan.csv", text.as_bytes()).unwrap().rays[0].direction.xyz(), -DVec3::Z);
        let found = angles("scan.csv", text.as_bytes()).unwrap().mirror;
        assert_eq!(found, [MirrorAngles { gamma_rad: 0.01, phi_rad: 3.0 }]);
    }

    #[test]
    fn a_scan_without_times_has_none() {
        let timed = rays("rays.csv", RAYS.as_bytes()).unwrap();
        assert!(timed.is_timed() && timed.progress() == [0.0, 1.0]);
        let untimed = RAYS.replace("time_s,", "").replace("0.5,", "").replace("0.6,", "");
        let chirps = rays("rays.csv", untimed.as_bytes()).unwrap();
        assert!(!chirps.is_timed() && chirps.time_s == [0.0, 0.0]);
        assert!(refused(&RAYS.replace("0.6,", ",")).contains("line 3, column time_s"));
    }

    #[test]
    fn what_makes_no_ray_is_refused_with_its_line() {
        assert!(
            refused(&RAYS.replace("0,0,-1\n", "0,0,0\n"))
                .contains("rays.csv: line 2: the direction")
        );
        assert!(refused(&RAYS.replace("0,0,-1\n", "0,0,nan\n")).contains("line 2, column dz"));
        assert!(refused(&RAYS.replace("9,", "7,")).contains("line 3: chirp 7 is there twice"));
        assert!(refused(&RAYS.replace("9,", "9.5,")).contains("line 3, column chirp"));
        assert!(refused("chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n").contains("there is no chirp"));
        assert!(refused(&RAYS.replace("dz", "dw")).contains("no column `dz`"));
    }
}
