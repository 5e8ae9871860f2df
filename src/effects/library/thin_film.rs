//! A film over a share of every spot: its interference changes the reflectance of the surface.
//!
//! R is the reflectance of the film on the substrate, by the characteristic matrix at the centre frequency, and R₀ that
//! of the bare substrate. The specular part of f is multiplied by 1 − c + c·R/R₀ at the angle at which its facets are met,
//! as in `layered`: facets send the wave back where they face the radar, so that this part does not swing with θ. So is,
//! at θ, the part of the diffuse return that comes from unevenness far smaller than the wavelength on the surface
//! itself. The part from below crosses the film twice and is multiplied by 1 − c + c·((1 − R)/(1 − R₀))², at θ.
//! The substrate is lossless. Its index is the one that gives f_λ, n = (1 + √f_λ)/(1 − √f_λ), times a
//! ratio, since backscatter alone does not determine f_λ.

use crate::brdf::{Brdf, Fresnel, Layer, Layered, Scattering, ScatteringModel, mirror_cosine};
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};

pub(crate) struct ThinFilm;

/// Reflectance at normal incidence of a substrate whose law has no f_λ: an index of 2.
const USUAL_F_LAMBDA: f64 = 0.11;
/// Beyond these a substrate reflects nothing, or all, and a ratio means nothing.
const F_LAMBDA_RANGE: [f64; 2] = [1e-3, 0.999];
const MOST_THETA_RAD: f64 = 1.55;

/// Less than any solid has.
const LEAST_INDEX: f64 = 1.05;

/// ε of the substrate under a law, whose index is `ratio` times the one that gives f_λ.
fn substrate(law: &Brdf, ratio: f64) -> f64 {
    let [least, most] = F_LAMBDA_RANGE;
    let f_lambda = law.f_lambda().unwrap_or(USUAL_F_LAMBDA);
    let root = f_lambda.clamp(least, most).sqrt();
    (ratio * (1.0 + root) / (1.0 - root)).max(LEAST_INDEX).powi(2)
}

/// Reflectance with the film and without, at θ.
fn reflectances(
    [thickness_m, index]: [f64; 2],
    eps_real: f64,
    frequency_hz: f64,
    theta_rad: f64,
) -> [f64; 2] {
    let theta_rad = theta_rad.min(MOST_THETA_RAD);
    let layers = vec![Layer { thickness_m, eps_real: index * index, eps_imag: 0.0 }];
    let coated = Layered { layers, eps_real, eps_imag: 0.0, frequency_hz, lobe_rad: None };
    let bare = Fresnel { eps_real, eps_imag: 0.0, lobe_rad: None };
    [coated.reflectance(theta_rad), bare.reflectance(theta_rad)]
}

const ABOUT: About = About {
    name: "thin-film",
    level: Level::Material,
    description: "A coating of this thickness and refractive index covers a share of the surface; what it \
         reflects at its two sides interferes, and raises or lowers the echo by the angle.",
    signature: "The residual of the diffuse part swings with the angle, with no other covariate; the specular part is \
         raised or lowered at all angles alike. A diffuse return from below swings against one of the surface. A film much thinner than a wavelength only shifts the levels, \
         which the base law absorbs; another frequency moves the swings, which tells it from a wrong \
         shape of the lobe.",
    parameters: &[
        EffectParameter::new("coverage", "1", [0.0, 1.0], 0.0, 0.1),
        EffectParameter::new("thickness_m", "m", [0.0, 8e-3], 3e-4, 2e-5),
        EffectParameter::new("index", "1", [1.0, 4.0], 1.6, 0.05),
        EffectParameter::new("from_below", "1", [0.0, 1.0], 1.0, 0.2),
        EffectParameter::new("substrate_ratio", "1", [0.5, 5.0], 1.0, 0.1),
    ],
    conflicts: &[Conflict::OF_BACKSCATTER],
    has_one_form: false,
};

