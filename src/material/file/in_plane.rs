//! Scattering measured in the plane of incidence: f over the angles of source and receiver.
//!
//! As CSV: `theta_i_deg,theta_s_deg,brdf_per_sr`, and `sd_db` where it is known. θ_s is positive on the
//! side of the mirror direction, so that θ_s = θ_i is the mirror and θ_s = −θ_i the way back. A pair of
//! angles may occur several times, as repeated measurements. Values that the instrument could
//! not measure, such as those behind its own detector, are left out; one that is not above its blank, `blank_per_sr`, is a
//! limit.
//!
//! Also read are the isotropic tables of optical design programs (`.bsdf`), whose angles are counted from
//! the mirror direction: azimuth 0 leads towards the normal and past it, 180° away from it.

use crate::formats::FormatError;
use crate::formats::csv::Table;
use crate::formats::words::counted;
use crate::material::{Aspect, Observation};

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InPlane {
    /// Angle of incidence θ_i, rad, from 0 to below π/2.
    pub theta_i_rad: f64,
    /// Angle of the receiver θ_s, rad, within ±π/2, positive on the mirror's side.
    pub theta_s_rad: f64,
    /// f, 1/sr, above 0.
    pub f_per_sr: f64,
}

/// Grazing directions say nothing of a surface, degrees.
const GRAZING_DEG: f64 = 89.9;

/// Values that are no slip, 1/sr.
pub(super) const VALUES_PER_SR: (f64, f64) = (1e-30, 1e30);

impl InPlane {
    /// The value as a point of a curve.
    pub fn observation(&self) -> Observation {
        let aspect = Aspect::in_plane(self.theta_i_rad, self.theta_s_rad);
        let sigma0 = self.f_per_sr * aspect.sigma0_per_f();
        Observation {
            theta_r_rad: aspect.theta_r_rad,
            delta_phi_rad: aspect.delta_phi_rad,
            ..Observation::backscatter(self.theta_i_rad, Some(sigma0), None)
        }
    }
}

/// Whether the bytes are a `.bsdf` table, by the words that its header has.
pub fn is_bsdf(bytes: &[u8]) -> bool {
    let words = ["AngleOfIncidence", "ScatterRadial", "ScatterAzimuth", "DataBegin"];
    let lines = bytes.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let mut first_words = lines.filter_map(|line| line.split(u8::is_ascii_whitespace).next());
    first_words.any(|first| words.iter().any(|word| word.as_bytes() == first))
}

/// A row of a table; a value that is not above zero is that of its blank.
pub(super) fn read_row(table: &Table, row: usize) -> Result<InPlane, FormatError> {
    let theta_i_deg = table.required_within(row, "theta_i_deg", (0.0, GRAZING_DEG))?;
    let theta_s_deg = table.required_within(row, "theta_s_deg", (-GRAZING_DEG, GRAZING_DEG))?;
    Ok(InPlane {
        theta_i_rad: theta_i_deg.to_radians(),
        theta_s_rad: theta_s_deg.to_radians(),
        f_per_sr: value_per_sr(table, row)?,
    })
}

fn value_per_sr(table: &Table, row: usize) -> Result<f64, FormatError> {
    let value = table.number(row, "brdf_per_sr")?.filter(|value| *value <= 0.0);
    let Some(cell) = value.and_then(|_| table.cell(row, "brdf_per_sr")) else {
        return table.required_within(row, "brdf_per_sr", VALUES_PER_SR);
    };
    let blank = table.number_within(row, "blank_per_sr", VALUES_PER_SR)?;
    let way_out = "a value that is not above zero is a limit: give its blank in `blank_per_sr`, or leave the line out";
    blank.ok_or_else(|| cell.refuse(way_out))
}

