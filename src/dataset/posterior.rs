//! Materials with the numbers of a fit drawn from its covariance.

use nalgebra::{DMatrix, DVector};

use super::spec::{Posterior, Spec, refused};
use super::streams::{Kind, stream};
use crate::brdf::{Brdf, Excess};
use crate::error::Error;
use crate::material::{Fit, Material};
use crate::radar::random::Draws;

/// Draws after which none is tried again: a fit whose laws are hardly ever possible.
const MOST_TRIES: usize = 1000;

/// A material as a scan has it.
#[derive(Clone, Debug)]
pub(super) struct DrawnMaterial {
    /// As the scene names it.
    pub name: String,
    /// The material, with the drawn law in the place of the fitted one.
    pub material: Material,
    /// What was drawn, by the paths of the numbers.
    pub numbers: Vec<(String, f64)>,
}

/// The law of a fit and how its numbers scatter.
#[derive(Clone, Debug)]
pub(super) struct Scatter {
    posterior: Posterior,
    material: Material,
    /// Its place among the fits of the material.
    fit: usize,
    /// Paths of the numbers that scatter, and by what a number of the fit is multiplied to be that of the path.
    paths: Vec<(String, f64)>,
    /// A factor of the covariance of these numbers.
    factor: DMatrix<f64>,
}

impl Scatter {
    /// How the numbers of a material scatter.
    ///
    /// # Errors
    /// A material without this fit, or a fit without a covariance.
    pub fn new(posterior: &Posterior, material: &Material) -> Result<Scatter, Error> {
        let Posterior { material: name, fit: wanted, .. } = posterior;
        let entry = format!("[[posterior]] of `{name}`");
        let wanted = wanted.as_ref().unwrap_or(&material.render);
        let names: Vec<&str> = material.fits.iter().map(|fit| fit.name.as_str()).collect();
        let Some(place) = names.iter().position(|known| known == wanted) else {
            let way_out = match names[..] {
                [] => "it has none: fit a curve of it, or leave the entry out".to_owned(),
                _ => format!("there are: {}", names.join(", ")),
            };
            return Err(refused(entry, format!("there is no fit `{wanted}`"), way_out));
        };
        let fit = &material.fits[place];
        let numbers = scattering_numbers(fit);
        let factor = covariance(fit, &numbers).and_then(|matrix| matrix.cholesky());
        let (Some(factor), false) = (factor, numbers.is_empty()) else {
            let problem = format!("the fit `{wanted}` has no covariance of its numbers");
            return Err(refused(
                entry,
                problem,
                "take a fit of `matdb fit`, or leave the entry out",
            ));
        };
        let paths = numbers.into_iter().map(|(_, path, scale)| (path, scale)).collect();
        let material = material.clone();
        Ok(Scatter {
            posterior: posterior.clone(),
            material,
            fit: place,
            paths,
            factor: factor.l(),
        })
    }

    /// The material as a target has it. Laws that no surface can have are drawn again.
    ///
    /// # Errors
    /// Where hardly any law that is drawn is possible.
    pub fn draw(&self, spec: &Spec, target: u64, entry: usize) -> Result<DrawnMaterial, Error> {
        let mut draws = stream(spec.seed, target, Kind::Posterior, entry);
        let fit = &self.material.fits[self.fit];
        for _ in 0..MOST_TRIES {
            let numbers = self.numbers(&fit.model, &mut draws);
            let Some(law) = with_numbers(&fit.model, &numbers) else { continue };
            if Excess::of(&law, self.material.theta_rad).is_some() {
                continue;
            }
            let mut material = self.material.clone();
            material.render.clone_from(&fit.name);
            material.fits[self.fit].model = law;
            return Ok(DrawnMaterial { name: self.posterior.material.clone(), material, numbers });
        }
        Err(Error::usage(
            format!(
                "[[posterior]] of `{}`: of {MOST_TRIES} laws that were drawn from the fit `{}` none is that of a surface",
                self.posterior.material, fit.name
            ),
            "lower inflate, or take another fit",
        ))
    }

    /// Numbers about those of the law, by their paths.
    fn numbers(&self, law: &Brdf, draws: &mut Draws) -> Vec<(String, f64)> {
        let normal = DVector::from_fn(self.paths.len(), |_, _| draws.gaussian());
        let off = self.posterior.inflate * (&self.factor * normal);
        let known = law.parameters();
        let numbers = self.paths.iter().zip(off.iter()).map(|((path, scale), off)| {
            let value =
                known.iter().find(|known| known.path == *path).map_or(0.0, |known| known.value);
            (path.clone(), value + scale * off)
        });
        numbers.collect()
    }
}