impl Effect for ThinFilm {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        // A ripple is found only from within half a fringe.
        let thin_m = [1e-4, 2e-4, 3e-4, 4.5e-4, 6e-4, 8e-4].into_iter();
        let thick_m = (4..=28).map(|quarter| 0.25e-3 * f64::from(quarter));
        let thicknesses_m: Vec<f64> = thin_m.chain(thick_m).collect();
        // Without a mirror part of its own the fitted f_λ is lower than the substrate's.
        let mut starts = Vec::new();
        for [coverage, index, from_below, ratio] in [[0.3, 1.6, 1.0, 1.0], [0.3, 1.6, 0.0, 1.6]] {
            for &thickness_m in &thicknesses_m {
                starts.push(vec![coverage, thickness_m, index, from_below, ratio]);
            }
        }
        // A foam hardly bends the wave, so that its fringes depend otherwise on θ.
        for quarter in 2..=12 {
            starts.push(vec![1.0, 0.25e-3 * f64::from(quarter), 1.1, 0.0, 1.6]);
        }
        starts
    }

    fn scatter(
        &self,
        values: &[f64],
        stage: &Stage,
        law: &Brdf,
        shot: &Shot,
        f_per_sr: f64,
    ) -> f64 {
        let &[coverage, thickness_m, index, from_below, substrate_ratio] = values else {
            return f_per_sr;
        };
        if coverage == 0.0 {
            return f_per_sr;
        }
        let retro = shot.to_radar();
        let frequency_hz = stage.geometry.radar.centre_frequency_ghz * 1e9;
        let eps_real = substrate(law, substrate_ratio);
        let [film, bare] = reflectances(
            [thickness_m, index],
            eps_real,
            frequency_hz,
            mirror_cosine(retro, retro).acos(),
        );
        let specular = film / bare.max(1e-9);
        let theta_rad = shot.hit.theta_rad();
        let [film, bare] = reflectances([thickness_m, index], eps_real, frequency_hz, theta_rad);
        let crossed = ((1.0 - film) / (1.0 - bare).max(1e-9)).powi(2);
        let diffuse = from_below * crossed + (1.0 - from_below) * film / bare.max(1e-9);
        let share = law.specular_share(retro, retro);
        f_per_sr * (1.0 - coverage + coverage * (share * specular + (1.0 - share) * diffuse))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Lambert;
    use crate::effects::testing::{Bench, lobe};
    use crate::units::SPEED_OF_LIGHT_M_PER_S;

    fn factor([coverage, thickness_m, index]: [f64; 3], law: &Brdf, theta_rad: f64) -> f64 {
        factor_of([coverage, thickness_m, index, 1.0, 1.0], law, theta_rad)
    }

    fn factor_of(values: [f64; 5], law: &Brdf, theta_rad: f64) -> f64 {
        let bench = Bench::plate();
        let mut shot = bench.shots[0];
        shot.hit.cos_theta = theta_rad.cos();
        ThinFilm.scatter(&values, &bench.stage(), law, &shot, 1.0)
    }

    #[test]
    fn a_film_of_no_thickness_or_of_the_substrates_index_is_the_bare_surface() {
        let law = Brdf::CookTorrance(lobe());
        let index = substrate(&law, 1.0).sqrt();
        for theta_rad in [0.0, 0.4, 1.2] {
            for film in [[1.0, 0.0, 1.6], [1.0, 4e-4, index]] {
                let found = factor(film, &law, theta_rad);
                assert!((found - 1.0).abs() < 1e-9, "{film:?} {theta_rad}: {found}");
            }
        }
    }

    #[test]
    fn a_quarter_wave_of_the_mean_index_takes_the_echo_away_and_a_half_wave_gives_it_back() {
        let law = Brdf::CookTorrance(lobe());
        let index = substrate(&law, 1.0).powf(0.25);
        let quarter_m = SPEED_OF_LIGHT_M_PER_S / 300e9 / 4.0 / index;
        assert!(factor([1.0, quarter_m, index], &law, 0.0) < 1e-20);
        assert!((factor([0.4, quarter_m, index], &law, 0.0) - 0.6).abs() < 1e-9);
        assert!((factor([1.0, 2.0 * quarter_m, index], &law, 0.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_the_surface_reflects_less_the_diffuse_part_gets() {
        let law = Brdf::Lambert(Lambert { albedo: 0.3 });
        let index = substrate(&law, 1.0).powf(0.25);
        let quarter_m = SPEED_OF_LIGHT_M_PER_S / 300e9 / 4.0 / index;
        let expected = (1.0 - USUAL_F_LAMBDA).powi(-2);
        assert!((factor([1.0, quarter_m, index], &law, 0.0) / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_diffuse_return_of_the_surface_itself_swings_with_the_mirror_part() {
        let law = Brdf::Lambert(Lambert { albedo: 0.3 });
        let quarter_m = SPEED_OF_LIGHT_M_PER_S / 300e9 / 4.0 / 2f64.sqrt();
        // A quarter wave of the mean index matches a substrate of index 2.
        let ratio = 2.0 / substrate(&law, 1.0).sqrt();
        assert!(factor_of([1.0, quarter_m, 2f64.sqrt(), 0.0, ratio], &law, 0.0) < 1e-20);
        let lost = factor_of([1.0, quarter_m, 2f64.sqrt(), 0.5, ratio], &law, 0.0);
        assert!((lost - 0.5 / (8.0f64 / 9.0).powi(2)).abs() < 1e-9);
    }

    #[test]
    fn the_lobe_of_a_rough_coated_surface_is_that_of_the_layered_model() {
        let (thickness_m, index, eps_real) = (4e-4, 1.6, 5.8);
        let lobe_rad = Some(0.3);
        let bare = Fresnel { eps_real, eps_imag: 0.0, lobe_rad };
        let layers = vec![Layer { thickness_m, eps_real: index * index, eps_imag: 0.0 }];
        let coated = Layered { layers, eps_real, eps_imag: 0.0, frequency_hz: 300e9, lobe_rad };
        // The law has no f_λ: the ratio gives the substrate's index.
        let law = Brdf::Fresnel(bare);
        let ratio = eps_real.sqrt() / substrate(&law, 1.0).sqrt();
        for theta_rad in [0.0, 0.2, 0.5, 0.8] {
            let factor = factor_of([1.0, thickness_m, index, 0.3, ratio], &law, theta_rad);
            let expected = coated.retro_per_sr(theta_rad) / bare.retro_per_sr(theta_rad);
            assert!((factor / expected - 1.0).abs() < 1e-9, "{theta_rad}: {factor} {expected}");
        }
    }
}