/// Reads the plane of incidence of a `.bsdf` table at its first sample rotation, and what a person should know of it; zeros,
/// which stand for nothing measured, are left out, and so are values below zero.
///
/// # Errors
/// What is missing, too much or cannot be read, with its line; a table of transmission or of colours.
pub fn read_bsdf(bytes: &[u8]) -> Result<(Vec<InPlane>, Vec<String>), FormatError> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let header = Header::read(&mut lines)?;
    let mut found = Vec::new();
    let mut negative = 0;
    // A block for each angle of incidence: the total, then a row for each azimuth.
    for &incidence_deg in &header.incidences_deg {
        match lines.next() {
            Some((_, line)) if line.starts_with("TIS") => {}
            Some((number, _)) => {
                let place = format!("line {number}");
                return Err(FormatError::at(place, "`TIS` was expected", "correct the table"));
            }
            None => return Err(missing("TIS")),
        }
        for &azimuth_deg in &header.azimuths_deg {
            let Some((number, line)) = lines.next() else { return Err(missing("row")) };
            let row = header.row(number, line)?;
            let towards = match azimuth_deg {
                0.0 => -1.0,
                180.0 => 1.0,
                _ => continue,
            };
            for (&radial_deg, f_per_sr) in header.radials_deg.iter().zip(row) {
                // Both rows of the plane contain the mirror direction.
                if towards < 0.0 || radial_deg != 0.0 {
                    let theta_s_deg = incidence_deg + towards * radial_deg;
                    negative += usize::from(f_per_sr < 0.0);
                    found.extend(in_plane(incidence_deg, theta_s_deg, f_per_sr));
                }
            }
        }
    }
    if found.is_empty() {
        let problem = "no value lies in the plane of incidence";
        let way_out = "give the azimuths 0 and 180, and values above 0";
        return Err(FormatError::at("the file", problem, way_out));
    }
    let mut notices = Vec::new();
    let behind = lines.next().filter(|(_, line)| !line.starts_with("DataEnd"));
    match (header.rotations_deg.as_slice(), behind) {
        ([first, _, ..], _) => {
            let all = header.rotations_deg.len();
            notices.push(format!("only the rotation at {first}° is read; the file has {all}"));
        }
        (_, Some((number, _))) => {
            let problem = "something stands behind the last block";
            let way_out = "give the angles of all blocks in the header";
            return Err(FormatError::at(format!("line {number}"), problem, way_out));
        }
        (_, None) => {}
    }
    if negative > 0 {
        let values = counted(negative, "value");
        let are = if negative == 1 { "is" } else { "are" };
        notices.push(format!("{values} below zero {are} left out: no surface has one"));
    }
    Ok((found, notices))
}

fn in_plane(theta_i_deg: f64, theta_s_deg: f64, f_per_sr: f64) -> Option<InPlane> {
    (theta_s_deg.abs() <= GRAZING_DEG && f_per_sr > 0.0).then(|| InPlane {
        theta_i_rad: theta_i_deg.to_radians(),
        theta_s_rad: theta_s_deg.to_radians(),
        f_per_sr,
    })
}

/// Angles of a `.bsdf` table, degrees.
#[derive(Default)]
struct Header {
    incidences_deg: Vec<f64>,
    azimuths_deg: Vec<f64>,
    radials_deg: Vec<f64>,
    rotations_deg: Vec<f64>,
}

/// Words of a header whose tables are something else than the reflection at one wavelength.
const OTHER_TABLES: [(&str, &str); 2] =
    [("BTDF", "this is a table of transmission"), ("XYZ", "this is a table of three colours")];

impl Header {
    /// Reads up to the line `DataBegin`.
    fn read<'t>(lines: &mut impl Iterator<Item = (usize, &'t str)>) -> Result<Header, FormatError> {
        let mut header = Header::default();
        loop {
            let Some((number, line)) = lines.next() else { return Err(missing("DataBegin")) };
            let words: Vec<&str> = line.split_whitespace().collect();
            let kind = match words[..] {
                [kind] | ["ScatterType" | "SpectralContent", kind] => kind,
                _ => "",
            };
            if let Some((_, problem)) = OTHER_TABLES.iter().find(|(other, _)| *other == kind) {
                let way_out = "give the BRDF at one wavelength";
                return Err(FormatError::at(format!("line {number}"), *problem, way_out));
            }
            let axis = match words.first().copied() {
                Some("DataBegin") => break,
                Some("SampleRotation") => &mut header.rotations_deg,
                Some("AngleOfIncidence") => &mut header.incidences_deg,
                Some("ScatterAzimuth") => &mut header.azimuths_deg,
                Some("ScatterRadial") => &mut header.radials_deg,
                _ => continue,
            };
            let Some((below, values)) = lines.next() else { return Err(missing("DataBegin")) };
            *axis = numbers(below, values)?;
            if words.get(1).and_then(|count| count.parse().ok()) != Some(axis.len()) {
                let problem = format!("`{line}` is followed by {} angles", axis.len());
                return Err(FormatError::at(
                    format!("line {number}"),
                    problem,
                    "correct the count",
                ));
            }
        }
        header.check()?;
        Ok(header)
    }

    fn check(&self) -> Result<(), FormatError> {
        let axes = [
            ("AngleOfIncidence", &self.incidences_deg),
            ("ScatterAzimuth", &self.azimuths_deg),
            ("ScatterRadial", &self.radials_deg),
        ];
        if let Some((name, _)) = axes.iter().find(|(_, axis)| axis.is_empty()) {
            return Err(missing(name));
        }
        if self.incidences_deg.iter().all(|angle| (0.0..=GRAZING_DEG).contains(angle)) {
            return Ok(());
        }
        let problem = format!("an angle of incidence is not from 0 to {GRAZING_DEG}");
        Err(FormatError::at("AngleOfIncidence", problem, "give it in degrees"))
    }

    fn row(&self, line: usize, text: &str) -> Result<Vec<f64>, FormatError> {
        let row = numbers(line, text)?;
        if row.len() != self.radials_deg.len() {
            let problem = format!("{} values for {} angles", row.len(), self.radials_deg.len());
            return Err(FormatError::at(format!("line {line}"), problem, "correct the line"));
        }
        let (least, greatest) = VALUES_PER_SR;
        if let Some(value) =
            row.iter().find(|value| **value > 0.0 && !(least..=greatest).contains(value))
        {
            let problem = format!("`{value:e}` cannot be f in 1/sr");
            return Err(FormatError::at(format!("line {line}"), problem, "correct the line"));
        }
        Ok(row)
    }
}

