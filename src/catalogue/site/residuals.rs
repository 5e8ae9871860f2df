//! The residuals of a fit.

use super::curve::{class_of, marks};
use super::entry::kind_of;
use super::picture::Picture;
use crate::brdf::{Scattering, ThroughBeam};
use crate::formats::figure::{Series, Style};
use crate::material::{Fit, Material, Observation};
use crate::units::db_from_ratio;

/// Backscatter of the fitted curve less the fit, dB; none where there is no backscatter or no curve was fitted.
pub(super) fn picture(material: &Material, number: usize, fit: &Fit) -> Option<String> {
    let name = fit.curve.as_ref()?;
    let curve = material.curves.iter().find(|curve| curve.name == *name)?;
    if !curve.observations.iter().any(Observation::is_retro) {
        return None;
    }
    let class = format!("ink0 {}", class_of(kind_of(material, &curve.source)));
    let series = |style, points| Series { name: String::new(), style, points };
    let seen = ThroughBeam { law: &fit.model, beam_rad: material.beam_rad(fit) };
    let zero = vec![(0.0, 0.0), (90.0, 0.0)];
    let mut drawn = vec![("zero".to_owned(), series(Style::Guide, zero))];
    for (style, mut points) in marks(&curve.observations) {
        for (theta_deg, level_db) in &mut points {
            *level_db -= db_from_ratio(seen.sigma0(theta_deg.to_radians()));
        }
        drawn.push((class.clone(), series(style, points)));
    }
    let picture = Picture {
        id: format!("residuals-{number}"),
        title: format!("What the fit {} leaves of the curve {name}", fit.name),
        description:
            "Detected levels less the model's, dB; a triangle is a limit less the model's level, \
                      and the truth lies where it points. A sound fit scatters evenly about 0."
                .to_owned(),
        y_label: "point − fit, dB",
        series: drawn,
    };
    picture.svg(material)
}
