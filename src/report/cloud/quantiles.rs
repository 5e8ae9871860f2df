//! Quantiles of the residuals against those of their law.

use statrs::function::erf::erfc_inv;

use super::models::{names, shown};
use crate::diagnose::{Report, Row};
use crate::formats::figure::{FigureError, Plot, Series, Style};
use crate::report::picture::{Picture, guide};

/// Quantiles that are drawn of the bulk, and of each tail one by one.
const BULK: usize = 200;
const TAIL: usize = 40;

pub(super) fn picture(report: &Report) -> Result<Picture, FigureError> {
    let z: [fn(&Row) -> f64; 2] = [|row| row.z_before, |row| row.z_after];
    let mut series = vec![guide("model is right", [-7.0, 7.0], |x| x)];
    for (z, (name, ink)) in shown(report, z).into_iter().zip(names(report)) {
        let points = points(report.rows.iter().map(z).collect());
        series.push(Series { name: name.to_owned(), style: Style::Points, ink, points });
    }
    let plot = Plot {
        title: "Quantiles of z",
        subtitle: "all chirps that meet the target; silent ones are drawn at random below the threshold",
        x_label: "standard normal quantile",
        y_label: "quantile of z",
        series,
        ..Plot::default()
    };
    Ok(Picture {
        file: "quantiles",
        title: "Law of the residuals",
        caption: "Quantiles of the quantile residuals z against those of a standard normal. On the \
                  line the model's law of powers, speckle and silence is right; a steeper course says \
                  that powers scatter more than the model, a shift that they are higher or lower."
            .to_owned(),
        panels: vec![plot.drawing()?],
        columns: 1,
    })
}

/// Normal quantile and quantile of z: every point of the tails, and some of the bulk.
fn points(mut z: Vec<f64>) -> Vec<(f64, f64)> {
    z.retain(|z| z.is_finite());
    z.sort_by(f64::total_cmp);
    let count = z.len();
    let step = (count / BULK).max(1);
    let mut points = Vec::new();
    for (index, z) in z.into_iter().enumerate() {
        if index < TAIL || index + TAIL >= count || index.is_multiple_of(step) {
            let share = (index as f64 + 0.5) / count as f64;
            points.push((-std::f64::consts::SQRT_2 * erfc_inv(2.0 * share), z));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_lie_on_the_line() {
        let normal = |i: usize| -std::f64::consts::SQRT_2 * erfc_inv((i as f64 + 0.5) / 5000.0);
        let points = points((0..10_000).map(normal).rev().collect());
        assert!((200..400).contains(&points.len()), "{}", points.len());
        assert!(points.iter().all(|(x, y)| (x - y).abs() < 1e-9));
        assert!(points.first().unwrap().0 < -3.5 && points.last().unwrap().0 > 3.5);
    }
}