fn missing(what: &str) -> FormatError {
    FormatError::at("the file", format!("there is no `{what}`"), "give a complete .bsdf table")
}

fn numbers(line: usize, text: &str) -> Result<Vec<f64>, FormatError> {
    let mut numbers = Vec::new();
    for word in text.split_whitespace() {
        let number: f64 = word.parse().unwrap_or(f64::NAN);
        if !number.is_finite() {
            let problem = format!("`{word}` is not a finite number");
            return Err(FormatError::at(format!("line {line}"), problem, "correct the line"));
        }
        numbers.push(number);
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BSDF: &str = "# by hand\nSource\tMeasured\nAngleOfIncidence\t2\n10 30\nScatterAzimuth 3\n\
         0 90 180\nScatterRadial 3\n0 20 80\n\nMonochrome\nDataBegin\nTIS 0.1\n\
         1 2 3\n4 5 6\n1 8 9\nTIS 0.1\n1 2 0\n4 5 6\n1 8 9\n";

    #[test]
    fn the_plane_of_incidence_is_taken_out_of_a_bsdf() {
        let (found, notices) = read_bsdf(BSDF.as_bytes()).unwrap();
        assert!(notices.is_empty(), "{notices:?}");
        let rows: Vec<[i64; 3]> = found
            .iter()
            .map(|p| [p.theta_i_rad.to_degrees(), p.theta_s_rad.to_degrees(), p.f_per_sr])
            .map(|row| row.map(|x| x.round() as i64))
            .collect();
        let at_10 = [[10, 10, 1], [10, -10, 2], [10, -70, 3], [10, 30, 8]];
        let at_30 = [[30, 30, 1], [30, 10, 2], [30, 50, 8]];
        assert_eq!(rows, [&at_10[..], &at_30[..]].concat());
    }

    #[test]
    fn what_is_broken_is_named() {
        let message = |text: &str| read_bsdf(text.as_bytes()).unwrap_err().to_string();
        assert!(message("").contains("DataBegin"));
        assert!(message(&BSDF.replace("4 5 6", "4 5")).contains("line 14: 2 values for 3 angles"));
        assert!(message(&BSDF.replace("0 20 80", "0 x 80")).contains("line 8"));
        assert!(message(&BSDF.replace("Radial 3", "Radial 4")).contains("3 angles"));
        for (word, said) in [
            ("BTDF", "table of transmission"),
            ("ScatterType BTDF", "table of transmission"),
            ("XYZ", "three colours"),
        ] {
            assert!(message(&BSDF.replace("Monochrome", word)).contains(said));
        }
        assert!(
            read_bsdf(BSDF.replace("Measured", "Measured on the XYZ stage").as_bytes()).is_ok()
        );
        let more = format!("{BSDF}TIS 0.1\n1 2 0\n");
        assert!(message(&more).contains("line 20: something stands behind the last block"));
    }

    #[test]
    fn what_is_left_out_of_a_bsdf_is_said() {
        let negative = BSDF.replace("1 2 0\n", "1 2 -3\n") + "DataEnd\nmeasured in May\n";
        let (found, notices) = read_bsdf(negative.as_bytes()).unwrap();
        assert_eq!(found.len(), 7);
        assert_eq!(notices, ["1 value below zero is left out: no surface has one"]);
        let rotated = BSDF.replace("Source", "SampleRotation 2\n0 90\nSource") + "TIS 0.1\n";
        let (_, notices) = read_bsdf(rotated.as_bytes()).unwrap();
        assert_eq!(notices, ["only the rotation at 0° is read; the file has 2"]);
    }
}
