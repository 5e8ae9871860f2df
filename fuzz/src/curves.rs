//! Tables of scattering over angles.

use matdb::catalogue::exchange::{Details, Foreign, Format, Subject, export};
use matdb::formats::ColumnNames;
use matdb::material::file::in_plane::read_bsdf;
use matdb::material::file::points;
use matdb::material::{Material, SourceKind};
use matdb::measure::Curve;

/// A curve's table with names of ours: points that belong in a curve, or an error.
pub fn curve(bytes: &[u8]) {
    if let Ok((curve, _)) = Curve::read_as(bytes, &ColumnNames::default()) {
        assert!(curve.observations.iter().all(|row| row.level_sigma0().is_some()));
    }
}

/// A backscatter curve: read, written and read again it has as many rows.
pub fn backscatter(bytes: &[u8]) {
    if let Ok(curve) = Curve::read(bytes) {
        let again = Curve::read(&curve.write()).expect("a curve that was written can be read");
        assert_eq!(again.observations.len(), curve.observations.len());
    }
}

/// Angles and levels that a fit can use, as CSV or `.bsdf`.
pub fn in_plane(bytes: &[u8]) {
    let table = points(bytes, &ColumnNames::default()).unwrap_or_default();
    for (_, row) in table.rows {
        assert!(row.theta_i_rad.cos() > 0.0 && row.theta_r_rad.cos() > 0.0);
        assert!(row.level_sigma0().is_some_and(|sigma0| sigma0.is_finite() && sigma0 > 0.0));
    }
    for value in read_bsdf(bytes).into_iter().flat_map(|(values, _)| values) {
        assert!(value.theta_i_rad.cos() > 0.0 && value.theta_s_rad.cos() > 0.0);
        assert!(value.f_per_sr.is_finite() && value.f_per_sr > 0.0);
    }
}

/// A table as a material: what is accepted can be exported as CSV and read again, with the same points.
pub fn bsdf(bytes: &[u8]) {
    let given = stated();
    let Ok((material, _)) = Foreign::Csv.read("curve.bsdf", bytes, &given) else { return };
    let again = exported_and_read(&material, Format::Csv, Foreign::Csv, &given);
    same_points(&material, &again);
}

/// What a person states of a file that says nothing of itself.
pub fn stated() -> Details {
    Details {
        slug: Some("paint".parse().expect("a name")),
        class: Some("paint".to_owned()),
        licence: Some("CC0-1.0".to_owned()),
        source: Some("Our bench".to_owned()),
        kind: Some(SourceKind::Modelled),
        frequency_hz: Some(300e9),
        ..Details::default()
    }
}

/// The material that an export of another one gives.
pub fn exported_and_read(
    material: &Material,
    format: Format,
    foreign: Foreign,
    given: &Details,
) -> Material {
    let subject = Subject { material, revision: None, added_at: None, origin: None, curve: None };
    let exported = export(&subject, format, "curve").expect("what was read can be exported");
    let (_, file) = exported.files.first().expect("an export has a file");
    let again = foreign.read("curve", file, given);
    again.unwrap_or_else(|error| panic!("{error}\n{}", String::from_utf8_lossy(file))).0
}

/// The first curve of both materials has the same points, apart from the rounding of decimals.
pub fn same_points(one: &Material, other: &Material) {
    let [one, other] = [one, other].map(|material| &material.curves[0].observations);
    assert_eq!(one.len(), other.len());
    for (a, b) in one.iter().zip(other) {
        assert!((a.theta_i_rad - b.theta_i_rad).abs() < 1e-9, "{a:?} {b:?}");
        assert_eq!(a.censor, b.censor);
        let levels = [a.sigma0, b.sigma0].map(|level| level.map_or(0.0, f64::ln));
        assert!((levels[0] - levels[1]).abs() < 1e-6, "{a:?} {b:?}");
    }
}
