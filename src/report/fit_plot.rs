//! A curve and its fit: over the incidence, or over the angle of the receiver where source and receiver were in two
//! directions.

use super::material_plot::{FAINTEST_DB, curve_points, fit_layers, incidence_plot};
use crate::brdf::ThroughBeam;
use crate::formats::figure::{Ink, Plot, Series, Style};
use crate::formats::words::significant;
use crate::material::{Aspect, Fit, Observation};
use crate::units::db_from_ratio;

/// Most angles of incidence that one plot shows.
const MOST_INCIDENCES: usize = 6;
/// Steps of a fitted curve.
const STEPS: u32 = 300;
/// Angles nearer than this, rad, are one.
const SAME_RAD: f64 = 1e-9;

/// A plot of a curve and its fit.
pub struct FitPlot {
    title: String,
    subtitle: String,
    series: Vec<Series>,
    has_pairs: bool,
}

impl FitPlot {
    /// The plot of a curve's rows; `None` where all have two directions and lie out of the plane of incidence.
    pub fn new(title: String, curve: &str, rows: &[Observation], fit: &Fit) -> Option<FitPlot> {
        if rows.iter().all(Observation::is_retro) {
            let subtitle = format!("{}, with its 95 % band", fit.name);
            let points = curve_points(curve, rows, Ink::Detections);
            let series = fit_layers(std::slice::from_ref(fit), points);
            return Some(FitPlot { title, subtitle, series, has_pairs: false });
        }
        let scans = scans(rows);
        let (shown, all) = (scans.len().min(MOST_INCIDENCES), scans.len());
        let which =
            if shown < all { format!(", {shown} of {all} incidences") } else { String::new() };
        let subtitle = format!("{} in dashes{which}", fit.name);
        let mut longest = scans;
        longest.sort_by_key(|(_, scan)| std::cmp::Reverse(scan.len()));
        longest.truncate(MOST_INCIDENCES);
        longest.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut series = Vec::new();
        for (number, (incidence, scan)) in longest.iter().enumerate() {
            series.extend(layers(*incidence, scan, fit, Ink::Own(number)));
        }
        (!series.is_empty()).then_some(FitPlot { title, subtitle, series, has_pairs: true })
    }

    /// The plot.
    pub fn plot(&self) -> Plot<'_> {
        let FitPlot { title, subtitle, series, has_pairs } = self;
        if *has_pairs {
            let (x_label, y_label) = ("receiver θ_s, °", "f, dB(1/sr)");
            Plot { title, subtitle, x_label, y_label, series: series.clone(), ..Plot::default() }
        } else {
            incidence_plot(title, subtitle, series.clone())
        }
    }
}

/// Rows of one angle of incidence, each behind the angle of its receiver, rad.
type Scan<'a> = Vec<(f64, &'a Observation)>;

/// The rows in the plane of incidence by their angle of incidence, rad.
fn scans(rows: &[Observation]) -> Vec<(f64, Scan<'_>)> {
    let mut in_plane: Vec<(f64, f64, &Observation)> = Vec::new();
    for row in rows {
        in_plane.extend(row.aspect().theta_s_rad().map(|theta_s| (row.theta_i_rad, theta_s, row)));
    }
    in_plane.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let scans = in_plane.chunk_by(|a, b| b.0 - a.0 < SAME_RAD);
    scans
        .map(|scan| (scan[0].0, scan.iter().map(|(_, theta_s, row)| (*theta_s, *row)).collect()))
        .collect()
}

/// What was measured at one angle of incidence, and the fit in dashes.
fn layers(incidence_rad: f64, scan: &Scan, fit: &Fit, ink: Ink) -> Vec<Series> {
    let name = format!("incidence {}°", significant(incidence_rad.to_degrees(), 4));
    let (mut seen, mut below) = (Vec::new(), Vec::new());
    for (theta_s_rad, row) in scan {
        let points = if row.is_censored() { &mut below } else { &mut seen };
        points.extend(row.level_sigma0().map(|level| point(*theta_s_rad, row.aspect(), level)));
    }
    let law = ThroughBeam { law: &fit.model, beam_rad: fit.beam_rad().unwrap_or(0.0) };
    // The scan is sorted.
    let [first, last] = [scan.first(), scan.last()].map(|end| end.map_or(0.0, |end| end.0));
    let fitted = (0..=STEPS).map(|step| {
        let theta_s_rad = first + (last - first) * f64::from(step) / f64::from(STEPS);
        let aspect = Aspect::in_plane(incidence_rad, theta_s_rad);
        let (theta_s_deg, f_db) = point(theta_s_rad, aspect, aspect.sigma0(&law));
        (theta_s_deg, if f_db >= FAINTEST_DB { f_db } else { f64::NAN })
    });
    let mut layers = vec![
        Series { name: name.clone(), style: Style::Points, ink, points: seen },
        Series { name: name.clone(), style: Style::Beyond, ink, points: fitted.collect() },
    ];
    if !below.is_empty() {
        layers.push(Series {
            name: format!("{name}, below this"),
            style: Style::Below,
            ink,
            points: below,
        });
    }
    layers
}

/// Angle of the receiver, degrees, and f, dB over 1/sr.
fn point(theta_s_rad: f64, aspect: Aspect, sigma0: f64) -> (f64, f64) {
    (theta_s_rad.to_degrees(), db_from_ratio(sigma0 / aspect.sigma0_per_f()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, Lambert};
    use crate::material::{Lobes, builtin};

    #[test]
    fn the_longest_scans_are_shown_with_what_the_fit_says() {
        let mut fit = builtin::get("concrete").unwrap().unwrap().fits.remove(0);
        fit.model = Brdf::Lambert(Lambert { albedo: 0.3 });
        fit.lobes = Lobes::RadarAndSurface;
        let row = |theta_i: f64, theta_s: f64| {
            let Aspect { theta_r_rad, delta_phi_rad, .. } = Aspect::in_plane(theta_i, theta_s);
            let row = Observation::backscatter(theta_i, Some(0.5), None);
            Observation { theta_r_rad, delta_phi_rad, ..row }
        };
        let mut rows: Vec<Observation> = (0..8).map(|i| row(0.1 * f64::from(i), 0.05)).collect();
        rows.extend((0..5).map(|i| row(0.75, 0.2 * f64::from(i) - 0.3)));
        let drawn = FitPlot::new("t".to_owned(), "c", &rows, &fit).unwrap();
        assert_eq!(drawn.subtitle, format!("{} in dashes, 6 of 9 incidences", fit.name));
        let name = format!("incidence {}°", significant(0.75f64.to_degrees(), 4));
        let own: Vec<&Series> = drawn.series.iter().filter(|one| one.name == name).collect();
        assert_eq!((own.len(), own[0].points.len()), (2, 5));
        let f_db = db_from_ratio(0.3 / std::f64::consts::PI);
        assert!(own[1].points.iter().all(|(_, level_db)| (level_db - f_db).abs() < 1e-9));
        let aside = Observation { delta_phi_rad: 1.0, ..row(0.2, 0.3) };
        assert!(FitPlot::new("t".to_owned(), "c", &[aside], &fit).is_none());
    }
}
