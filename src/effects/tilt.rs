//! Random tilts of the normal under a chirp, and means over them.
//!
//! There are two tilts, along the plane of incidence and across it, both normally distributed about 0. Means over
//! them are Gauss–Hermite sums with five nodes along, and two across. Since only the square of the tilt across counts,
//! these two are one. The sums are exact for polynomials of degree nine along and three across.

/// Number of nodes of [`nodes`].
pub const NODES: usize = 5;
/// Nodes along the plane of incidence, in standard deviations, and their weights.
const ALONG: [(f64, f64); NODES] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_721),
    (-1.355_626_179_974_266, 0.222_075_922_005_613),
    (0.0, 0.533_333_333_333_333),
    (1.355_626_179_974_266, 0.222_075_922_005_613),
    (2.856_970_013_872_806, 0.011_257_411_327_721),
];
/// Node across the plane of incidence, in standard deviations.
const ACROSS: f64 = 1.0;
/// Least cos θ: below it a tilted facet faces away from the radar.
const LEAST_COS_THETA: f64 = 1e-6;

/// Cosine of the incidence angle after tilts of the normal by these tangents, along the plane of incidence and
/// across it; `None` if the facet then faces away.
pub fn tilted_cos_theta(cos_theta: f64, [along, across]: [f64; 2]) -> Option<f64> {
    let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let length = (1.0 + along * along + across * across).sqrt();
    let cos_theta = (cos_theta + along * sin_theta) / length;
    (cos_theta > LEAST_COS_THETA).then_some(cos_theta)
}

/// Tangents of the two tilts and their weight at every node, for tilts of the standard deviation `sd_rad`, rad.
pub fn nodes(sd_rad: f64) -> [([f64; 2], f64); NODES] {
    ALONG.map(|(along, weight)| ([along, ACROSS].map(|t| (sd_rad * t).tan()), weight))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_over_tilts_are_those_of_the_normal_law() {
        let sd_rad = 0.01;
        let mean = |f: fn([f64; 2]) -> f64| {
            let part = |([along, across], weight): ([f64; 2], f64)| {
                weight * f([along, across].map(|t| t.atan() / 0.01))
            };
            nodes(sd_rad).map(part).iter().sum::<f64>()
        };
        assert!((mean(|_| 1.0) - 1.0).abs() < 1e-12);
        assert!((mean(|[a, _]| a * a) - 1.0).abs() < 1e-9);
        assert!((mean(|[a, b]| a.powi(4) * b * b) - 3.0).abs() < 1e-9);
        assert!((mean(|[a, _]| a.powi(8)) - 105.0).abs() < 1e-6);
    }

    #[test]
    fn a_tilt_in_the_plane_of_incidence_is_a_step_in_theta() {
        let tilted = tilted_cos_theta(0.5f64.cos(), [0.1f64.tan(), 0.0]).unwrap();
        assert!((tilted - 0.4f64.cos()).abs() < 1e-12);
        let across = tilted_cos_theta(1.0, [0.0, 0.2f64.tan()]).unwrap();
        assert!((across - 0.2f64.cos()).abs() < 1e-12);
        assert_eq!(tilted_cos_theta(1.5f64.cos(), [-0.2, 0.0]), None);
    }
}