/// The numbers of a fit that scatter: the place in its covariance, the path in the law, and the factor from one to the other.
fn scattering_numbers(fit: &Fit) -> Vec<(usize, String, f64)> {
    let parameters = fit.model.parameters();
    let value_of =
        |path: &str| parameters.iter().find(|known| known.path == path).map(|known| known.value);
    let Some(report) = &fit.report else {
        let paths = fit.covariance.iter().flat_map(|covariance| &covariance.parameters).enumerate();
        return paths.map(|(place, path)| (place, path.clone(), 1.0)).collect();
    };
    let known = report.estimates.iter().enumerate().filter(|(_, one)| one.sd.is_some());
    known
        .filter_map(|(place, one)| {
            // S is proportional to f_λ and R to r_s while k stays.
            let path = match one.name.as_str() {
                "S" => "specular.f_lambda",
                "R" => "diffuse.r_s",
                path => path,
            };
            let value = value_of(path)?;
            let scale = if path == one.name { 1.0 } else { value / one.value };
            scale.is_finite().then(|| (place, path.to_owned(), scale))
        })
        .collect()
}

/// The covariance of some numbers of a fit.
fn covariance(fit: &Fit, numbers: &[(usize, String, f64)]) -> Option<DMatrix<f64>> {
    let matrix = match &fit.report {
        Some(report) => &report.covariance,
        None => &fit.covariance.as_ref()?.matrix,
    };
    let mut square = DMatrix::zeros(numbers.len(), numbers.len());
    for (row, (a, ..)) in numbers.iter().enumerate() {
        for (column, (b, ..)) in numbers.iter().enumerate() {
            let (above, below) = (matrix.get(*a)?.get(*b)?, matrix.get(*b)?.get(*a)?);
            square[(row, column)] = 0.5 * (above + below);
        }
    }
    Some(square)
}

/// A law with other numbers; none where one is out of its range.
fn with_numbers(law: &Brdf, numbers: &[(String, f64)]) -> Option<Brdf> {
    let (mut law, known) = (law.clone(), law.parameters());
    for (path, value) in numbers {
        let known = known.iter().find(|known| known.path == *path)?;
        if !(known.min..=known.max).contains(value) {
            return None;
        }
        law.set_parameter(path, *value);
    }
    law.validate().is_ok().then_some(law)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::material::{Covariance, builtin};

    fn spec() -> Spec {
        Spec::parse("name = \"s\"\nscene = \"s.toml\"\nscans = 10", Path::new("s.toml")).unwrap()
    }

    /// A material whose fit has a covariance of its first two numbers, with these standard deviations and this correlation.
    fn material(share: f64, correlation: f64) -> (Material, Vec<f64>) {
        let mut material = builtin::get("mannequin-paint").unwrap().unwrap();
        let fit = material.fits.iter_mut().find(|fit| fit.name == material.render).unwrap();
        let numbers: Vec<_> = fit.model.parameters().into_iter().take(2).collect();
        let sd: Vec<f64> = numbers.iter().map(|number| share * number.value).collect();
        let across = correlation * sd[0] * sd[1];
        let matrix = vec![vec![sd[0] * sd[0], across], vec![across, sd[1] * sd[1]]];
        let parameters = numbers.into_iter().map(|number| number.path).collect();
        fit.covariance = Some(Covariance { parameters, matrix });
        fit.report = None;
        (material, sd)
    }

    #[test]
    fn draws_have_the_covariance_of_the_fit() {
        let (material, sd) = material(0.05, 0.6);
        let posterior = Posterior { material: "paint".to_owned(), fit: None, inflate: 2.0 };
        let scatter = Scatter::new(&posterior, &material).unwrap();
        let law = &material.fits.iter().find(|fit| fit.name == material.render).unwrap().model;
        let mean: Vec<f64> = law.parameters().iter().take(2).map(|number| number.value).collect();
        const DRAWS: u64 = 4000;
        let off: Vec<[f64; 2]> = (0..DRAWS)
            .map(|target| {
                let drawn = scatter.draw(&spec(), target, 0).unwrap();
                [0, 1].map(|place| (drawn.numbers[place].1 - mean[place]) / sd[place])
            })
            .collect();
        let mean_of =
            |value: &dyn Fn(&[f64; 2]) -> f64| off.iter().map(value).sum::<f64>() / DRAWS as f64;
        // Four standard errors of moments of so many draws.
        let error = 4.0 * 4.0 * (2.0 / DRAWS as f64).sqrt();
        assert!(mean_of(&|off| off[0]).abs() < error && mean_of(&|off| off[1]).abs() < error);
        for (product, expected) in [([0, 0], 4.0), ([1, 1], 4.0), ([0, 1], 2.4)] {
            let [a, b] = product;
            let found = mean_of(&|off| off[a] * off[b]);
            assert!((found - expected).abs() < error, "{product:?}: {found}");
        }
    }

    #[test]
    fn no_law_that_is_drawn_reflects_more_than_it_receives() {
        let (material, _) = material(0.9, 0.0);
        let posterior = Posterior { material: "paint".to_owned(), fit: None, inflate: 1.0 };
        let scatter = Scatter::new(&posterior, &material).unwrap();
        for target in 0..50 {
            let drawn = scatter.draw(&spec(), target, 0).unwrap().material;
            let law = &drawn.fits.iter().find(|fit| fit.name == drawn.render).unwrap().model;
            assert_eq!(Excess::of(law, drawn.theta_rad), None);
        }
    }
}
