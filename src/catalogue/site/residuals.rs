//! The residuals of a fit.

use super::curve::{class_of, marks};
use super::entry::kind_of;
use super::levels::range_deg;
use super::plot::{Plot, Series, Shape};
use crate::brdf::Scattering;
use crate::material::{Fit, Material};
use crate::units::db_from_ratio;

/// Points of the fitted curve less the fit, dB; none when no curve was fitted.
pub(super) fn picture(material: &Material, number: usize, fit: &Fit) -> Option<String> {
    let name = fit.curve.as_ref()?;
    let curve = material.curves.iter().find(|curve| curve.name == *name)?;
    let class = format!("ink0 {}", class_of(kind_of(material, &curve.source)));
    let zero = vec![(0.0, 0.0), (90.0, 0.0)];
    let mut series = vec![Series { shape: Shape::Line, class: "nothing".to_owned(), points: zero }];
    for (shape, mut points) in marks(&curve.observations) {
        for (theta_deg, level_db) in &mut points {
            *level_db -= db_from_ratio(fit.model.sigma0(theta_deg.to_radians()));
        }
        series.push(Series { shape, class: class.clone(), points });
    }
    let plot = Plot {
        id: format!("residuals-{number}"),
        title: format!("What the fit {} leaves of the curve {name}", fit.name),
        description: "Detected levels less the model's, dB; a triangle is a detection limit less the model's \
                      level, so the truth lies below it. A sound fit scatters evenly about 0."
            .to_owned(),
        y_label: "point − fit, dB",
        claimed_deg: range_deg(material),
        series,
    };
    plot.svg()
}
