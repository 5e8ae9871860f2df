//! A curve of which source and receiver were in two directions, and its fit, over the angle of the receiver.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::brdf::ThroughBeam;
use crate::formats::figure::{Plot, Series, Style};
use crate::formats::words::significant;
use crate::material::{Aspect, Fit, Observation};
use crate::units::db_from_ratio;

/// Most angles of incidence that one plot shows.
const MOST_INCIDENCES: usize = 6;
/// Steps of a fitted curve.
const STEPS: u32 = 300;
/// Angles nearer than this, rad, are one.
const SAME_RAD: f64 = 1e-9;

/// A plot over the angle of the receiver, degrees, of f, dB over 1/sr.
pub fn receiver_plot<'a>(title: &'a str, subtitle: &'a str, series: Vec<Series>) -> Plot<'a> {
    let (x_label, y_label) = ("receiver θ_s, °", "f, dB(1/sr)");
    Plot { title, subtitle, x_label, y_label, series, ..Plot::default() }
}

/// What was measured in the plane of incidence, and a fit in dashes, for some of the angles of incidence; nothing where all
/// rows are out of the plane.
pub fn receiver_layers(rows: &[Observation], fit: &Fit) -> Vec<Series> {
    let mut scans: Vec<(f64, Vec<(f64, &Observation)>)> = Vec::new();
    for row in rows {
        let Some(theta_s_rad) = theta_s_rad(row.aspect()) else { continue };
        let known = scans.iter_mut().find(|(of, _)| (of - row.theta_i_rad).abs() < SAME_RAD);
        match known {
            Some((_, scan)) => scan.push((theta_s_rad, row)),
            None => scans.push((row.theta_i_rad, vec![(theta_s_rad, row)])),
        }
    }
    scans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let every = scans.len().div_ceil(MOST_INCIDENCES).max(1);
    scans
        .into_iter()
        .step_by(every)
        .flat_map(|(incidence, scan)| layers(incidence, scan, fit))
        .collect()
}

fn layers(incidence_rad: f64, scan: Vec<(f64, &Observation)>, fit: &Fit) -> Vec<Series> {
    let name = format!("incidence {}°", significant(incidence_rad.to_degrees(), 4));
    let (mut seen, mut below) = (Vec::new(), Vec::new());
    for (theta_s_rad, row) in &scan {
        let points = if row.is_censored() { &mut below } else { &mut seen };
        points.extend(row.level_sigma0().map(|level| point(*theta_s_rad, row.aspect(), level)));
    }
    let law = ThroughBeam { law: &fit.model, beam_rad: fit.beam_rad().unwrap_or(0.0) };
    let angles = || scan.iter().map(|(theta_s_rad, _)| *theta_s_rad);
    let (first, last) = (angles().fold(FRAC_PI_2, f64::min), angles().fold(-FRAC_PI_2, f64::max));
    let fitted = (0..=STEPS).map(|step| {
        let theta_s_rad = first + (last - first) * f64::from(step) / f64::from(STEPS);
        let delta_phi_rad = if theta_s_rad > 0.0 { PI } else { 0.0 };
        let theta_r_rad = theta_s_rad.abs();
        let aspect = Aspect { theta_i_rad: incidence_rad, theta_r_rad, delta_phi_rad };
        point(theta_s_rad, aspect, aspect.sigma0(&law))
    });
    let mut layers = vec![
        Series { name: name.clone(), style: Style::Points, points: seen },
        Series { name: name.clone(), style: Style::Beyond, points: fitted.collect() },
    ];
    if !below.is_empty() {
        let name = format!("{name}, below this");
        layers.push(Series { name, style: Style::Below, points: below });
    }
    layers
}

/// Angle of the receiver, degrees, and f, dB over 1/sr.
fn point(theta_s_rad: f64, aspect: Aspect, sigma0: f64) -> (f64, f64) {
    (theta_s_rad.to_degrees(), db_from_ratio(sigma0 / aspect.sigma0_per_f()))
}

/// Angle of the receiver in the plane of incidence, rad, positive on the mirror's side; `None` out of the plane.
fn theta_s_rad(aspect: Aspect) -> Option<f64> {
    let Aspect { theta_r_rad, delta_phi_rad, .. } = aspect;
    let turned = delta_phi_rad.rem_euclid(2.0 * PI);
    if theta_r_rad == 0.0 || turned.min(2.0 * PI - turned) < SAME_RAD {
        Some(-theta_r_rad)
    } else {
        ((turned - PI).abs() < SAME_RAD).then_some(theta_r_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_plane_of_incidence_has_an_angle_of_the_receiver() {
        let of = |theta_r_rad: f64, delta_phi_rad: f64| {
            theta_s_rad(Aspect { theta_i_rad: 0.5, theta_r_rad, delta_phi_rad })
        };
        assert_eq!(of(0.3, 0.0), Some(-0.3));
        assert_eq!(of(0.3, PI), Some(0.3));
        assert_eq!(of(0.3, -PI), Some(0.3));
        assert_eq!(of(0.3, 0.2), None);
        assert_eq!(of(0.0, 0.2), Some(-0.0));
    }
}
